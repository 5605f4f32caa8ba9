"""Features of a coarse mesh are those that were drawn, and not its facets."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

import partwright as pw
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings


def arc(radius: float, first: float, last: float, chords: int) -> list[list[float]]:
    angle = np.radians(np.linspace(first, last, chords + 1))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]).tolist()


@pytest.mark.parametrize("chords", [8, 12])
def test_a_coarse_clamp_is_its_outline_and_a_hole_across(chords: int) -> None:
    """Chords of such arcs lie up to a hundredth of the length off them: it was a block, its corners cut off
    facet by facet."""
    outline = [
        *arc(8, 180, 360, chords),
        [8, 12],
        [3.5, 12],
        *arc(3.5, 360, 180, chords),
        [-3.5, 12],
        [-8, 12],
    ]
    hole = Manifold.cylinder(20, 1.6, circular_segments=2 * chords, center=True)
    body = Manifold.extrude(CrossSection([outline]), 8)
    mesh = (body - hole.rotate((0, 90, 0)).translate((0, 8, 4))).to_mesh64()
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts), unit="mm")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    tree = search.run()
    assert tree is not None
    assert [(f.added, f.part.field.kind) for f in tree.features] == [(True, "extrusion"), (False, "cylinder")]
    (sides,) = tree.features[0].part.field.profile.sides
    assert sorted(abs(side.sweep) for side in sides if side.centre) == pytest.approx([math.pi] * 2, rel=0.02)
    assert len(sides) == 8
    assert tree.score > 0.99
