"""Parts of one form in several places become one leaf, where the shape is the same there, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.assembly.rows import rows
from partwright.fields import SuperFrustum
from partwright.shapes import load_shape
from partwright.superfrusta.objective import score
from partwright.superfrusta.repeated_parts import repeat, symmetry_tolerance
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import expanded
from partwright.superfrusta.symmetry import TOLERANCE, Symmetry, mirror, symmetries
from tests.superfrusta.meshes import box, table, union
from tests.superfrusta.rows import subtracting

DRAFT = replace(Settings.for_quality("draft"), near=6000, uniform=6000, resolution=48)

Box = tuple[tuple[float, float, float], tuple[float, float, float]]

# A comb whose handle is at one end: no symmetry of the whole takes a tine to another.
HANDLE: Box = ((0.9, 0.4, 0.4), (-1.3, 0.1, 0.1))
BACK: Box = ((1.8, 0.3, 0.2), (0.0, 0.0, 0.0))
TINES: list[Box] = [((0.18, 0.2, 0.8), (x, 0.0, -0.4)) for x in (-0.75, -0.25, 0.25, 0.75)]
SIDES = ((0.7, 0.0), (-0.7, 0.06))  # of a body, and how much higher an arm is there
HALVES: list[Box] = [((0.18, 0.2, 0.4), (0.25, 0.0, z)) for z in (-0.2, -0.6)]


def known(mesh: trimesh.Trimesh, boxes: list[Box]) -> tuple[FitSamples, np.ndarray]:
    """Samples of a shape, and rows of boxes in the unit frame."""
    shape = load_shape(mesh)
    parts = Assembly(tuple(Part(SuperFrustum(size), place, blend=0.001) for size, place in boxes))
    unit = parts.translated([-c for c in shape.frame.centre]).scaled(shape.frame.scale)
    return FitSamples.of(shape, DRAFT), subtracting(rows(unit.parts))


@pytest.fixture(scope="module")
def comb() -> trimesh.Trimesh:
    return union(*(box(*one) for one in (HANDLE, BACK, *TINES)))


@pytest.mark.parametrize(
    "tines",
    [TINES, [*TINES[:2], *HALVES, TINES[3]], TINES[:3]],
    ids=["all alike", "one in halves", "one left out"],
)
def test_tines_become_one_leaf_however_they_were_found(comb: trimesh.Trimesh, tines: list[Box]) -> None:
    samples, found = known(comb, [HANDLE, BACK, *tines])
    leaves = repeat(samples, found, (), DRAFT)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 1, 4]
    assert score(samples, expanded(leaves)) > 0.99
    steps = [move.translation for move in leaves[2].moves]
    assert np.ptp(steps, axis=0)[1:] == pytest.approx([0, 0], abs=2e-3)  # they are shifted, not turned
    assert all(move.rotation[0] == pytest.approx(1, abs=1e-3) for move in leaves[2].moves)


def test_locked_parts_are_in_no_repeat(comb: trimesh.Trimesh) -> None:
    samples, found = known(comb, [*TINES, HANDLE, BACK])
    leaves = repeat(samples, found, (), DRAFT, locked=2)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 1, 2, 1, 1]
    assert np.array_equal(expanded(leaves)[:2], found[:2])


def test_parts_alike_by_chance_stay_apart() -> None:
    """One of two equal blocks stands for a block, the other for a ball."""
    ends: list[Box] = [((0.5, 0.5, 0.5), (x, 0.0, 0.0)) for x in (-0.8, 0.8)]
    bar: Box = ((1.6, 0.2, 0.3), (0.0, 0.0, 0.0))
    ball = trimesh.creation.icosphere(3, 0.31).apply_translation((0.8, 0, 0))
    samples, found = known(union(box(*ends[0]), box(*bar), ball), [*ends, bar])
    assert [1 + len(leaf.isometries) for leaf in repeat(samples, found, (), DRAFT)] == [1, 1, 1]


def test_arms_that_are_nearly_mirrored_become_one_though_one_is_raised() -> None:
    body: Box = ((1.0, 1.6, 0.3), (0, 0, 0))
    arms = [[((0.2, 0.2, 0.8), (0, y, 0.4 + up)), ((1.0, 0.3, 0.2), (0, y, 0.9 + up))] for y, up in SIDES]
    shape = union(*(box(*one) for one in (body, *arms[0], *arms[1])))
    stump: Box = ((0.4, 0.3, 0.9), (0, -0.7, 0.6))
    samples, found = known(shape, [body, *arms[0], stump])
    across = (Symmetry("mirror", 2, mirror(np.eye(3)[1], np.zeros(3)), 0.01),)
    assert len(repeat(samples, found, (), DRAFT)) == 4
    leaves = repeat(samples, found, (), DRAFT, nearly=across)
    assert [1 + len(leaf.isometries) for leaf in leaves] == [1, 2, 2]
    assert score(samples, expanded(leaves)) > 0.98 > 0.9 > score(samples, found)


def test_a_symmetry_need_not_hold_better_than_the_assembly_fits() -> None:
    boxes: list[Box] = [((2, 1.2, 0.15), (0, 0, 1.0))]
    boxes += [((0.15, 0.15, 1.05), (x, y, 0.5)) for x in (-0.85, 0.85) for y in (-0.5, 0.5)]
    rough = table().subdivide_to_size(0.15)
    rough.vertices += np.random.default_rng(0).normal(0, 0.016, rough.vertices.shape)
    samples, found = known(rough, boxes)
    shape = load_shape(rough)
    assert symmetries(shape, DRAFT) == ()
    tolerance = symmetry_tolerance(samples, found)
    assert {one.kind for one in symmetries(shape, DRAFT, tolerance=tolerance)} == {"mirror", "rotation"}
    assert symmetry_tolerance(*known(table(), boxes)) == TOLERANCE


@pytest.mark.parametrize(("taller", "counts"), [(0.04, [1, 2]), (0.1, [1, 1, 1])])
def test_parts_become_one_where_they_differ_by_less_than_one_is_worth(
    taller: float, counts: list[int]
) -> None:
    posts = [((0.2, 0.2, 0.8 + up), (0, y, 0.5 + up / 2)) for y, up in ((0.7, 0.0), (-0.7, taller))]
    boxes: list[Box] = [((1.0, 1.6, 0.3), (0, 0, 0)), *posts]
    samples, found = known(union(*(box(*one) for one in boxes)), boxes)
    across = (Symmetry("mirror", 2, mirror(np.eye(3)[1], np.zeros(3)), 0.0),)
    leaves = repeat(samples, found, across, DRAFT)
    assert [1 + len(leaf.isometries) for leaf in leaves] == counts
    assert score(samples, found) - score(samples, expanded(leaves)) < DRAFT.alpha
