"""Coarse faces cut along the borders between parts: the same closed surface, each face within one part."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.cleaning.segmentation import segment_faces
from partwright.cleaning.splitting import split_at_borders
from partwright.cli.main import main
from partwright.fields import Box, Sphere


def bar(border: float) -> tuple[trimesh.Trimesh, Assembly]:
    """Twelve faces 4 long, and two boxes that meet at x = border."""
    left, right = border + 2, 2 - border
    parts = (
        Part(Box((left, 1, 1)), (left / 2 - 2, 0, 0), name="left"),
        Part(Box((right, 1, 1)), (2 - right / 2, 0, 0), name="right"),
    )
    return trimesh.creation.box((4, 1, 1)), Assembly(parts)


@pytest.mark.parametrize("border", [0.0, 0.7, -1.3])
def test_faces_end_at_the_border(border: float) -> None:
    mesh, assembly = bar(border)
    vertices, faces, source = split_at_borders(mesh.vertices, mesh.faces, assembly)
    cut = trimesh.Trimesh(vertices, faces, process=False)
    assert cut.is_watertight
    assert cut.volume == pytest.approx(4.0)
    assert np.allclose(cut.face_normals, mesh.face_normals[source], atol=1e-6)
    labels, names = segment_faces(vertices, faces, assembly)
    assert names == ("left", "right")
    own = np.array([cut.area_faces[labels == i].sum() for i in (0, 1)])
    assert own == pytest.approx([1 + 4 * (border + 2), 1 + 4 * (2 - border)], rel=0.01)
    wrong = np.where(
        labels == 0, cut.triangles[..., 0].max(axis=1) - border, border - cut.triangles[..., 0].min(axis=1)
    )
    assert wrong.max() < 0.02


def test_a_surface_of_one_part_stays_as_it_is() -> None:
    mesh = trimesh.creation.icosphere(2)
    vertices, faces, source = split_at_borders(mesh.vertices, mesh.faces, Assembly((Part(Sphere(1.0)),)))
    assert np.array_equal(vertices, mesh.vertices)
    assert np.array_equal(faces, mesh.faces)
    assert source.tolist() == list(range(len(faces)))


def test_a_spot_in_the_middle_of_coarse_faces_is_found() -> None:
    mesh = trimesh.creation.box((4, 1, 1))
    core, spot = Part(Box((3.8, 0.8, 0.8)), name="core"), Part(Sphere(0.2), (0.6, 0, 0.3), name="spot")
    assembly = Assembly((core, spot))
    vertices, faces, _ = split_at_borders(mesh.vertices, mesh.faces, assembly)
    labels, _ = segment_faces(vertices, faces, assembly)
    cut = trimesh.Trimesh(vertices, faces, process=False)
    assert cut.is_watertight
    reach = np.sqrt(0.3**2 - 0.2**2)  # there the ball is as far as the core: 0.1
    assert cut.area_faces[labels == 1].sum() == pytest.approx(np.pi * reach**2, rel=0.15)  # by chords


def test_the_command_keeps_within_given_labels(tmp_path: Path) -> None:
    mesh, assembly = bar(0.7)
    mesh.export(tmp_path / "bar.ply")
    assembly.save(tmp_path / "bar.json")
    (tmp_path / "coarse.json").write_text(
        json.dumps(["up" if n[2] > 0.5 else "rest" for n in mesh.face_normals])
    )
    command = ["segment", str(tmp_path / "bar.ply"), str(tmp_path / "bar.json"), "--split", "-o"]
    assert main([*command, str(tmp_path / "out.ply"), "--within", str(tmp_path / "coarse.json")]) == 0
    about = json.loads((tmp_path / "out.ply.labels.json").read_text())
    assert about["names"] == ["rest/left", "rest/right", "up/left", "up/right"]
    out = trimesh.load_mesh(tmp_path / "out.ply", process=False)
    assert len(out.faces) == about["faces"] > 12
    top = np.isin(about["labels"], [2, 3])
    assert (out.face_normals[top, 2] > 0.99).all()
    assert out.area_faces[top].sum() == pytest.approx(4.0)
