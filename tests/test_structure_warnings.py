"""What floats, and what is filled again, is told with its place; what is sound is not spoken of."""

from __future__ import annotations

import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Sphere
from partwright.fitting.structure_warnings import structure_warnings
from partwright.meshing import mesh_assembly
from partwright.shapes import load_shape

PLATE = Part(Box((40, 20, 4)), name="plate")
HOLE = Part(Cylinder(4, 6), (10, 0, 0), name="hole")


def told(result: Assembly, truth: Assembly) -> list[str]:
    mesh = mesh_assembly(truth)
    shape = load_shape(trimesh.Trimesh(mesh.vertices, mesh.faces), unit="mm", up="z")
    return structure_warnings(shape, result, mesh_assembly(result))


def test_a_chip_in_the_air_is_told_with_its_place() -> None:
    drilled = Assembly((PLATE, HOLE), "difference")
    assert told(drilled, drilled) == []
    chip = Part(Sphere(1), (-15, 0, 8), name="chip")
    (warning,) = told(Assembly((drilled, chip)), drilled)
    assert "a piece floats at the" in warning
    assert "left" in warning
    two = Assembly((drilled, chip, Part(Sphere(2), (15, 0, 8), name="ball")))
    assert any(
        "2 pieces float, the largest at the" in line and "right" in line for line in told(two, drilled)
    )


def test_an_input_of_two_bodies_may_have_two_pieces_and_a_cavity_is_none() -> None:
    apart = Assembly((PLATE, Part(Sphere(3), (0, 0, 20), name="ball")))
    assert told(apart, apart) == []
    hollow = Assembly((Part(Box((20, 20, 20)), name="box"), Part(Sphere(5), name="cavity")), "difference")
    assert told(hollow, hollow) == []


def test_a_part_that_closes_a_hole_is_named() -> None:
    drilled = Assembly((PLATE, HOLE), "difference")
    cover = Part(Box((12, 12, 4)), (10, 0, 0), name="cover")
    (warning,) = told(Assembly((drilled, cover)), drilled)
    assert "100% of what 'hole' takes away is filled again by 'cover', at the right" in warning
    core = Assembly((drilled, Part(Cylinder(3.9, 4), (10, 0, 0), name="core")))
    assert not any("filled" in line for line in told(core, core))
