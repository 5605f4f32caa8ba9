"""Parts that lie in others are told where they stand out of these, and put back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from partwright.partsdf.generator import Draw, load_generator
from partwright.partsdf.insets import insets, put_back, reaches
from partwright.partsdf.model import load_model
from partwright.partsdf.nearness import from_others
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

    def meshes(self) -> dict[str, trimesh.Trimesh]:
        pane = trimesh.creation.box((0.4, 0.4, 0.02)).subdivide_to_size(0.02)
        return {
            "block": trimesh.creation.box((1, 1, 1)).apply_translation((0, 0, -0.5)),
            "pane": pane.apply_translation((0, 0, self.height)),
            "ball": trimesh.creation.icosphere(3, 0.3).apply_translation((2, 0, 0)),
        }


def _off(pane: Any) -> dict[str, np.ndarray]:
    return from_others(pane, pane.meshes())


def test_what_lies_in_others_is_known_from_training_shapes() -> None:
    """A pane that reaches one to three hundredths above its block, two usually; neither the block nor the
    ball lies in anything."""
    panes: list[Any] = [Pane(height) for height in (0.0, 0.01, 0.02)]
    known = reaches([_off(one) for one in panes])
    assert list(known) == ["pane"]
    assert known["pane"] == pytest.approx((0.025, 0.035), abs=1e-6)
    (found,) = insets(panes[0].meshes(), known, _off(panes[0]))
    assert (found.part, found.share, found.stands_out) == ("pane", 0.0, False)
    assert found.limit == known["pane"].most
    above: Any = Pane(0.1)
    (found,) = insets(above.meshes(), known, _off(above))
    assert (found.share, found.stands_out, found.limit) == (1.0, True, known["pane"].usual)
    assert found.points.shape == (300, 3)


@pytest.fixture(scope="module")
def judge() -> Judge:
    return Judge(load_model("vehicles"))


@pytest.mark.heavy
@pytest.mark.parametrize(("number", "part"), [(3, "windows_right"), (5, "lights_front")])
def test_what_stands_out_of_new_vehicles_is_put_back(number: int, part: str, judge: Judge) -> None:
    """Windows that reach above the roof, and lights before the nose; with them goes what came through. What
    lies in nothing, as the body, stays to the bit."""
    model = judge.model
    (made,) = load_generator(model).generate([Draw(number)], 0)
    before = judge(made)
    assert f"{part} stands out of the others" in before.faults()
    after = _mended(Sample(made, before, 1), judge, [], keep_layout=False)
    assert after.soundness.faults() == []
    rest = [model.index(name) for name in ("body", "wheel_front_left", "mirror_left")]
    for mine, theirs in zip(
        (after.shape.latents, *after.shape.poses), (made.latents, *made.poses), strict=True
    ):
        assert torch.equal(mine[rest], theirs[rest])


def test_parts_that_are_kept_and_poses_that_are_held_stay(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("partwright.partsdf.insets._STEPS", 12)
    model = judge.model
    (made,) = load_generator(model).generate([Draw(3)], 0)
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
