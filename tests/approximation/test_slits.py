"""Outlines that run along themselves are mended where sections are read, and where STEP is written."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import CrossSection

from partwright.approximation.sketches.sections import profile_of
from partwright.approximation.sketches.slits import TOUCHING, section_of, touches_itself, without_slits
from partwright.export.brep_mended_profile import mended
from partwright.fields import Extrusion, Profile
from partwright.fields.profile import circle


def comb(gap: float) -> Profile:
    """A U whose arms are so far apart, 1 x 1."""
    half = gap / 2
    return Profile.polygon(
        [(-0.5, 0), (0.5, 0), (0.5, 1), (half, 1), (half, 0.5), (-half, 0.5), (-half, 1), (-0.5, 1)]
    )


def dumbbell(neck: float) -> Profile:
    """Two squares of unequal size, joined by a neck of that width."""
    half = neck / 2
    left = [(-1, -0.5), (0, -0.5), (0, -half)]
    right = [(0.2, -half), (0.2, -0.3), (0.8, -0.3), (0.8, 0.3), (0.2, 0.3), (0.2, half)]
    return Profile.polygon([*left, *right, (0, half), (0, 0.5), (-1, 0.5)])


@pytest.mark.parametrize(
    "profile", [comb(0.01), Profile([(0, 0), (1, 0, 0.5), (1, 1), (0, 1)], [circle(0.2, (0.5, 0.5))])]
)
def test_sound_outlines_do_not_touch(profile: Profile) -> None:
    assert not touches_itself(profile.loops, TOUCHING)


@pytest.mark.parametrize("profile", [comb(1e-6), dumbbell(1e-6)], ids=["slit", "neck"])
def test_slits_and_necks_touch(profile: Profile) -> None:
    assert touches_itself(profile.loops, TOUCHING)


def test_a_tip_on_an_arc_touches() -> None:
    outline = [(-1, 0), (1, 0, 1), (0.1, 0.4), (0, 0.99999), (-0.1, 0.4)]
    loops = (tuple((*corner, 0.0)[:3] for corner in outline),)
    assert not touches_itself(loops, TOUCHING)
    nearly = (((1.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (-0.5, -0.1, 0.0), (0.0, 0.99999, 0.0), (0.5, -0.1, 0.0)),)
    assert touches_itself(nearly, TOUCHING)


def test_sections_are_read_without_them() -> None:
    """A slit is closed; of two pieces that hang together by nothing the larger is the outline."""
    closed = profile_of(section_of(comb(1e-6), 1e-3))
    assert closed is not None
    assert not touches_itself(closed.loops, TOUCHING)
    assert closed.area == pytest.approx(1, abs=1e-3)
    assert len(closed.outline) == 4
    larger = profile_of(section_of(dumbbell(1e-6), 1e-3))
    assert larger is not None
    assert larger.area == pytest.approx(1, abs=1e-3)
    kept = profile_of(section_of(dumbbell(0.02), 1e-3))
    assert kept is not None
    assert kept.area == pytest.approx(1 + 0.36 + 0.2 * 0.02, abs=1e-3)


def test_closing_keeps_the_rest() -> None:
    section = CrossSection([np.array([(0, 0), (1, 0), (1, 1), (0, 1)])])
    filled, cut = without_slits(section, 0.01)
    assert filled.area() == pytest.approx(1)
    assert cut.area() == pytest.approx(1)


def test_step_closes_slits_that_do_not_matter() -> None:
    tried = mended(Extrusion(comb(1e-6), 0.2))
    near, off = next(one for one in tried if not touches_itself(one[0].profile.loops, TOUCHING))
    assert near.profile.area == pytest.approx(1, abs=1e-3)
    assert off < 2e-3
