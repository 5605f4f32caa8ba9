"""Symmetries that are found and those that are not there; parts that repeat under them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.parts_from_rows import parts_from_rows
from partwright.assembly.rows import rows
from partwright.fields import SuperFrustum, kernel
from partwright.fields.columns import ROTATION as ROTATION_OF
from partwright.fields.columns import STEP_WIDTH, TRANSLATION, Column
from partwright.methods import FitRequest, Run
from partwright.shapes import load_shape
from partwright.superfrusta import repeat_candidates, repeated_parts, resfit
from partwright.superfrusta.objective import score
from partwright.superfrusta.repeated_parts import repeat
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import LeafSteps, RepeatedPart, expanded, images, refit, rigid
from partwright.superfrusta.symmetry import (
    TOLERANCE,
    Isometry,
    Symmetry,
    groups,
    mirror,
    rotation,
    symmetries,
)
from tests.assembly.strategies import ROTATION, SUPERFRUSTA, VECTOR
from tests.superfrusta.meshes import box, table, union
from tests.superfrusta.rows import subtracting

DRAFT = replace(Settings.for_quality("draft"), near=6000, uniform=6000, resolution=48)
POINTS = np.random.default_rng(0).uniform(-2, 2, (300, 3)).astype(np.float32)
AXIS = np.array([0.0, 0.6, 0.8])
CENTRE = np.array([0.1, -0.2, 0.3])
ISOMETRIES = [mirror(AXIS, CENTRE), rotation(AXIS, 1.0, CENTRE)]


def star(arms: int, seed: int = 0) -> trimesh.Trimesh:
    """A plate with arms around z and a knob on top of each, turned and moved somewhere."""
    parts = [trimesh.creation.cylinder(0.4, 0.3, sections=60 * arms)]
    for i in range(arms):
        turn = trimesh.transformations.rotation_matrix(2 * np.pi * i / arms, (0, 0, 1))
        parts += [box((0.9, 0.15, 0.2), (0.5, 0, 0)).apply_transform(turn)]
        parts += [box((0.12, 0.12, 0.4), (0.85, 0, 0.1)).apply_transform(turn)]
    made = union(*parts)
    return made.apply_transform(
        trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    )


def kinds(found: tuple[Symmetry, ...]) -> list[tuple[str, int]]:
    return sorted((s.kind, s.order) for s in found)


@settings(max_examples=40)
@given(SUPERFRUSTA, VECTOR, ROTATION, st.sampled_from(ISOMETRIES))
def test_the_image_of_a_part_has_the_moved_field(field, translation, turn, isometry: Isometry) -> None:
    row = rows([Part(field, translation, turn)])[0].astype(np.float32)
    there = isometry(POINTS).astype(np.float32)
    expected = kernel.evaluate(row[None], POINTS)
    assert np.allclose(kernel.evaluate(images(row[None], [isometry])[0], there), expected, atol=2e-5)
    move = rigid(row, isometry)
    copy = parts_from_rows(row[None])[0].transformed(move)
    assert np.allclose(copy.distance(there), expected, atol=2e-5)


@given(st.lists(st.tuples(SUPERFRUSTA, VECTOR, ROTATION), min_size=1, max_size=4))
def test_images_at_once_are_those_of_each_move_alone(parts) -> None:
    some = rows([Part(*part) for part in parts]).astype(np.float32)
    found = images(some, ISOMETRIES)
    for isometry, there in zip(ISOMETRIES, found, strict=True):
        for row, one in zip(some, there, strict=True):
            placed = rigid(row, isometry) @ Similarity(1.0, tuple(row[ROTATION_OF]), tuple(row[TRANSLATION]))
            assert one[TRANSLATION] == pytest.approx(placed.translation, abs=1e-6)
            assert one[ROTATION_OF] == pytest.approx(placed.rotation, abs=1e-6)
            assert one[Column.SX :].tolist() == row[Column.SX :].tolist()


def test_symmetries_know_their_axis_and_centre() -> None:
    for kind, isometry in zip(("mirror", "rotation"), ISOMETRIES, strict=True):
        symmetry = Symmetry(kind, 2, isometry, 0.0)
        assert abs(symmetry.axis @ AXIS) == pytest.approx(1.0)
        assert np.allclose(isometry(symmetry.centre[None])[0], symmetry.centre)


def test_a_table_has_two_planes_and_half_a_turn() -> None:
    found = symmetries(load_shape(table()), DRAFT)
    assert kinds(found) == [("mirror", 2), ("mirror", 2), ("rotation", 2)]
    assert all(s.error < 1e-4 for s in found)
    assert [s.error for s in found] == sorted(s.error for s in found)
    assert len(groups(found)[0]) == 3


@pytest.mark.parametrize("arms", [3, 5])
def test_turned_stars_keep_their_symmetries(arms: int) -> None:
    mesh = star(arms)
    found = symmetries(load_shape(mesh), DRAFT)
    assert ("rotation", arms) in kinds(found)
    assert any(s.kind == "mirror" for s in found)
    assert {s.order for s in found if s.kind == "rotation"} == {arms}
    assert max(len(group) for group in groups(found)) >= arms - 1


def test_no_symmetry_where_there_is_none() -> None:
    lopsided = union(
        box((2, 1, 0.3)), box((0.3, 0.4, 1.5), (-0.85, 0.3, 0.6)), box((0.5, 0.5, 0.5), (0.6, -0.3, 0.3))
    )
    assert symmetries(load_shape(lopsided), DRAFT) == ()


def test_groups_too_large_are_left_out() -> None:
    odd = [
        Symmetry("mirror", 2, mirror(np.array([np.cos(a), np.sin(a), 0]), np.zeros(3)), 0) for a in (0, 0.1)
    ]
    assert [len(group) for group in groups(odd)] == [1, 1]


def known_table() -> tuple[FitSamples, np.ndarray, tuple[Symmetry, ...]]:
    """FitSamples of the table, exact rows of its five parts, and its symmetries, in the unit frame."""
    shape = load_shape(table())
    boxes = [((2, 1.2, 0.15), (0, 0, 1.0))]
    boxes += [((0.15, 0.15, 1.05), (x, y, 0.5)) for x in (-0.85, 0.85) for y in (-0.5, 0.5)]
    parts = Assembly(tuple(Part(SuperFrustum(size), place, blend=0.001) for size, place in boxes))
    unit = parts.translated([-c for c in shape.frame.centre]).scaled(shape.frame.scale)
    return FitSamples.of(shape, DRAFT), subtracting(rows(unit.parts)), symmetries(shape, DRAFT)


def test_legs_of_a_table_become_one_leaf() -> None:
    samples, exact, found = known_table()
    leaves = repeat(samples, exact, found, DRAFT)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 4]
    assert score(samples, expanded(leaves)) == pytest.approx(score(samples, exact), abs=1e-6)


def test_a_side_stands_for_the_other_however_both_are_cut_into_parts() -> None:
    """A table's two legs on the left for four halves on the right, and these for them; what is locked is on
    neither side, and neither is the top."""
    samples, exact, found = known_table()
    left, right = (exact[1:][(exact[1:, 0] > 0) == side] for side in (False, True))
    halves = np.concatenate([right, right])
    halves[:, Column.SZ] /= 2
    halves[:, 2] += np.repeat([-0.25, 0.25], 2) * exact[1, Column.SZ]
    rows = np.concatenate([exact[:1], left, halves])
    plane = next(one for one in found if one.kind == "mirror" and abs(one.axis[0]) > 0.99)
    both = {((1, 2), (3, 4, 5, 6)), ((3, 4, 5, 6), (1, 2))}
    seen = repeat_candidates.Occupancies.of(samples, rows)
    sides = repeat_candidates.whole_sides(seen, [plane], 0)
    assert {(one.bases, tuple(sorted(one.replaced))) for one in sides} == both
    assert all(one.isometries == (plane.isometry,) for one in sides)
    fewer = repeat_candidates.whole_sides(seen, [plane], 2)
    assert {one.bases for one in fewer} == {(2,), (3, 4, 5, 6)}
    left_alone = repeat_candidates.Occupancies.of(samples, rows[:3])
    assert repeat_candidates.whole_sides(left_alone, [plane], 0) == []
    leaves = repeat(samples, rows, found, DRAFT)
    assert score(samples, expanded(leaves)) == pytest.approx(score(samples, exact), abs=5e-3)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 4]


def test_locked_parts_stay_as_they_are() -> None:
    samples, exact, found = known_table()
    locked = repeat(samples, exact, found, DRAFT, locked=5)
    assert np.array_equal(expanded(locked), exact)


def test_repeats_that_would_hurt_are_refused() -> None:
    samples, exact, found = known_table()
    shifted = [
        Symmetry(s.kind, s.order, Isometry(s.isometry.linear, s.isometry.shift + 0.06), 0) for s in found
    ]
    leaves = repeat(samples, exact, shifted, DRAFT)
    assert score(samples, expanded(leaves)) >= score(samples, exact) - 2e-3 - 1e-9


@pytest.mark.parametrize(("off", "counts"), [(0.04, [1, 4]), (0.05, [1, 1, 1, 1, 1])])
def test_what_is_2_5_percent_off_is_left_to_the_last_steps(monkeypatch, off: float, counts) -> None:
    """Though nothing was off before; lengths are of the unit frame."""
    samples, exact, found = known_table()
    looks = iter([0.0])

    def seen(_: FitSamples, rows: np.ndarray) -> SimpleNamespace:
        return SimpleNamespace(by_part=np.full(len(rows), next(looks, off)))

    monkeypatch.setattr(repeated_parts, "deviations", seen)
    leaves = repeat(samples, exact, found, replace(DRAFT, firmness=0.0))
    assert [1 + len(leaf.isometries) for leaf in leaves] == counts


def test_a_plane_that_holds_but_for_noise_is_found_and_is_the_same_at_each_seed(monkeypatch) -> None:
    rough = table().subdivide_to_size(0.15)
    rough.vertices += np.random.default_rng(0).normal(0, 0.008, rough.vertices.shape)
    shape = load_shape(rough)
    _, exact, _ = known_table()
    told: list[tuple[Symmetry, ...]] = []
    monkeypatch.setattr(resfit, "repeat", lambda *given: told.append(given[2]) or [RepeatedPart(exact[0])])
    # The fit is as good as exact: it is the shape that says how far a plane has to hold.
    monkeypatch.setattr(resfit, "symmetry_tolerance", lambda *_: TOLERANCE)
    for seed in (0, 1):
        search = ResidualFit(FitSamples.of(shape, DRAFT, Run(seed)), DRAFT, best=exact)
        search.find_repeats(shape)
    first, second = told
    assert ("mirror", 2) in kinds(first)
    assert all(0.003 < one.error < TOLERANCE for one in first if one.kind == "mirror")
    assert [one.isometry.shift.tolist() for one in first] == [one.isometry.shift.tolist() for one in second]


BODY, POST, BAR = (
    ((1.0, 1.6, 0.3), (0, 0, 0)),
    ((0.2, 0.2, 0.8), (0, 0.7, 0.5)),
    ((1.0, 0.3, 0.2), (0, 0.7, 1.0)),
)


def seat(
    *boxes: tuple[tuple[float, float, float], tuple[float, float, float]],
) -> tuple[FitSamples, np.ndarray]:
    """FitSamples of a body with an arm of post and bar at both ends of y, and rows of boxes, unit frame."""
    arms = [(size, (x, sign * y, z)) for size, (x, y, z) in (POST, BAR) for sign in (1, -1)]
    shape = load_shape(union(*(box(size, place) for size, place in (BODY, *arms))))
    parts = Assembly(tuple(Part(SuperFrustum(size), place, blend=0.001) for size, place in boxes))
    unit = parts.translated([-c for c in shape.frame.centre]).scaled(shape.frame.scale)
    return FitSamples.of(shape, DRAFT), subtracting(rows(unit.parts))


@pytest.mark.parametrize(
    "other_arm", [[], [((0.6, 0.3, 0.9), (0, -0.7, 0.6))]], ids=["that lacks", "that has one part for both"]
)
def test_parts_of_one_side_stand_for_a_side(other_arm: list) -> None:
    """No part of the other side is covered by the image of one."""
    samples, found = seat(BODY, POST, BAR, *other_arm)
    across = (Symmetry("mirror", 2, mirror(np.eye(3)[1], np.zeros(3)), 0.0),)
    leaves = repeat(samples, found, across, DRAFT)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 2, 2]
    assert score(samples, expanded(leaves)) > 0.99 > 0.9 > score(samples, found)
    kept = repeat(samples, found, across, DRAFT, locked=2)
    assert [1 + len(leaf.isometries) for leaf in kept[:2]] == [1, 1]
    assert np.array_equal(expanded(kept)[:2], found[:2])


X, Z, ORIGIN = np.eye(3)[0], np.eye(3)[2], np.zeros(3)


@pytest.mark.parametrize(
    ("isometry", "others"), [(mirror(X, ORIGIN), [0, 2, 4]), (rotation(Z, np.pi, ORIGIN), [0, 2, 3])]
)
def test_copies_are_refitted_as_one(isometry: Isometry, others: list[int]) -> None:
    samples, exact, _ = known_table()
    leg = exact[1].copy()
    leg[:3] += (0.02, -0.015, 0.01)
    leg[3:7] = Similarity(1.0, (1.0, 0.02, 0.02, 0.05)).rotation
    leg[[Column.SX, Column.SY]] *= 1.15
    fixed = [RepeatedPart(row) for row in exact[others]]
    before = [*fixed, RepeatedPart(leg, (isometry,))]
    after = refit(samples, before, ((100.0, 15),), DRAFT, locked=len(fixed))
    assert np.array_equal(expanded(after)[:3], exact[others])
    assert score(samples, expanded(before)) < 0.97
    assert score(samples, expanded(after)) > 0.995


def test_equations_of_copies_are_those_of_their_leaves() -> None:
    rng = np.random.default_rng(0)
    moves = (mirror(X, ORIGIN), rotation(Z, 1.0, X))
    rows = known_table()[1][:3]
    leaves = [RepeatedPart(row, moves[:copies]) for row, copies in zip(rows, (0, 2, 1), strict=True)]
    steps = LeafSteps.of(leaves, DRAFT, np.array([True, True, False]))
    entries = np.flatnonzero(steps._free)
    lift = np.zeros((6, STEP_WIDTH, 3, STEP_WIDTH))
    lift[np.arange(6), :, steps.leaf] = steps._lift
    lift = lift.reshape(6 * STEP_WIDTH, -1)[:, entries]
    gradient, matrix = rng.normal(size=len(lift)), rng.normal(size=(len(lift),) * 2)
    one, both = steps.projected(gradient, matrix + matrix.T)
    np.testing.assert_allclose(one, lift.T @ gradient, rtol=0, atol=1e-12)
    np.testing.assert_allclose(both, lift.T @ (matrix + matrix.T) @ lift, rtol=0, atol=1e-12)


def test_a_fit_repeats_parts_only_if_asked() -> None:
    shape, brief = load_shape(table()), replace(DRAFT, mends=0, rounds=2)
    on, off = (FitRequest(shape, replace(brief, symmetry=flag)).fitted().assembly for flag in (True, False))
    assert len(on) < len(off)
    assert sum(len(part.copies) for part in on.parts) >= 5
    assert not any(part.instances for part in off.parts)
    again = FitRequest(shape, brief, start=on, locked=(on.parts[-1].name,)).fitted()
    assert again.assembly.parts[0].instances == ()  # a locked part's copies stay as parts of their own
