"""Corners that are cut off a block: one cut, open beyond its face, and its copies, turned and reflected."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion, Profile
from partwright.meshing.manifolds import as_mesh
from partwright.superfrusta.feature_steps import as_move, image_of


@pytest.mark.parametrize("length", [10.0, 3.0])
def test_a_cube_without_corners_is_a_box_and_one_corner_cut_off_again_and_again(length: float) -> None:
    """They were cut by cones, one of which lay the wrong way around, and steps mended what those left."""
    body = Manifold.cube((30, 30, 30), True)
    for signs in np.array(list(itertools.product((1.0, -1.0), repeat=3))) / math.sqrt(3):
        body = body.trim_by_plane(tuple(-signs), -(45 - length) / math.sqrt(3))
    body -= Manifold.cylinder(40, 6, 6, 64).translate((0, 0, -20))
    shape = pw.load_shape(as_mesh(body), unit="mm")
    parts = pw.fit(shape, "solids", quality="draft").assembly.parts
    assert [part.field.kind for part in parts] == ["box", "extrusion", "cylinder"]
    corner = parts[1]
    assert isinstance(corner.field, Extrusion)
    assert len(corner.field.profile.corners) == 3
    assert len(corner.copies) == 8
    places = np.array([copy.translation for copy in corner.copies])
    assert len(np.unique(np.sign(places), axis=0)) == 8
    assert corner.field.height > length / math.sqrt(3)  # it goes on in the open, at all of them


@pytest.mark.parametrize(("width", "over"), [(0.0, False), (1.0, True)])
def test_what_is_its_own_mirror_image_is_not_turned_over(width: float, over: bool) -> None:
    """Copies that were had their open ends elsewhere, and none was opened."""
    wedge = Part(Extrusion(Profile([(0, -2), (0, 2), (3, width)]), 5), (1, 2, 3), (0.8, 0.0, 0.6, 0.0))
    image = image_of(wedge, Similarity())
    move = as_move(wedge, image)
    assert move is not None
    points = np.random.default_rng(0).uniform(-6, 6, (500, 3)).astype(np.float32)
    np.testing.assert_allclose(wedge.transformed(move).distance(points), image.distance(points), atol=1e-5)
    up, flipped = (rotation_matrix(part.rotation)[:, 2] for part in (wedge, wedge.transformed(move)))
    assert float(flipped @ (up * (-1, 1, 1))) == pytest.approx(-1.0 if over else 1.0)
