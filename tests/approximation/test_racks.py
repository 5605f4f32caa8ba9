"""Outlines with sides that come again along a line: a body, and one fin or gap again and again."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule

from partwright.approximation.sketches.racks import Rack, racked
from partwright.fields.profile import Corner, Loop, Profile, circle

_FIN: list[Corner] = [(0, 0, 0), (0, 5, 0), (1, 5, 0), (1, 0, 0)]
_SAW: list[Corner] = [(0, 0, 0), (1, 2, 0)]
_ROUND: list[Corner] = [(0, 0, 0), (0, 3, 1), (-1, 3, 0), (-1, 0, 0)]


def comb(tooth: list[Corner], count: int, step: float, margin: float = 1.0) -> Loop:
    """Teeth on a bar from x = 0 on, from right to left, a margin beyond the last of them on either side;
    without one the walls at either end are those of teeth."""
    row = [(x - k * step, y, b) for k in range(count) for x, y, b in tooth]
    right, left = max(x for x, _, _ in row) + margin, min(x for x, _, _ in row) - margin
    bar: list[Corner] = [(left, -2, 0), (right, -2, 0)]
    corners = [*row, (left, 0, 0), *bar, (right, 0, 0)] if margin else [*row[1:-1], *bar]
    return tuple((x / 20, y / 20, b) for x, y, b in corners)


def section(profile: Profile) -> CrossSection:
    return CrossSection(profile.polylines(1e-6), FillRule.EvenOdd)


def apart(profile: Profile, rack: Rack) -> float:
    """Area where the profile and what it is made of differ."""
    whole, tooth = section(rack.base), section(rack.tooth)
    for k in range(rack.count):
        copy = tooth.translate((k * rack.step[0], k * rack.step[1]))
        whole = whole + copy if rack.added else whole - copy
    wanted = section(profile)
    return float(((wanted - whole) + (whole - wanted)).area())


def plainest(profile: Profile) -> Rack:
    return min(racked(profile), key=lambda rack: len(rack.base.corners) + len(rack.tooth.corners))


def turned(loop: Loop, angle: float) -> Loop:
    c, s = np.cos(angle), np.sin(angle)
    return tuple((c * x - s * y, s * x + c * y, b) for x, y, b in loop)


@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize(
    ("tooth", "step", "sides"), [(_FIN[::-1], 3.0, 4), (_ROUND, 2.5, 4), (_SAW[::-1], 2.0, 5)]
)
def test_a_comb_is_a_bar_with_fins(tooth: list[Corner], step: float, sides: int, angle: float) -> None:
    profile = Profile(turned(comb(tooth, 9, step), angle), (turned(circle(0.02, (0, -0.05)), angle),))
    for rack in racked(profile):
        assert apart(profile, rack) < 1e-6
    best = plainest(profile)
    assert (best.count, best.added) == (9, True)
    assert np.hypot(*best.step) == pytest.approx(step / 20)
    assert len(best.base.outline) == 4
    assert len(best.tooth.outline) == sides
    assert best.base.holes == profile.holes


def test_fins_at_both_ends_of_a_bar_leave_gaps() -> None:
    profile = Profile(comb(_FIN[::-1], 8, 3.0, margin=0.0))
    best = plainest(profile)
    assert (best.count, best.added) == (7, False)
    assert len(best.base.outline) == len(best.tooth.outline) == 4
    assert apart(profile, best) < 1e-6


def test_teeth_may_stand_in_a_hole_and_need_not_be_alike_elsewhere() -> None:
    slot = turned(comb(_FIN[::-1], 6, 3.0), 0.3)
    profile = Profile.rectangle(4, 4)
    profile = Profile(profile.outline, (slot,))
    best = plainest(profile)
    assert best.count == 6
    assert not best.added
    assert len(best.base.holes[0]) == 4
    assert apart(profile, best) < 1e-6


def test_what_comes_less_often_or_not_in_a_row_is_no_rack() -> None:
    assert not list(racked(Profile(comb(_FIN[::-1], 3, 3.0))))
    uneven = list(comb(_FIN[::-1], 6, 3.0))
    uneven[9:11] = [(x, y + 0.02, b) for x, y, b in uneven[9:11]]  # one fin in the middle is longer
    assert not list(racked(Profile(tuple(uneven))))
