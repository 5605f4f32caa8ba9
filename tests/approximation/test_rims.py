"""Fillets and chamfers measured on surfaces: their numbers, whatever the chords, and only where they are."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.rims import (
    SHARP,
    Leaning,
    bottom_rim,
    limited,
    rimmed_body,
    top_rim,
)
from partwright.fields import Box, Extrusion, Profile
from partwright.fields.profile import circle
from partwright.fields.rims import Rim
from partwright.meshing.named_solids import named_solid
from partwright.meshing.swept_solids import extruded

PLATE = Profile.rectangle(1.2, 0.8, corner=0.2)
BRACKET = Profile([(0, 0), (1, 0), (1, 0.4), (0.5, 0.4, -0.4142), (0.4, 0.5), (0.4, 1), (0, 1)])


def measured(field: Extrusion, profile: Profile, tolerance: float) -> tuple[Rim, Rim]:
    mesh = extruded(field, tolerance).to_mesh64()
    faces = Leaning.of(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    half = field.height / 2
    return bottom_rim(faces, profile, -half), top_rim(faces, profile, half)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4], ids=["three chords", "six", "many"])
@pytest.mark.parametrize("profile", [PLATE, BRACKET, Profile.circle(0.5), Profile.rectangle(1, 0.6)])
def test_radii_and_lengths_are_found(profile: Profile, tolerance: float) -> None:
    bottom, top = measured(Extrusion(profile, 0.4, top_fillet=0.1, bottom_chamfer=0.05), profile, tolerance)
    assert bottom == (0, pytest.approx(0.05, rel=0.01))
    assert top == (pytest.approx(0.1, rel=0.01), 0)


def test_what_does_not_go_around_is_no_rim() -> None:
    """A taper, an edge that is round on one half, and a hole whose own edge is sharp."""
    assert measured(Extrusion(PLATE, 0.4, 5), PLATE, 1e-3) == (SHARP, SHARP)
    rounded = named_solid(Extrusion(Profile.rectangle(1.2, 0.8), 0.4, top_fillet=0.1), 1e-3)
    half = rounded + named_solid(Box((0.6, 0.8, 0.4)), 1e-3).translate((0.3, 0, 0))
    assert not any(one.rims for one in candidates(half, [np.eye(3)], holes=True))
    drilled = rounded - named_solid(Extrusion(Profile.circle(0.2), 1.0), 1e-3)
    rims = [one for one in candidates(drilled, [np.eye(3)], holes=True) if one.rims]
    fields = [one.part.field for one in rims]
    assert fields
    assert all(isinstance(field, Extrusion) and not field.profile.holes for field in fields)
    assert sorted(len(one.cuts) for one in rims) == [0, 1]


def test_a_hole_that_is_rounded_too_stays_in_the_profile() -> None:
    profile = Profile(PLATE.outline, (circle(0.15),))
    assert measured(Extrusion(profile, 0.4, top_fillet=0.1), profile, 1e-3)[1].fillet == pytest.approx(
        0.1, rel=0.01
    )


def test_bodies_of_candidates_lie_on_either_side() -> None:
    field = Extrusion(PLATE, 0.4, top_fillet=0.1, bottom_chamfer=0.05)
    section = extruded(Extrusion(PLATE, 1), 1e-3).slice(0)
    inner, outer = (
        rimmed_body(section, field.rims, 0.4, side).translate((0, 0, -0.2)) for side in (False, True)
    )
    body = extruded(field, 1e-3)
    assert (inner - body).volume() < 1e-3 * body.volume()
    assert (body - outer).volume() < 1e-3 * body.volume()
    assert inner.volume() > 0.98 * body.volume() > 0.96 * outer.volume()


def test_a_chamfer_that_is_mitred_where_the_outline_goes_inwards() -> None:
    """CAD programs let the planes of a chamfer meet there, as those of two plates do. Measured from the
    nearest place of the outline, which is that corner, they were deeper than they are: no rim was found."""
    outline = Profile([(0, 0), (1, 0), (1, 0.4), (0.4, 0.4), (0.4, 1), (0, 1)])
    lying, standing = (
        named_solid(Extrusion(Profile.rectangle(*size), 0.4, top_chamfer=0.1), 1e-3).translate(
            (size[0] / 2, size[1] / 2, 0)
        )
        for size in ((1.0, 0.4), (0.4, 1.0))
    )
    mesh = (lying + standing).to_mesh64()
    faces = Leaning.of(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    assert top_rim(faces, outline, 0.2) == (0, pytest.approx(0.1, rel=1e-3))


@pytest.mark.parametrize("rims", [{"top_fillet": 0.1}, {"top_chamfer": 0.1, "bottom_chamfer": 0.06}])
def test_a_rim_may_be_deeper_than_corners_are_round(rims: dict[str, float]) -> None:
    """An outline of such corners had no room for it, and stayed sharp."""
    field = Extrusion(Profile.rectangle(1.2, 0.8, corner=0.05), 0.4, **rims)
    found = [one.part.field for one in candidates(named_solid(field, 1e-3), [np.eye(3)], holes=True)]
    near = [one for one in found if isinstance(one, Extrusion) and one.collapses]
    for name, depth in rims.items():
        assert depth == pytest.approx(
            min((getattr(one, name) for one in near), key=lambda d: abs(d - depth)), rel=0.01
        )


def test_rims_that_are_a_little_too_deep_are_as_deep_as_there_is_room() -> None:
    """Of a fillet as wide as a corner, and of two that meet half way up, the last digits decided."""
    both = limited((Rim(0.2002, 0.0), Rim(0.2001, 0.0)), Profile.rectangle(1.2, 0.8, corner=0.3), 0.4)
    assert sum(rim.depth for rim in both) == pytest.approx(0.4, rel=1e-12)
    (bottom, top) = limited((Rim(0.201, 0.0), Rim(0.0, 0.1)), PLATE, 0.4)
    assert bottom.fillet == pytest.approx(0.2, rel=1e-6)
    assert top == (0.0, 0.1)
    assert limited((Rim(0.25, 0.0), SHARP), PLATE, 0.4)[0].fillet == 0.25
