"""The largest native solids within polytopes: where they are known, and by the law of a maximum elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import Manifold

from partwright.approximation.convex_fit import support, volume
from partwright.approximation.hull_faces import faces_of
from partwright.approximation.largest_within import LARGEST, largest_within
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of


def largest(hull: Manifold, kind: type[Field], frame: np.ndarray) -> tuple[Field, np.ndarray]:
    return largest_within(kind, frame, *faces_of(hull), surface_of(hull)[0].mean(axis=0))


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        (Box, 6.0),
        (Cylinder, math.pi * 1.0 * 1.0),  # across the shortest side
        (Capsule, volume(Capsule(0.5, 2.0))),  # along the longest
        (Sphere, math.pi / 6),
    ],
)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_in_a_box_they_are_known(kind: type[Field], wanted: float, scale: float) -> None:
    turn = Manifold.cube((3, 2, 1)).rotate((10, 20, 30)).translate((5, 1, 2)).scale((scale,) * 3)
    normals = faces_of(Manifold.cube((3, 2, 1)).rotate((10, 20, 30)))[0]
    sides = normals[np.argsort(normals[:, 2])]
    axes = {round(float(np.ptp(surface_of(turn)[0] @ n)) / scale): n for n in sides}
    along = axes[3] if kind is Capsule else axes[1]
    across = axes[2]
    frame = np.column_stack([np.cross(across, along), across, along])
    found, centre = largest(turn, kind, frame)
    assert volume(found) == pytest.approx(wanted * scale**3, rel=2e-3)
    assert volume(found) <= wanted * scale**3
    if kind is not Sphere and kind is not Capsule:
        assert centre == pytest.approx(surface_of(turn)[0].mean(axis=0), abs=1e-2 * scale)


@pytest.mark.parametrize(
    ("kind", "wanted"), [(Box, 8 / 3**1.5), (Cylinder, 4 * math.pi / 3**1.5), (Sphere, 4 * math.pi / 3)]
)
def test_in_a_ball_they_are_known(kind: type[Field], wanted: float) -> None:
    found, centre = largest(Manifold.sphere(1.0, 64), kind, np.eye(3))
    assert volume(found) == pytest.approx(wanted, rel=1e-2)  # of facets
    assert centre == pytest.approx([0, 0, 0], abs=1e-2)


@pytest.mark.parametrize("kind", LARGEST)
@pytest.mark.parametrize("seed", range(3))
def test_no_other_one_near_it_is_larger(kind: type[Field], seed: int) -> None:
    random = np.random.default_rng(seed)
    hull = hull_of(random.normal(size=(30, 3)) * (1, 2, 0.5))
    frame = np.linalg.qr(random.normal(size=(3, 3)))[0]
    normals, offsets = faces_of(hull)
    found, centre = largest(hull, kind, frame)
    sizes = np.array(found.size if isinstance(found, Box) else list(vars(found).values()), float)
    assert (support(found, normals @ frame) + normals @ centre <= offsets + 1e-12).all()
    for step in (0.3, 0.03, 3e-3):
        for _ in range(100):
            changed = sizes * (1 + step * random.normal(size=len(sizes)))
            if changed.min() <= 0:
                continue
            other = Box(tuple(changed.tolist())) if kind is Box else kind(*changed.tolist())
            moved = centre + step * random.normal(size=3) * sizes.mean()
            if (support(other, normals @ frame) + normals @ moved <= offsets).all():
                assert volume(other) <= 1.002 * volume(found)
