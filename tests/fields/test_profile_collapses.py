"""Parallel curves of profiles whose sides vanish on the way inwards, and rims that go so deep."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import CrossSection, JoinType
from trimesh import Trimesh
from trimesh.sample import sample_surface

from partwright.errors import ParameterError
from partwright.fields import Extrusion, Profile
from partwright.fields.profile_collapses import first_collapse, section, stages
from partwright.fields.profile_distance import profile_distance
from partwright.meshing.manifolds import as_mesh
from partwright.meshing.swept_solids import extruded

CORNERS = {  # profile, depth, at which depth the first side vanishes
    "corners less round": (Profile.rectangle(20, 12, 1), 2.0, 1.0),
    "a corner cut off": (Profile([(0, 0), (20, 0), (20, 11), (19, 12), (0, 12)]), 2.0, 1 / (2 - 2**0.5)),
    "a notch": (Profile([(0, 0), (20, 0), (20, 9), (11, 9), (11, 8), (9, 8), (9, 9), (0, 9)]), 2.0, 1.0),
    "a thin rib": (Profile([(0, 0), (20, 0), (20, 3), (11, 3), (11, 20), (9, 20), (9, 3), (0, 3)]), 1.2, 1.0),
    "half a circle": (Profile([(0, 0), (20, 0), (20, 12), (11, 12, 1.0), (9, 12), (0, 12)]), 2.0, 1.0),
    "a nearly smooth arc": (
        Profile([(0, 0), (19, 0), (20, 1.1), (20, 12), (11, 12, 0.4), (9, 12.4, 0.1), (0, 12)]), 2.5, None
    ),
    "a hole beside it": (
        Profile(Profile.rectangle(20, 12, 1).outline, [Profile.rectangle(4, 4, 0.5).outline]), 1.8, 1.0
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CORNERS)
def test_what_is_left_is_as_deep_everywhere_and_all_that_is(case: str) -> None:
    profile, deepest, first = CORNERS[case]
    found = stages(profile, deepest)
    assert len(found) > 1
    if first is not None:
        assert first_collapse(profile, deepest) == pytest.approx(first, rel=1e-8)
    fine = [np.asarray(line) for line in profile.polylines(1e-6)]
    for depth in (0.3 * deepest, 0.95 * found[1].depth, 1.05 * found[1].depth, deepest):
        inner, walls = section(profile, found, depth)
        points = np.concatenate(inner.polylines(1e-4))
        np.testing.assert_allclose(profile_distance(profile, points), -depth, atol=1e-9)
        known = CrossSection(fine).offset(-depth, JoinType.Round, circular_segments=4000)
        assert inner.area == pytest.approx(known.area(), rel=1e-4)
        assert [len(loop) for loop in walls] == [len(front.movers) for front in found[0].fronts]


@pytest.mark.parametrize("rims", [{"top_fillet": 1.0}, {"bottom_chamfer": 1.0, "top_chamfer": 0.5}])
@pytest.mark.parametrize("case", CORNERS)
def test_rims_so_deep_are_meshed_exactly(case: str, rims: dict[str, float]) -> None:
    profile, deepest, _ = CORNERS[case]
    field = Extrusion(profile, 8.0, **{name: share * deepest for name, share in rims.items()})
    solid = extruded(field, 1e-3)
    assert solid.genus() == len(profile.holes)
    points = np.asarray(sample_surface(as_mesh(solid), 5_000, seed=0)[0])
    assert np.abs(field(points)).max() < 0.03  # half a circle leaves along a root, in a dozen steps
    assert np.abs(field(points)).mean() < 1e-3
    lower, upper = field.bounds()
    np.testing.assert_allclose(np.reshape(solid.bounding_box(), (2, 3)), [lower, upper], atol=2e-3)


def test_what_falls_apart_or_leaves_nothing_is_refused() -> None:
    neck = [
        (0, 0),
        (8, 0),
        (8, 4),
        (12, 4),
        (12, 0),
        (20, 0),
        (20, 12),
        (12, 12),
        (12, 6),
        (8, 6),
        (8, 12),
        (0, 12),
    ]
    with pytest.raises(ParameterError, match="further inside"):
        Extrusion(Profile(neck), 8, top_fillet=1.5)
    with pytest.raises(ParameterError, match="further inside"):
        Extrusion(Profile.rectangle(20, 12, 1), 8, top_fillet=6.5)


def neck(*right: tuple[float, float]) -> Profile:
    """A shaft with a thinner neck below its end, of which these are the corners to the right."""
    left = [(-10, 60), (-10, 56), (-8, 56), (-8, 40), (-10, 40)]
    return Profile([(-10, 0), (10, 0), (10, 40), *right, (10, 56), (10, 60), *left])


def test_what_falls_apart_on_the_way_is_refused_though_it_is_whole_further_inside() -> None:
    """A neck that is thinner in its middle, where its walls meet before either is gone: no mesh leads past
    that."""
    waisted = neck((8, 40), (7.99, 48), (8, 56))
    with pytest.raises(ParameterError, match="falls apart"):
        Extrusion(waisted, 40, bottom_fillet=9)
    shallow = Extrusion(waisted, 40, bottom_fillet=1.5)
    assert extruded(shallow, 1e-2).genus() == 0


def test_a_neck_that_vanishes_all_at_once_does_not_fall_apart() -> None:
    """Its walls are parallel, if a little out of line with those on the other side."""
    solid = Extrusion(neck((8.01, 40), (8.01, 56)), 40, bottom_fillet=9)
    mesh = extruded(solid, 1e-3)
    assert mesh.genus() == 0
    surface = as_mesh(mesh)
    points, _ = sample_surface(Trimesh(surface.vertices, surface.faces, process=False), 4000, seed=0)
    assert np.abs(solid(points)).max() < 0.03


@pytest.mark.parametrize("mirror", [(1, 1), (-1, 1), (1, -1)])
def test_a_slanting_bar_that_vanishes_all_at_once_does_so_in_its_mirror_image(
    mirror: tuple[int, int],
) -> None:
    """Of its two sides, which are parallel, one alone is gone where the corners beside it meet."""
    outline = [(-88, -10), (-40, -10), (-40, 7.8), (-63.3, 7.8), (-67.5, 12), (-67.5, 18.8), (-63.3, 23)]
    outline += [(-65.9, 23), (-69.2, 19.7), (-85.2, 23), (-88, 23)]
    corners = [(x * mirror[0], y * mirror[1], 0.0) for x, y in outline[:: mirror[0] * mirror[1]]]
    inner = Extrusion(Profile(corners), 5.0, bottom_chamfer=1.1).within(1.1)[0]
    assert inner.area == pytest.approx(975.7105148578, rel=1e-12)
