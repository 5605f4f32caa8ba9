"""Walls that lean by the same on all sides are one extrusion with a taper."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.ends import BARELY, with_open_ends
from partwright.assembly import Part
from partwright.fields import Extrusion
from partwright.fields.profile import Profile
from partwright.meshing.named_solids import named_solid

UP = np.eye(3)


def leaning(body: Manifold) -> list[tuple[Part, Extrusion]]:
    parts = (one.part for one in candidates(body, [UP], holes=True))
    return [(p, p.field) for p in parts if isinstance(p.field, Extrusion) and p.field.taper]


@pytest.mark.parametrize("degrees", [0.5, 1.0, 3.25, 10.0])
@pytest.mark.parametrize("corner", [0.0, 0.15])
def test_a_block_with_a_draft_has_its_numbers(degrees: float, corner: float) -> None:
    own = Extrusion(Profile.rectangle(1.2, 0.8, corner), 0.6, taper=degrees)
    for over in (False, True):
        body = named_solid(own, 1e-4)
        ((found, field),) = leaning(body.mirror((0, 0, 1)) if over else body)
        assert (field.taper, field.height) == (degrees, pytest.approx(0.6))
        assert np.ptp(found.bounds(), axis=0) == pytest.approx([1.2, 0.8, 0.6], abs=2e-3)
        assert np.ptp(field.top.bounds(), axis=0) == pytest.approx(np.ptp(own.top.bounds(), axis=0), abs=2e-3)
        assert len(field.profile.outline) == (8 if corner else 4)
        near = np.random.default_rng(0).uniform(-0.7, 0.7, (2000, 3)).astype(np.float32)
        wanted = own(near * (1, 1, -1) if over else near)
        assert np.abs(found.distance(near) - wanted).max() < 2e-3


def test_holes_lean_as_the_outline_does_or_are_closed() -> None:
    outline, hole = (Profile.rectangle(x, y).outline for x, y in ((1.2, 0.8), (0.6, 0.4)))
    frame = Extrusion(Profile(outline, (hole,)), 0.3, taper=2.0)
    upright = named_solid(Extrusion(Profile(outline), 0.3, taper=2.0), 1e-4) - Manifold.cube(
        (0.6, 0.4, 1), True
    )
    for body, holes in ((named_solid(frame, 1e-4), [0, 1]), (upright, [0])):
        fields = [field for _, field in leaning(body)]
        assert sorted(len(field.profile.holes) for field in fields) == holes
        assert {field.taper for field in fields} == {2.0}
        assert all(len(field.profile.outline) == 4 for field in fields)
        assert all(np.allclose(field.profile.bounds()[1], (0.6, 0.4), atol=1e-3) for field in fields)


def test_it_goes_on_beside_others_that_end_half_way() -> None:
    tall = named_solid(Extrusion(Profile.rectangle(0.4, 0.4), 0.6, taper=3.0), 1e-4)
    low = named_solid(Extrusion(Profile.rectangle(0.3, 0.5), 0.2, taper=5.0), 1e-4)
    found = leaning(tall + low.translate((0.6, 0, -0.2)))
    assert sorted((field.taper, round(field.height, 3)) for _, field in found) == [(3.0, 0.6), (5.0, 0.2)]


def test_one_upright_wall_is_no_draft() -> None:
    block = named_solid(Extrusion(Profile.rectangle(1.2, 0.8), 0.6, taper=3.0), 1e-4)
    assert not leaning(block.trim_by_plane((-1, 0, 0), -0.4))
    assert not leaning(Manifold.cube((1.2, 0.8, 0.6)))


def test_open_ends_go_on_and_the_wide_one_hardly() -> None:
    """A pocket of 0.8 by 0.4 at the top of a block, which is what a person measures."""
    pocket = Part(Extrusion(Profile.rectangle(0.8, 0.4), 0.3, taper=2.0), (0, 0, 0.15), (0.0, 1.0, 0.0, 0.0))

    def block(points: np.ndarray) -> np.ndarray:
        return np.abs(points - (0, 0, -0.5)).max(axis=1) - 0.8

    open_ = with_open_ends(pocket, False, block)
    assert isinstance(open_.field, Extrusion)
    assert open_.field.profile == Profile.rectangle(0.8, 0.4)
    assert open_.bounds()[:, 2] == pytest.approx([0.0, 0.3 + BARELY])
