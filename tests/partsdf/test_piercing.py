"""A part that comes through another is told by how much, and drawn back alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from partwright.partsdf.editing import moved
from partwright.partsdf.model import Model
from partwright.partsdf.nearness import from_others
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.piercing import Tip, drawn_back, tips
from partwright.partsdf.resampling import Sample, _mended, sound_samples
from partwright.partsdf.soundness import THROUGH, Judge, Soundness

RADIUS, LENGTH, THIN = 0.1, 1.0, 0.02


class Rod:
    """A square rod along z, from -1 to 0, and a plate thinner than the edges of its mesh, whose top is at
    `height`."""

    def __init__(self, height: float) -> None:
        self.height = height

    def names(self) -> list[str]:
        return ["rod", "plate"]

    def part_distances(self, points: np.ndarray) -> np.ndarray:
        boxes = (
            ((0, 0, -LENGTH / 2), (RADIUS, RADIUS, LENGTH / 2)),
            ((0, 0, self.height - THIN / 2), (0.5, 0.5, THIN / 2)),
        )
        return np.stack([(np.abs(points - c) - h).max(axis=1) for c, h in boxes])

    def meshes(self) -> dict[str, trimesh.Trimesh]:
        rod = trimesh.creation.box((2 * RADIUS, 2 * RADIUS, LENGTH)).subdivide_to_size(0.05)
        plate = trimesh.creation.box((1, 1, THIN)).subdivide_to_size(0.05)
        return {
            "rod": rod.apply_translation((0, 0, -LENGTH / 2)),
            "plate": plate.apply_translation((0, 0, self.height - THIN / 2)),
        }


def _tips(rod: Any, meshes: dict[str, trimesh.Trimesh] | None = None) -> list[Tip]:
    parts = rod.meshes() if meshes is None else meshes
    return tips(rod, parts, from_others(rod, parts))


@pytest.mark.parametrize("beyond", [0.025, 0.05])
def test_what_came_through_is_measured(beyond: float) -> None:
    """The end of a rod that stands out by so much on the other side of a thin plate; not the plate, which the
    rod does not divide, and not a rod that ends in it or goes through its middle."""
    rod: Any = Rod(-beyond)
    (tip,) = _tips(rod)
    assert tip.part == "rod"
    area = 4 * RADIUS**2 + 8 * RADIUS * beyond
    assert tip.area == pytest.approx(area, rel=0.15)  # by whole triangles
    assert tip.share == pytest.approx(area / (8 * RADIUS**2 + 8 * RADIUS * LENGTH), rel=0.15)
    assert tip.points[:, 2].min() > -beyond - 1e-6
    assert tip.rest[:, 2].max() < -beyond - THIN + 1e-6
    for height in (THIN / 2, -LENGTH / 2):
        none: Any = Rod(height)
        assert _tips(none) == []


def test_what_nobody_can_see_did_not_come_through() -> None:
    """The same end of the rod, within a closed shell."""
    rod: Any = Rod(-0.05)
    meshes = rod.meshes()
    assert [tip.part for tip in _tips(rod, meshes)] == ["rod"]
    meshes["plate"] = trimesh.util.concatenate([meshes["plate"], trimesh.creation.box((0.6, 0.6, 0.3))])
    assert "rod" not in [tip.part for tip in _tips(rod, meshes)]
    assert _tips(rod, {}) == []


def test_a_ball_that_came_through_its_plate_is_drawn_back(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It alone moves, its pose only where it may. Of samples, unless they are taken as they come, or it is to
    stay."""
    for name, value in {"_JUDGES": 1, "_COARSE": 48, "_FINE": 48}.items():
        monkeypatch.setattr(f"partwright.partsdf.soundness.{name}", value)
    judge = Judge(model)
    known = NeuralShape.trained(model, "lamp2")
    assert judge(known).through == ()
    # How deep it has to be to be seen, and not yet covered, is the trained model's.
    depths = [2 * float(known.poses.scale[0, 2]) + 0.1 + 0.005 * step for step in range(16)]
    sunk = (moved(known, "ball", (0, 0, -depth)) for depth in depths)
    broken, found = next(
        (one, told) for one in sunk if (told := judge(one)).seen_through == ("ball",) and not told.covered
    )
    (tip,) = found.through
    assert tip.part == "ball"
    assert tip.share > THROUGH
    assert found.faults() == [*found.breaks(), "ball comes through another part"]
    assert replace(found, through=(replace(tip, share=0.015),)).faults() == found.breaks()
    sample = Sample(broken, found, 1)
    assert _mended(sample, judge, ["ball"], keep_layout=False) is sample
    mended = _mended(sample, judge, [], keep_layout=False)
    assert mended.soundness.through == ()
    # Where two other parts that lie oddly are the worst of it, nothing is drawn back for nothing.
    odd = replace(found, offset=1.0, offset_between=("plate", "knob"))
    other = Sample(broken, odd, 1)
    assert _mended(other, judge, [], keep_layout=False) is other
    for mine, theirs in zip(
        (mended.shape.latents, *mended.shape.poses), (broken.latents, *broken.poses), strict=True
    ):
        assert torch.equal(mine[[0, 2]], theirs[[0, 2]])
    monkeypatch.setattr("partwright.partsdf.piercing._STEPS", 2)
    formed = drawn_back(broken, tip, move_pose=False)
    assert all(torch.equal(a, b) for a, b in zip(formed.poses, broken.poses, strict=True))
    assert not torch.equal(formed.latents[1], broken.latents[1])
    made: Any = SimpleNamespace(model=model, generate=lambda *_, **__: [broken])
    assert next(sound_samples(made, 1, tries=1)).shape is broken


def test_a_part_that_cannot_be_drawn_back_does_not_keep_others_from_it(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The knob stays as it is, whatever is done; the ball comes back at once."""
    shape, none = NeuralShape.trained(model, "lamp0"), np.zeros((0, 3), np.float32)

    def judge(found: NeuralShape) -> Soundness:
        out = [part for part in ("knob", "ball") if part == "knob" or found.latents[1, 0] < 100]
        through = tuple(Tip(part, 0.1, 0.1, none, none) for part in out)
        return Soundness((), 0.0, (), 1.0, 0.0, (), through)

    asked: list[str] = []

    def back(found: NeuralShape, tip: Tip, move_pose: bool) -> NeuralShape:
        asked.append(tip.part)
        latents = found.latents.clone()
        latents[model.index(tip.part), 0] = 100.0
        return replace(found, latents=latents)

    monkeypatch.setattr("partwright.partsdf.resampling.drawn_back", back)
    mended = _mended(Sample(shape, judge(shape), 1), judge, [], keep_layout=False)  # type: ignore[arg-type]
    assert asked == ["knob", "ball"]
    assert [tip.part for tip in mended.soundness.through] == ["knob"]
    assert mended.shape.latents[2].equal(shape.latents[2])  # nor is the knob changed for nothing
