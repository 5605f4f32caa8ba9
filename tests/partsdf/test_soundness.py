"""New shapes whose parts come apart are told, and made anew, the same ones by the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from partwright.errors import SettingError
from partwright.partsdf.editing import moved
from partwright.partsdf.generator import Draw, GeneratorSettings
from partwright.partsdf.generator_training import train_generator
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.piercing import Tip
from partwright.partsdf.resampling import sound_samples
from partwright.partsdf.soundness import (
    GAP,
    OFFSET,
    THIN,
    Judge,
    Soundness,
    largest_offset,
    layout_faults,
    widest_gap,
)
from tests.partsdf.lamps import exact_distances


def box(size: float, x: float) -> trimesh.Trimesh:
    return trimesh.creation.box([size] * 3).subdivide().apply_translation((x, 0, 0))


def test_the_widest_gap_is_the_one_that_has_to_be_bridged() -> None:
    """Three blocks in a row, .1 and .3 apart; crumbs and the walls of a cavity are no pieces."""
    row = {"a": box(1, 0), "b": box(1, 1.1), "c": box(1, 2.4)}
    gap, between = widest_gap(row)
    assert gap == pytest.approx(0.3)
    assert set(between) == {"b", "c"}
    assert widest_gap({"a": box(1, 0), "b": box(1, 1.0)})[0] == pytest.approx(0, abs=1e-9)
    assert widest_gap({"a": box(1, 0)}) == (0.0, ())
    cavity = box(0.5, 0)
    cavity.invert()
    crumb = box(0.05, 0.9)
    one = trimesh.util.concatenate([box(1, 0), cavity, crumb])
    assert widest_gap({"a": one, "b": box(1, 1.1)})[0] == pytest.approx(0.1)
    two = trimesh.util.concatenate([box(1, 0), box(0.3, 1.15)])  # a twelfth of its surface, half a block away
    gap, between = widest_gap({"a": two})
    assert (gap, between) == (pytest.approx(0.5), ("a", "a"))


def test_parts_lie_to_each_other_as_in_training(model: Model) -> None:
    """Balls stand on plates: one that is moved along z lies beyond what is known, by as much."""
    for name in model.shapes[:4]:
        assert largest_offset(NeuralShape.trained(model, name))[0] <= 0
    known = NeuralShape.trained(model, "lamp2")  # without a knob
    far, farther = (largest_offset(moved(known, "ball", (0, 0, by))) for by in (0.3, 0.4))
    assert farther[0] - far[0] == pytest.approx(0.1, abs=1e-5)
    assert far[0] > OFFSET
    assert far[1] == ("plate", "ball")
    alone = replace(known, present=torch.tensor([True, False, False]))
    assert largest_offset(alone) == (0.0, ())


def test_a_lamp_in_two_is_told(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("partwright.partsdf.soundness._JUDGES", 2)
    judge = Judge(model)
    known = NeuralShape.trained(model, "lamp2")
    assert judge(known).faults() == []
    assert judge(known).badness <= 1
    apart = judge(moved(known, "ball", (0, 0, 0.25)))
    assert 5 * GAP < apart.gap < 0.3  # the parts hear of one another, so they lean over
    assert apart.faults() == [
        f"plate and ball are {apart.gap:.2f} apart",
        f"plate and ball lie as in no training shape, by {apart.offset:.2f}",
    ]
    assert apart.badness > 1
    gone = Soundness(("ball",), 0.0, (), GAP, 0.0, ())
    assert gone.faults() == ["ball has no surface"]
    assert gone.badness > 1


def test_a_part_thinner_than_in_any_training_shape_is_told(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("partwright.partsdf.soundness._JUDGES", 2)
    monkeypatch.setattr(NeuralShape, "part_distances", exact_distances)
    judge = Judge(model)
    least = float(model.poses.scale[:, 1].min())
    known = NeuralShape.trained(model, model.shapes[int(model.poses.scale[:, 1, 0].argmin())])
    assert judge(known).thickness == pytest.approx(1, abs=1e-5)
    assert judge(known).faults() == []
    for share in (0.9, 0.5):
        scale = known.poses.scale.clone()
        scale[1] = share * least
        said = judge(replace(known, poses=known.poses._replace(scale=scale)))
        assert (said.thickness, said.thinnest) == (pytest.approx(share, rel=0.01), "ball")
        told = f"ball is {said.thickness:.2f} times as thick as the thinnest in training"
        assert (told in said.breaks()) == (share < THIN)
        assert (said.badness > 1) >= (share < THIN)


class Scripted:
    """A generator whose shapes are known: a lamp with its ball as high as is said, by number and attempt."""

    def __init__(self, model: Model, heights: dict[Draw, float]) -> None:
        self.model, self.heights = model, heights
        self.asked: list[Draw] = []
        self.changes: list[float] = []

    def generate(
        self,
        count: int | Sequence[Draw],
        seed: int,
        source: NeuralShape | None = None,
        *rest: object,
        change: float = 0.0,
    ) -> list[NeuralShape]:
        self.changes.append(change)
        draws = [Draw(i) for i in range(count)] if isinstance(count, int) else list(count)
        self.asked += draws
        lamp = NeuralShape.trained(self.model, "lamp2")
        return [moved(lamp, "ball", (0, 0, self.heights.get(draw, 0.0))) for draw in draws]


class ByHeight(Judge):
    def __call__(self, shape: NeuralShape) -> Soundness:
        gap = float(
            shape.poses.translation[1, 2] - NeuralShape.trained(self.model, "lamp2").poses.translation[1, 2]
        )
        return Soundness((), gap, ("plate", "ball"), GAP, 0.0, ())


def test_what_is_broken_is_made_anew_and_the_least_broken_stays(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("partwright.partsdf.resampling.Judge", ByHeight)
    heights = {Draw(1): 0.3, Draw(2): 0.3, Draw(2, 1): 0.15, Draw(2, 2): 0.4}
    generator = Scripted(model, heights)
    told: list[float] = []
    made = list(sound_samples(generator, 3, tries=3, told=told.append))  # type: ignore[arg-type]
    assert generator.asked == [*map(Draw, range(3)), Draw(1, 1), Draw(2, 1), Draw(2, 2)]
    assert generator.changes == [0.0, 0.6, 0.6, 0.7]  # more of the first one goes with each try
    assert [one.tries for one in made] == [1, 2, 3]
    assert [bool(one.soundness.faults()) for one in made] == [False, False, True]
    lifted = made[2].shape.poses.translation[1] - made[0].shape.poses.translation[1]
    assert float(lifted[2]) == pytest.approx(0.15, abs=1e-6)
    assert told == pytest.approx([1 / 3, 2 / 3, 1])
    never = {Draw(0, attempt): 0.3 for attempt in range(7)}
    generator = Scripted(model, never)
    list(sound_samples(generator, 1, tries=7))  # type: ignore[arg-type]
    assert generator.changes == [0.0, 0.6, 0.7, 0.8, 0.9, 0.0, 0.0]  # then nothing of it is left
    with pytest.raises(SettingError, match="tries: expected a whole number of at least 1"):
        list(sound_samples(generator, 3, tries=0))  # type: ignore[arg-type]


def test_what_is_seen_out_of_place_still_is_made_anew_unless_it_is_to_stay(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Through(ByHeight):
        def __call__(self, shape: NeuralShape) -> Soundness:
            said = super().__call__(shape)
            tip = Tip("ball", said.gap, 0.1, np.zeros((1, 3)), np.zeros((1, 3)))
            return replace(said, gap=0.0, through=(tip,))

    monkeypatch.setattr("partwright.partsdf.resampling.Judge", Through)
    monkeypatch.setattr("partwright.partsdf.resampling._mended", lambda sample, *_: sample)
    seen, hardly = 0.03, 0.01  # of its surface
    source = NeuralShape.trained(model, "lamp2")
    for keep, tries in (((), 2), (("plate",), 2), (("ball",), 1)):
        generator = Scripted(model, {Draw(0): seen, Draw(0, 1): hardly})
        given = {"source": source, "keep": keep} if keep else {}
        (made,) = sound_samples(generator, 1, **given)  # type: ignore[arg-type]
        assert (made.tries, bool(made.soundness.misplaced)) == (tries, tries == 1)


def test_what_a_given_layout_has_wrong_is_no_reason_for_another_try(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    gaps: list[float] = []  # of the given one, the first that is made, and all others

    class Odd(Judge):
        def __call__(self, shape: NeuralShape) -> Soundness:
            gap = gaps[min(len(generator.asked), 2)]
            return Soundness((), gap, ("plate", "ball"), GAP, 2 * OFFSET, ("plate", "ball"))

    monkeypatch.setattr("partwright.partsdf.resampling.Judge", Odd)
    given = moved(NeuralShape.trained(model, "lamp2"), "ball", (0.0, 0.0, 0.8))
    offset = largest_offset(given)[0]
    assert layout_faults(given) == [f"plate and ball lie as in no training shape, by {offset:.2f}"]
    assert layout_faults(NeuralShape.trained(model, "lamp2")) == []
    for gaps[:], tries in (((0.0, 0.3, 0.0), 2), ((0.3, 0.3, 0.3), 1)):
        generator = Scripted(model, {})
        (made,) = sound_samples(generator, 1, source=given, keep_layout=True)  # type: ignore[arg-type]
        assert (made.tries, made.soundness.faults()) == (tries, [])
    generator = Scripted(model, {})
    (made,) = sound_samples(generator, 1, tries=5)  # type: ignore[arg-type]
    assert made.tries == 5


def test_each_try_has_noise_of_its_own(model: Model) -> None:
    """By the seed, the number and the attempt, whatever else is made; the first is that of a count."""
    generator = train_generator(model, steps=1, settings=GeneratorSettings(width=16, heads=2, blocks=1))
    first, second = generator.generate(2, 5)
    draws = [Draw(1), Draw(1, 1), Draw(0, 1), Draw(0)]
    made = generator.generate(draws, 5)
    torch.testing.assert_close(made[0].latents, second.latents)
    torch.testing.assert_close(made[3].latents, first.latents)
    every = [*made, *generator.generate(3, 6)]
    assert len({float(one.latents.sum() + one.poses.translation.sum()) for one in every}) == len(every)
    (again,) = generator.generate([Draw(0, 1)], 5)
    torch.testing.assert_close(again.latents, made[2].latents)


def test_what_comes_through_ranks_before_what_is_broken() -> None:
    """However much of it: else a shape that is just apart was kept in place of a whole one."""
    whole = Soundness((), 0.0, (), GAP, 0.0, ())
    tip = Tip("knob", 0.09, 0.1, np.zeros((1, 3)), np.zeros((1, 3)))
    through, apart = (
        replace(whole, through=(tip,)),
        replace(whole, gap=1.01 * GAP, gap_between=("plate", "ball")),
    )
    assert through.badness > apart.badness
    assert sorted((apart, through, whole), key=lambda one: one.rank) == [whole, through, apart]
