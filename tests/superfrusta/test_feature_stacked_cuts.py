"""Slits of several plates, one on top of the other, are cut once."""

from __future__ import annotations

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Extrusion
from partwright.fields.profile import Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_steps import Feature, FeatureTree

SLITS = tuple(Profile.rectangle(4, 20).moved((x, 0)).outline for x in (-10, 0, 10))


def plate(width: float, low: float, high: float) -> Part:
    profile = Profile(Profile.rectangle(width, 40).outline, [loop[::-1] for loop in SLITS])
    return Part(Extrusion(profile, high - low), (0, 0, (low + high) / 2))


def named(*parts: Part) -> tuple[Assembly, float]:
    """What a tree of plates becomes, and the volume of these."""
    drawn = mesh_assembly(Assembly(parts))
    shape = pw.load_shape(drawn, unit="mm")
    own = in_unit_frame(shape, Assembly(parts)).parts
    none = np.zeros(0, bool)
    tree = FeatureTree([Feature(True, part, none, 4) for part in own])
    return FeatureAssembly(shape).named(tree), float(drawn.volume)


def test_slits_of_plates_on_top_of_one_another_are_cut_once() -> None:
    """From the lowest plate to the highest, as long as all of them; moved, it leaves nothing behind."""
    made, volume = named(plate(60, 0, 10), plate(50, 10, 16), plate(40, 16, 30))
    (slit,) = (part for part in made.parts if len(part.copies) == 3)
    assert len(made.parts) == 4
    low, high = slit.bounds()
    assert low[2] < 0
    assert high[2] > 30
    assert mesh_assembly(made).volume == pytest.approx(volume, rel=1e-4)


def test_they_stay_apart_where_the_shape_is_solid_between() -> None:
    made, volume = named(plate(60, 0, 10), Part(Box((50, 40, 6)), (0, 0, 13)), plate(40, 16, 30))
    cuts = [part for part in made.parts if len(part.copies) == 3]
    assert len(cuts) == 2
    assert mesh_assembly(made).volume == pytest.approx(volume, rel=1e-4)
