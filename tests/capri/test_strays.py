"""Places where a tree is far off though samples hardly tell: found, and mended."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.capri import Settings
from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import CsgTree
from partwright.capri.method import found
from partwright.capri.strays import strays
from partwright.methods import FitRequest, Run
from partwright.shapes import Shape, load_shape

LIMIT = 0.054  # 3 % of the longest side


def pierced_plate(radius: float) -> trimesh.Trimesh:
    """A plate of 2 x 1.6 x 0.3 with a wide hole and a small one of this radius at (-0.6, 0.4)."""
    plate = trimesh.creation.box((2.0, 1.6, 0.3))
    holes = [
        trimesh.creation.cylinder(
            r, 1.0, sections=48, transform=np.eye(4) + np.outer((x, y, 0, 0), (0, 0, 0, 1))
        )
        for r, x, y in ((0.3, 0.4, 0.0), (radius, -0.6, 0.4))
    ]
    return trimesh.boolean.difference([plate, *holes])


def boxes(*spans: tuple[tuple[float, float, float], tuple[float, float, float]]) -> CsgTree:
    """A union of boxes given by their corners."""
    table, layer = [], []
    for lower, upper in spans:
        layer.append(tuple(range(len(table), len(table) + 6)))
        table += [rows.plane(-e, -c) for e, c in zip(np.eye(3), lower, strict=True)]
        table += [rows.plane(e, c) for e, c in zip(np.eye(3), upper, strict=True)]
    return CsgTree(np.stack(table), np.zeros(len(table), dtype=bool), (tuple(layer), ()))


def block() -> Shape:
    return load_shape(trimesh.creation.box((1.8, 1.8, 0.9)))


BLOCK = (-0.9, -0.9, -0.45), (0.9, 0.9, 0.45)


def test_nothing_is_far_off_in_the_exact_tree() -> None:
    assert strays(boxes(BLOCK), block(), LIMIT, 0) == []


def test_a_sliver_that_sticks_out_is_found_by_its_length() -> None:
    sliver = (-0.02, -0.02, 0.4), (0.02, 0.02, 0.75)
    places = strays(boxes(BLOCK, sliver), block(), LIMIT, 0)
    assert len(places) >= 1
    assert places[0].off == pytest.approx(0.3, abs=0.01)
    for place in places:
        assert (np.abs(place.points[:, :2]) <= 0.02).all()
        assert (place.points[:, 2] > 0.45 + LIMIT - 0.01).all()


def test_what_the_tree_lacks_is_found_too() -> None:
    places = strays(boxes(((-0.9, -0.9, -0.45), (0.7, 0.9, 0.45))), block(), LIMIT, 0)
    assert places[0].off == pytest.approx(0.2, abs=0.02)
    assert (np.concatenate([place.points for place in places])[:, 0] > 0.7).all()


@pytest.mark.parametrize("radius", [0.07, 0.09])
def test_a_hole_too_small_to_pay_is_drilled_where_it_is_far_off_else(radius: float) -> None:
    settings = Settings(surface=8000, near=6000, uniform=5000, tries=2, least=20, convex_price=0.02)
    fitted = found(FitRequest(load_shape(pierced_plate(radius)), settings, Run()))
    probes = np.array([[-0.6, 0.4, z] for z in (-0.1, 0.0, 0.1)])
    assert (fitted.assembly.distance(probes) > 0).all()
    assert fitted.searches[0].seconds["mend"] > 0
    assert strays(fitted.tree, load_shape(pierced_plate(radius)), LIMIT, 0) == []
