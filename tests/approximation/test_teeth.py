"""Outlines that are the same after a part of a turn: a circle, and one tooth or gap again and again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule, OpType

from partwright.approximation.sketches.teeth import FEATURE, Teeth, drawn_corners, toothed
from partwright.fields.profile import Corner, Loop, Profile, circle, circle_of

_CHORD = 1e-6


def wheel(
    order: int, root: float, tip: float, share: float = 0.5, middle: tuple[float, float] = (0, 0)
) -> Loop:
    """Arcs at the roots and the tips, and lines between."""
    step = 2 * math.pi / order
    corners: list[Corner] = []
    for k in range(order):
        for radius, start, sweep in ((root, 0.0, 0.5), (tip, 0.6, 0.3)):
            a, b = (k + start) * step, (k + start + sweep) * step
            bulge = math.tan((b - a) / 4)
            for angle, own in ((a, bulge), (b, 0.0)):
                corners.append(
                    (radius * math.cos(angle) + middle[0], radius * math.sin(angle) + middle[1], own)
                )
    return tuple(corners)


def section(profile: Profile) -> CrossSection:
    return CrossSection(profile.polylines(_CHORD), FillRule.EvenOdd)


def apart(profile: Profile, teeth: Teeth) -> float:
    """Area where the profile and what it is made of differ."""
    x, y = teeth.centre
    whole, tooth = section(teeth.base), section(teeth.tooth).translate((-x, -y))
    for k in range(teeth.order):
        copy = tooth.rotate(360 * k / teeth.order).translate((x, y))
        whole = whole + copy if teeth.added else whole - copy
    wanted = section(profile)
    return float(((wanted - whole) + (whole - wanted)).area())


def plainest(profile: Profile) -> Teeth:
    return min(toothed(profile), key=lambda teeth: len(teeth.base.corners) + len(teeth.tooth.corners))


@pytest.mark.parametrize(("order", "middle"), [(9, (0, 0)), (24, (0.1, -0.05)), (60, (0, 0))])
def test_a_gear_is_a_disc_with_gaps(order: int, middle: tuple[float, float]) -> None:
    profile = Profile(wheel(order, 0.7, 0.8, middle=middle), (circle(0.2, middle),))
    found = list(toothed(profile))
    assert {(teeth.order, teeth.added) for teeth in found} == {(order, True), (order, False)}
    for teeth in found:
        assert apart(profile, teeth) < 2e-3 * profile.area
        radius, place = circle_of(teeth.base.outline) or (0.0, (0.0, 0.0))
        assert radius == pytest.approx(0.7 if teeth.added else 0.8, abs=1e-4)
        assert place == pytest.approx(middle, abs=1e-4)
        assert len(teeth.tooth.outline) <= 6
        assert teeth.base.holes == profile.holes


def test_teeth_may_stand_in_a_hole() -> None:
    profile = Profile(circle(0.9), (wheel(30, 0.6, 0.66),))
    found = list(toothed(profile))
    assert {teeth.added for teeth in found} == {True, False}
    for teeth in found:
        assert apart(profile, teeth) < 2e-3 * profile.area
        assert circle_of(teeth.base.holes[0]) is not None


def test_round_notches_are_circles() -> None:
    """As they were cut from the disc, and not lenses."""
    notches = [
        CrossSection.circle(0.05, 64).translate((0.9 * math.cos(a), 0.9 * math.sin(a)))
        for a in np.arange(36) * math.pi / 18
    ]
    disc = CrossSection.circle(0.88, 720) - CrossSection.batch_boolean(notches, OpType.Add)
    teeth = plainest(Profile.polygon(disc.to_polygons()[0]))
    assert (teeth.order, teeth.added) == (36, False)
    radius, middle = circle_of(teeth.tooth.outline) or (0.0, (0.0, 0.0))
    assert radius == pytest.approx(0.05, abs=5e-4)
    assert math.hypot(*middle) == pytest.approx(0.9, abs=5e-4)


def test_what_is_no_wheel_has_no_teeth() -> None:
    uneven = list(wheel(12, 0.6, 0.8))
    x, y, bulge = uneven[2]
    uneven[2] = (0.5 * x, 0.5 * y, bulge)  # one tooth is broken
    rack = [(0.1 * k, 0.3 * ((k // 2) % 2), 0.0) for k in range(40)] + [(4.0, -0.5, 0.0), (0.0, -0.5, 0.0)]
    for loop in (tuple(uneven), tuple(rack), Profile.regular(48, 0.8).outline):
        assert not list(toothed(Profile(loop)))


def test_a_wheel_counts_as_it_is_drawn() -> None:
    """A circle, one tooth and one feature more; other outlines as they are."""
    assert drawn_corners([wheel(60, 0.7, 0.8), circle(0.2)]) == 2 + FEATURE + 4 + 2
    assert drawn_corners([wheel(9, 0.7, 0.8)]) == 36  # too few to save anything
    rack = [(0.1 * k, 0.3 * ((k // 2) % 2), 0.0) for k in range(60)] + [(6.0, -0.5, 0.0), (0.0, -0.5, 0.0)]
    assert drawn_corners([tuple(rack)]) == 62
