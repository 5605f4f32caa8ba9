"""A part goes on as far as its section lies in the shape, a cut as far as in the open."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile, Revolution
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_freeform import far_off, with_freeform
from partwright.superfrusta.feature_lengthening import lengthened
from partwright.superfrusta.feature_mending import FAR
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

BLOCK = Box((1.0, 1.0, 1.0))
ACROSS = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)  # the solid's z along x


def ends(part: Part) -> tuple[float, float]:
    low, high = part.bounds()
    return float(low[0]), float(high[0])


def test_a_rod_goes_on_into_a_block_and_not_out_of_it() -> None:
    rod = Part(Cylinder(0.1, 0.4), (-0.6, 0.0, 0.0), ACROSS)  # from x = -0.8 to -0.4
    (longer,) = lengthened(rod, True, BLOCK)
    assert ends(longer) == pytest.approx((-0.8, -0.2))  # by its width
    near = replace(rod, translation=(0.25, 0.0, 0.0))  # 0.05 from where the block ends
    reached = sorted(ends(part) for part in lengthened(near, True, BLOCK))
    assert reached[0] == pytest.approx((-0.15, 0.45))
    assert reached[1][0] == pytest.approx(0.05)
    assert 0.48 < reached[1][1] < 0.5


def test_a_cut_goes_on_in_the_open_and_all_copies_agree() -> None:
    cut = Part(Cylinder(0.1, 0.4), (-0.5, 0.0, 0.0), ACROSS)
    (longer,) = lengthened(cut, False, BLOCK)
    assert ends(longer) == pytest.approx((-0.9, -0.3))
    inside = replace(cut, instances=(Similarity(translation=(0.5, 0.0, 0.0)),))
    assert not list(lengthened(inside, False, BLOCK))


def test_leaning_walls_and_rims_stay() -> None:
    square = Profile.rectangle(0.2, 0.2)
    for field in (Extrusion(square, 0.4, taper=2.0), Extrusion(square, 0.4, 0.0, 0.02, 0.02)):
        assert not list(lengthened(Part(field), True, BLOCK))


def test_a_handle_that_ends_before_a_round_wall_is_turned_on_into_it() -> None:
    """What its flat end leaves of the way to the wall is no part of its own."""
    cup = Part(Cylinder(0.5, 1.6))
    ring = Profile.rectangle(0.16, 0.16).moved((0.45, 0.0))
    upright = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    handle = Part(Revolution(ring, 190.0), (0.75, 0.0, 0.0), upright)
    shape = pw.load_shape(mesh_assembly(Assembly((cup, handle))))
    settings = Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    short = replace(handle, field=Revolution(ring, 108.0))
    own = in_unit_frame(shape, Assembly((cup, short)))
    tree = search.scored(FeatureTree([Feature(True, part, np.zeros(0, bool), 4) for part in own.parts]))
    assert far_off(search, own) > FAR
    made = with_freeform(search, tree, FeatureAssembly(shape).in_unit_frame)
    fields = [feature.part.field for feature in made.features]
    assert (made.off, made.freeform, len(fields)) == (0.0, 0, 2)
    assert isinstance(fields[1], Revolution)
    assert fields[1].angle > 115.0
