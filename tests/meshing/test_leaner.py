"""Lean meshes: closed, as near to the surface, and with few triangles where it is flat."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, SuperFrustum
from partwright.meshing import lean_assembly, lean_part, mesh_assembly, mesh_part
from partwright.meshing.leaner import leaner

FORMS = {
    "block": SuperFrustum((1.0, 0.8, 0.6), roundness=0.2, dilation=0.02),
    "tube": SuperFrustum((0.8, 0.8, 1.2), roundness=1.0, onion=0.8),
    "arc": SuperFrustum((0.2, 0.3, 1.2), roundness=0.5, bulge=0.8, dilation=0.03),
    "plate": SuperFrustum((1.0, 0.7, 0.004), roundness=0.1),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_part_keeps_its_form_with_a_fraction_of_the_triangles(name: str) -> None:
    part = Part(FORMS[name], (0.3, -0.2, 0.1), (0.9, 0.3, 0.2, 0.1))
    full, lean = mesh_part(part, 48), lean_part(part, 48)
    assert lean.is_volume
    assert lean.euler_number == full.euler_number
    assert len(lean.faces) < 0.6 * len(full.faces)
    longest = np.ptp(full.bounds, axis=0).max()
    within = min(longest / 48 / 50, part.field.wall / 100)
    assert abs(lean.volume - full.volume) < within * full.area
    points, _ = trimesh.sample.sample_surface(lean, 20_000, seed=0)
    _, off, _ = trimesh.proximity.closest_point(full, points)
    assert off.max() < 2 * within
    np.testing.assert_allclose(lean.bounds, full.bounds, atol=2 * within)


def test_what_is_flat_takes_few_triangles() -> None:
    lean = lean_part(Part(FORMS["plate"]), 64)
    assert len(lean.faces) < len(mesh_part(Part(FORMS["plate"]), 64).faces) / 15


def test_an_assembly_is_told_its_mesh_or_meshed() -> None:
    assembly = Assembly((Part(FORMS["block"]), Part(FORMS["arc"], (0.2, 0.0, 0.5), blend=0.05)))
    full = mesh_assembly(assembly, 64)
    lean, told = lean_assembly(assembly, 64), lean_assembly(assembly, 64, mesh=full)
    np.testing.assert_array_equal(lean.vertices, told.vertices)
    assert lean.is_volume
    assert len(lean.faces) < len(full.faces) / 2
    assert lean.volume == pytest.approx(full.volume, rel=2e-3)


def test_exact_meshes_stay_as_they_are() -> None:
    part = Part(Cylinder(0.3, 1.0))
    np.testing.assert_array_equal(lean_part(part).vertices, mesh_part(part).vertices)
    cut = Part(Box((1, 1, 1))) - Part(Box((0.5, 0.5, 2)))
    np.testing.assert_array_equal(lean_assembly(cut).vertices, mesh_assembly(cut).vertices)


def test_what_is_open_stays_as_it_is() -> None:
    mesh = trimesh.creation.icosphere(3)
    mesh.update_faces(np.arange(len(mesh.faces)) > 10)
    assert leaner(mesh, 0.1) is mesh
