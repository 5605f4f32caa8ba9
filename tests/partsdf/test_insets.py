"""Parts that lie in others are told where they stand out of these or are covered, and put back."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from partwright.partsdf.editing import moved as moved_part
from partwright.partsdf.generator import Draw, load_generator
from partwright.partsdf.insets import Inset, Reach, insets, put_back, reaches
from partwright.partsdf.matching_forms import WholeShapes
from partwright.partsdf.meshing import mesh_parts
from partwright.partsdf.model import load_model
from partwright.partsdf.nearness import from_others
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.resampling import Sample, _mended
from partwright.partsdf.soundness import Judge


class Pane:
    """A block with its top at z = 0, a thin pane around that height, and a ball beside them."""

    def __init__(self, height: float = 0.0) -> None:
        self.height = height

    def names(self) -> list[str]:
        return ["block", "pane", "ball"]

    def part_distances(self, points: np.ndarray) -> np.ndarray:
        boxes = (((0, 0, -0.5), (0.5, 0.5, 0.5)), ((0, 0, self.height), (0.2, 0.2, 0.01)))
        blocks = [(np.abs(points - c) - h).max(axis=1) for c, h in boxes]
        return np.stack([*blocks, np.linalg.norm(points - (2, 0, 0), axis=1) - 0.3])

    def in_box(self, name: str, points: np.ndarray) -> np.ndarray:
        centre, half = {
            "block": ((0, 0, -0.5), (0.5, 0.5, 0.5)),
            "pane": ((0, 0, self.height), (0.2, 0.2, 0.01)),
            "ball": ((2, 0, 0), (0.3, 0.3, 0.3)),
        }[name]
        return np.asarray((points - centre) / np.array(half))

    def meshes(self) -> dict[str, trimesh.Trimesh]:
        pane = trimesh.creation.box((0.4, 0.4, 0.02)).subdivide_to_size(0.02)
        return {
            "block": trimesh.creation.box((1, 1, 1)).apply_translation((0, 0, -0.5)),
            "pane": pane.apply_translation((0, 0, self.height)),
            "ball": trimesh.creation.icosphere(3, 0.3).apply_translation((2, 0, 0)),
        }


def _known(*heights: float) -> dict[str, Reach]:
    panes: list[Any] = [Pane(height) for height in heights]
    return reaches((pane, pane.meshes(), from_others(pane, pane.meshes())) for pane in panes)


def _pane(height: float, known: dict[str, Reach]) -> Inset:
    pane: Any = Pane(height)
    found = insets(pane, pane.meshes(), known, from_others(pane, pane.meshes()))
    return next(one for one in found if one.part == "pane")


def test_what_lies_in_others_is_known_from_training_shapes() -> None:
    """A pane that reaches one to three hundredths above its block, two usually; neither the block nor the
    ball lies in anything."""
    known = _known(0.0, 0.01, 0.02)
    usual, most, *_ = known["pane"]
    assert (usual, most) == pytest.approx((0.025, 0.035), abs=1e-6)
    assert known["block"].most == known["ball"].most == np.inf
    found = _pane(0.0, known)
    assert (found.share, found.stands_out, found.covered, found.reach.lies_in) == (0.0, False, False, True)
    assert found.limit == known["pane"].most
    found = _pane(0.1, known)
    assert (found.share, found.stands_out, found.limit) == (1.0, True, known["pane"].usual)
    assert found.points.shape == (300, 3)


def test_what_is_covered_is_told_and_where_it_should_show() -> None:
    """Of a pane that is half in its block all shows but the lowest of three layers of cells."""
    known = _known(0.0, 0.0)
    shown = known["pane"].shown
    mesh = Pane().meshes()["pane"]
    assert shown == pytest.approx((mesh.vertices[:, 2] > -0.003).mean())
    found = _pane(-0.005, known)  # the upper face is still out of it
    assert (found.covered, found.amiss) == (False, 0.0)
    found = _pane(-0.05, known)
    assert (found.covered, found.stands_out, found.shown, found.amiss) == (True, False, 0.0, 1.0)
    np.testing.assert_array_equal(found.shows, found.points[:, 2] > -0.05 - 0.01 / 3)


@pytest.fixture(scope="module")
def judge() -> Iterator[Judge]:
    """Who has looked at three training shapes, and at the walls of eight."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("partwright.partsdf.soundness._JUDGES", 3)
        patch.setattr("partwright.partsdf.soundness._WALLS", 8)
        yield Judge(load_model("vehicles"))


@pytest.fixture
def as_denoised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forms that match one another as badly as noise has them."""
    monkeypatch.setattr(WholeShapes, "matching", lambda self, layouts, forms: forms)


@pytest.mark.heavy
@pytest.mark.usefixtures("as_denoised")
@pytest.mark.parametrize(
    ("number", "seed", "fault"),
    [
        (2, 1, "window_back stands out of the others"),
        (3, 0, "lights_front stands out of the others"),
        (10, 0, "lights_front is covered by others"),
    ],
)
def test_what_stands_out_or_is_covered_of_new_vehicles_is_put_back(
    number: int, seed: int, fault: str, judge: Judge
) -> None:
    """A rear window that reaches above the roof, lights before the nose and lights within it; with them goes
    what came through. What lies in nothing, as the body, stays to the bit."""
    model = judge.model
    (made,) = load_generator(model).generate([Draw(number)], seed)
    before = judge(made)
    assert fault in before.faults()
    after = _mended(Sample(made, before, 1), judge, [], keep_layout=False)
    others = [one for one in before.faults() if "stands out" not in one and "is covered" not in one]
    assert set(after.soundness.faults()) <= set(others)  # such as a window in two pieces
    rest = [model.index(name) for name in ("body", "wheel_front_left", "mirror_left")]
    for mine, theirs in zip(
        (after.shape.latents, *after.shape.poses), (made.latents, *made.poses), strict=True
    ):
        assert torch.equal(mine[rest], theirs[rest])


def test_what_is_covered_comes_to_show(judge: Judge) -> None:
    """A windscreen sunk into the body, which covers all but a fiftieth of it."""
    made = moved_part(NeuralShape.trained(judge.model, "vehicle_0006"), "windscreen", (0, 0.1, -0.1))
    told = judge(made)
    assert told.covered == ("windscreen",)
    assert next(one.shown for one in told.insets if one.part == "windscreen") < 0.02
    moved = put_back(made, told.insets)
    assert (from_others(moved, mesh_parts(moved, 64))["windscreen"] > -0.003).mean() > 0.2


@pytest.mark.usefixtures("as_denoised")
def test_parts_that_are_kept_and_poses_that_are_held_stay(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("partwright.partsdf.insets._STEPS", 12)
    model = judge.model
    (made,) = load_generator(model).generate([Draw(1)], 0)
    told = judge(made)
    moved = put_back(made, told.insets, ["windows_left"], move_pose=False)
    left, right = (model.index(f"windows_{side}") for side in ("left", "right"))
    assert all(torch.equal(a, b) for a, b in zip(moved.poses, made.poses, strict=True))
    assert torch.equal(moved.latents[left], made.latents[left])
    assert not torch.equal(moved.latents[right], made.latents[right])
    before, after = (
        next(one.share for one in judged.insets if one.part == "windows_right")
        for judged in (told, judge(moved))
    )
    assert after < 0.95 * before  # and more steps take it back within
    assert _mended(Sample(made, told, 1), judge, model.parts, keep_layout=False).shape is made
