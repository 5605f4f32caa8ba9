"""Prepared families come back as they were written, and broken ones are refused by name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.datasets.poses import Poses, average_poses, mean_rotation
from partwright.datasets.prepared import MANIFEST, PreparedFamily, PreparedShape, write_family
from partwright.errors import FamilyError, NewerVersionError, UnreadableFileError
from partwright.shapes import UnitFrame

PARTS = ("left", "right")


def two_balls(name: str, radius: float) -> PreparedShape:
    """Two balls beside one another, with their analytic distance."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (500, 3)).astype(np.float32)
    centres = np.array([[-0.45, 0, 0], [0.45, 0, 0]], np.float32)
    each = np.linalg.norm(points[:, None] - centres, axis=2) - radius
    ball = trimesh.creation.icosphere(1, radius)
    return PreparedShape(
        name,
        points,
        each.min(axis=1).astype(np.float32),
        each.argmin(axis=1).astype(np.int8),
        Poses(centres, np.tile([1, 0, 0, 0], (2, 1)).astype(np.float32), np.full((2, 3), radius, np.float32)),
        np.ones(2, np.uint8),
        np.concatenate([ball.vertices + c for c in centres]).astype(np.float32),
        np.concatenate([ball.faces, ball.faces + len(ball.vertices)]).astype(np.int32),
        np.repeat([0, 1], len(ball.faces)).astype(np.int8),
        UnitFrame((1.0, 2.0, 3.0), 0.5),
    )


def written(folder: Path) -> PreparedFamily:
    shapes = [two_balls("small", 0.3), two_balls("large", 0.4)]
    average = average_poses(np.ones((2, 2), bool), [s.poses for s in shapes])
    return write_family(folder, "balls", PARTS, [(shapes[0], "train"), (shapes[1], "test")], average, seed=7)


def test_a_family_comes_back_as_it_was_written(tmp_path: Path) -> None:
    family = written(tmp_path)
    assert (family.name, family.parts, family.seed, family.samples) == ("balls", PARTS, 7, 500)
    assert family.split("train") == [0]
    assert family.split("test", "validation") == [1]
    shape, expected = family.load(1), two_balls("large", 0.4)
    for field in ("points", "sdf", "part", "present", "vertices", "faces", "label"):
        value = getattr(shape, field)
        np.testing.assert_array_equal(value, getattr(expected, field))
        assert value.dtype == getattr(expected, field).dtype
    np.testing.assert_array_equal(shape.rotation, expected.rotation)
    assert shape.frame == expected.frame
    np.testing.assert_allclose(family.average_pose.scale, np.sqrt(0.3 * 0.4), rtol=1e-6)


def test_the_same_family_is_the_same_bytes(tmp_path: Path) -> None:
    written(tmp_path / "a")
    written(tmp_path / "b")
    for file in (MANIFEST, "shapes/small.safetensors"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_damage_is_refused_by_name(tmp_path: Path) -> None:
    family = written(tmp_path)
    path = tmp_path / "shapes/large.safetensors"
    whole = path.read_bytes()
    path.write_bytes(whole[:-4] + bytes(4))
    with pytest.raises(UnreadableFileError, match=r"large.safetensors: is not the file that was prepared"):
        family.load(1)
    for cut in (0, 4, 300, len(whole) - 1):
        path.write_bytes(whole[:cut])
        with pytest.raises(UnreadableFileError, match="large"):
            family.load(1, verify=False)
    path.unlink()
    with pytest.raises(UnreadableFileError, match="large"):
        family.load(1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.full((500, 3), np.nan, np.float32)}, "points holds NaN"),
        ({"sdf": np.zeros(499, np.float32)}, "sdf is float32 of shape"),
        ({"part": np.full(500, 2, np.int8)}, "part goes beyond 0 to 1"),
        ({"label": np.full(160, -1, np.int8)}, "label goes beyond"),
    ],
)
def test_arrays_that_do_not_fit_are_not_written(
    tmp_path: Path, change: dict[str, np.ndarray], message: str
) -> None:
    shape = replace(two_balls("odd", 0.3), **change)
    with pytest.raises(FamilyError, match=f"odd: {message}"):
        write_family(tmp_path, "balls", PARTS, [(shape, "train")], shape.poses)
    assert not (tmp_path / MANIFEST).exists()


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"format": "something"}, FamilyError),
        ({"version": 99}, NewerVersionError),
        ({"version": "1"}, FamilyError),
        ({"shapes": [{"name": "a", "file": "../a", "split": "train", "hash": ""}]}, FamilyError),
        ({"shapes": [{"name": "a", "file": "a", "split": "rest", "hash": ""}]}, FamilyError),
        ({"average_pose": {}}, FamilyError),
    ],
)
def test_manifests_that_break_the_format(
    tmp_path: Path, change: dict[str, object], error: type[Exception]
) -> None:
    written(tmp_path)
    data = json.loads((tmp_path / MANIFEST).read_text())
    (tmp_path / MANIFEST).write_text(json.dumps(data | change))
    with pytest.raises(error, match=MANIFEST):
        PreparedFamily(tmp_path)
    (tmp_path / MANIFEST).write_text(json.dumps(data)[:-9])
    with pytest.raises(FamilyError, match="not complete JSON"):
        PreparedFamily(tmp_path)


def test_a_folder_without_manifest(tmp_path: Path) -> None:
    with pytest.raises(UnreadableFileError, match=r"family.json: no such file; check the path"):
        PreparedFamily(tmp_path)


def test_the_mean_rotation_does_not_mind_signs() -> None:
    turn = np.array([np.cos(0.1), np.sin(0.1), 0, 0])
    back = np.array([np.cos(0.1), -np.sin(0.1), 0, 0])
    np.testing.assert_allclose(mean_rotation(np.stack([turn, -back])), [1, 0, 0, 0], atol=1e-12)


def test_missing_parts_do_not_enter_the_average() -> None:
    shape = two_balls("a", 0.3).poses
    far = Poses(shape.translation + 9, shape.rotation, shape.scale)
    average = average_poses(np.array([[True, True], [True, False]]), [shape, far])
    np.testing.assert_allclose(average.translation[:, 0], [-0.45 + 4.5, 0.45])
