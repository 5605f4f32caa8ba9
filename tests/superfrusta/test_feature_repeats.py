"""Features that are the same solid twice become one with a copy; what is nearly the same does not."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Part
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.superfrusta.feature_repeats import with_repeats
from tests.superfrusta.trees import drawn, kinds

_BLOCK = Part(Box((40, 30, 20)))
_EAR = [(0, -6), (14, -6), (14, 2), (6, 6), (0, 6)]


def repeated(*parts: tuple[bool, Part]) -> tuple[list[tuple[bool, str, int]], float]:
    """What is drawn, and how far it is off where that changed, in lengths as given."""
    search, tree, scale = drawn(*parts, sides=4)
    after = with_repeats(search, tree)
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3)).astype(np.float32)
    changed = tree.at(points) != after.at(points)
    return kinds(after), float(np.abs(tree.distance(points[changed])).max(initial=0.0)) / scale


def ear(x: float, mirrored: bool, width: float = 12) -> Part:
    outline = [(-a if mirrored else a, b * width / 12) for a, b in _EAR]
    return Part(Extrusion(Profile(outline[::-1] if mirrored else outline), 5), (x, 0, -7))


def test_an_ear_and_its_mirror_image_are_one_turned_over() -> None:
    """Though the second was read a little narrower."""
    found, off = repeated((True, _BLOCK), (True, ear(20, False)), (True, ear(-20, True, width=11.98)))
    assert found == [(True, "box", 1), (True, "extrusion", 2)]
    assert off < 0.02


@pytest.mark.parametrize("width", [11.5, 12.5])
def test_ears_of_two_widths_stay_two(width: float) -> None:
    parts = [(True, _BLOCK), (True, ear(20, False)), (True, ear(-20, True, width))]
    assert repeated(*parts) == ([(True, "box", 1), (True, "extrusion", 1), (True, "extrusion", 1)], 0.0)


def test_windows_around_a_middle_are_one_with_turned_copies() -> None:
    """Boxes that lie along two directions; holes stay by themselves."""
    plate = Part(Box((60, 60, 3)))
    windows = [Part(Box((24, 8, 9)), (0, y, 0)) for y in (-20, 20)]
    windows += [Part(Box((8, 24, 9)), (x, 0, 0)) for x in (-20, 20)]
    cuts = [(False, part) for part in (*windows, Part(Cylinder(4, 9)))]
    found, off = repeated((True, plate), *cuts)
    assert found == [(True, "box", 1), (False, "box", 4), (False, "cylinder", 1)]
    assert off == 0.0


def test_a_peg_turned_over_keeps_its_free_end_outside() -> None:
    """It is the same peg either way; but where one of its ends is open, so is that of its copy."""
    up, aside = (0.7071067811865476, 0, 0.7071067811865476, 0), (0.7071067811865476, 0.7071067811865476, 0, 0)
    pegs = Part(Cylinder(3, 12), (24, 0, 0), up), Part(Cylinder(3, 12), (0, 19, 0), aside)
    search, tree, _ = drawn((True, _BLOCK), *((True, peg) for peg in pegs), sides=4)
    peg = with_repeats(search, tree).features[1].part
    (move,) = peg.instances
    low, high = peg.copies[0].bounds()
    free = np.where(np.abs(low) > np.abs(high), low, high) * (np.abs(low + high) > 1e-6)
    assert np.abs(move(free[None])).max() == pytest.approx(np.abs(peg.copies[1].bounds()).max())
    assert len(with_repeats(search, tree).features) == 2
