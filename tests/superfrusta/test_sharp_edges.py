"""Fillets and chamfers that features leave off are told, and nothing else is taken for one."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta.far_places import Solid
from partwright.superfrusta.feature_assembly import in_unit_frame
from partwright.superfrusta.sharp_edges import sharp_edge_warnings

PLATE = Profile.rectangle(60, 40)


def told(drawn: Assembly | Manifold, *found: Part) -> tuple[str, ...]:
    """Of a shape that was drawn, beside parts that were found."""
    if isinstance(drawn, Manifold):
        mesh = drawn.to_mesh64()
        surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts)
    else:
        surface = mesh_assembly(drawn)
    shape = pw.load_shape(surface, unit="mm")
    return sharp_edge_warnings(shape, Solid.of(in_unit_frame(shape, Assembly(found))))


@pytest.mark.parametrize(
    ("rim", "name"), [("chamfer", "a chamfer of about 2"), ("fillet", "a fillet of about")]
)
def test_a_rim_that_is_left_off_has_a_line_with_its_size_and_place(rim: str, name: str) -> None:
    drawn = Assembly((Part(Extrusion(PLATE, 20, **{f"top_{rim}": 2.0})),))
    (line,) = told(drawn, Part(Box((60, 40, 20))))
    assert line.startswith(f"left sharp: {name}")
    size = float(line.split("about ")[1].split(" mm")[0])
    assert size == pytest.approx(2, rel=0.1)
    assert "at the upper" in line
    assert told(drawn, *drawn.parts) == ()


def test_edges_alike_are_told_once() -> None:
    """Two blind holes, chamfered, of which the features know the bores."""
    block = Manifold.cube((60, 40, 20), center=True)
    for x in (-15, 15):
        sunk = Manifold.cylinder(30, 5, circular_segments=64, center=True)
        sunk += Manifold.cylinder(2, 5, 7, circular_segments=64).translate((0, 0, 8))
        block -= sunk.translate((x, 0, 0))
    bores = tuple(Part(Cylinder(5, 30), (x, 0, 0)) for x in (-15, 15))
    (line,) = told(block, *(Assembly((Part(Box((60, 40, 20))), *bores), "difference"),))
    assert line.startswith("left sharp: a chamfer of about 2 mm at the upper")
    assert "and one more place" in line


def test_an_inner_fillet_is_told_as_one() -> None:
    angle = np.radians(np.linspace(270, 180, 13))
    arc = np.column_stack([10 + 3 + 3 * np.cos(angle), 5 + 3 + 3 * np.sin(angle)]).tolist()
    outline = [[0, 0], [30, 0], [30, 5], *arc, [10, 20], [0, 20]]
    body = Manifold.revolve(CrossSection([outline]), 96)
    (line,) = told(body, Part(Cylinder(30, 5), (0, 0, 2.5)), Part(Cylinder(10, 20), (0, 0, 10)))
    assert line.startswith("left sharp: an inner fillet of about 3 mm")


def test_walls_that_are_off_and_facets_are_no_rims() -> None:
    drawn = Assembly((Part(Extrusion(PLATE, 20)),))
    assert told(drawn, Part(Box((59, 40, 20)))) == ()
    coarse = Manifold.cylinder(20, 20, circular_segments=20, center=True)
    coarse -= Manifold.cylinder(30, 8, circular_segments=6, center=True)
    ring = Assembly((Part(Cylinder(20, 20)), Part(Cylinder(8 * math.cos(math.pi / 12), 30))), "difference")
    assert told(coarse, *(ring,)) == ()


def test_where_much_else_is_off_nothing_is_told() -> None:
    """The strips of a poor fit are mostly faults of another kind."""
    body = Part(Extrusion(PLATE, 20, top_chamfer=2.0))
    bored = Assembly((body, Part(Cylinder(12, 30))), "difference")
    assert told(bored, Part(Box((60, 40, 20)))) == ()
    assert (
        len(told(bored, *(Assembly((Part(Box((60, 40, 20))), Part(Cylinder(12, 30))), "difference"),))) == 1
    )
