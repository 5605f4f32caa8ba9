"""A folder of meshes comes out as the same folder of convex pieces."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from partwright.errors import RobotError
from partwright.robots.collide import CollideOptions, collide, save
from partwright.robots.opening import open_robot


def test_meshes_of_folders_within_it_come_along_where_they_lie(tmp_path: Path) -> None:
    given = tmp_path / "in"
    (given / "arm" / "upper").mkdir(parents=True)
    (given / ".cache").mkdir()
    trimesh.creation.box((1.0, 2.0, 3.0)).export(given / "base.stl")
    trimesh.creation.icosphere(radius=0.5).export(given / "arm" / "upper" / "ball.obj")
    trimesh.creation.box((1.0, 1.0, 1.0)).export(given / ".cache" / "old.stl")
    assert [link.name for link in open_robot(given).links] == ["arm/upper/ball.obj", "base.stl"]
    save(collide(given, CollideOptions(max_parts=1)), tmp_path / "out")
    ball = trimesh.load(tmp_path / "out" / "arm" / "upper" / "ball.obj", force="mesh")
    assert ball.is_convex
    assert ball.bounds == pytest.approx(trimesh.creation.icosphere(radius=0.5).bounds, abs=1e-6)
    assert trimesh.load(tmp_path / "out" / "base.stl").volume == pytest.approx(6.0)
    assert not (tmp_path / "out" / ".cache").exists()


def test_what_was_made_of_a_folder_and_lies_in_it_is_not_taken_for_more_of_it(tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "base.stl")
    save(collide(tmp_path, CollideOptions(max_parts=1)), tmp_path / "hulls")
    assert (tmp_path / "hulls" / "base.stl").is_file()
    assert [link.name for link in open_robot(tmp_path).links] == ["base.stl"]


def test_a_folder_without_meshes_is_none(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none")
    with pytest.raises(RobotError, match="no mesh is in this folder"):
        open_robot(tmp_path)
