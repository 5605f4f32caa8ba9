"""What is read of folders of shapes: which files, the axis that they name, and what could not be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from partwright.datasets import prepare
from partwright.datasets.inputs import find_shapes
from partwright.datasets.prepared import read_about
from tests.datasets.test_preparing import parts_of


def test_a_part_whose_format_names_no_axis_leaves_it_to_the_others(tmp_path: Path) -> None:
    folder = tmp_path / "thing"
    folder.mkdir()
    (foot, *others) = parts_of(1).items()
    foot[1].export(folder / f"{foot[0]}.stl")
    for name, mesh in others:
        mesh.export(folder / f"{name}.glb")
    (source,) = find_shapes(tmp_path)
    assert source.read().up == "y"


def test_what_of_a_scene_was_not_read_is_kept(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for number in range(2):
        scene = trimesh.Scene(parts_of(1 + 0.1 * number))
        scene.add_geometry(trimesh.PointCloud(np.eye(3)), geom_name="dust")
        scene.export(tmp_path / "in" / f"thing_{number}.glb")
    told = "left out 3 points that came without faces beside the mesh"
    assert [source.read().unread for source in find_shapes(tmp_path / "in")] == [(told,)] * 2
    family = prepare(tmp_path / "in", tmp_path / "out", samples=1000, workers=1).family
    about = read_about(family.folder / family.shapes[0].file)
    assert about["unread"] == [told]
    assert told not in about["repairs"]


def test_files_are_told_by_their_suffixes(tmp_path: Path) -> None:
    for name in ("a.step", "b.STP", "c.glb", "d.txt"):
        (tmp_path / name).write_bytes(b"")
    assert [source.name for source in find_shapes(tmp_path)] == ["a", "b", "c"]
