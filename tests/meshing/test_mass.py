"""Mass properties against closed forms, against sampling, and under every motion."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import Box, Cylinder, Field, Sphere, SuperFrustum, Torus
from partwright.meshing.mass import mass_properties

PI = np.pi


def ring(major: float, minor: float) -> tuple[float, list[float]]:
    volume = 2 * PI**2 * major * minor**2
    across = volume * (4 * major**2 + 5 * minor**2) / 8
    return volume, [across, across, volume * (major**2 + 0.75 * minor**2)]


CLOSED_FORMS: list[tuple[Field, float, list[float]]] = [
    (Box((1, 2, 3)), 6, [6 / 12 * (4 + 9), 6 / 12 * (1 + 9), 6 / 12 * (1 + 4)]),
    (Cylinder(0.5, 2), PI / 2, [PI / 2 * (0.75 + 4) / 12, PI / 2 * (0.75 + 4) / 12, PI / 2 * 0.125]),
    (Sphere(1.5), 4 / 3 * PI * 1.5**3, [0.4 * 2.25 * 4 / 3 * PI * 1.5**3] * 3),
    (Torus(1, 0.4), *ring(1, 0.4)),
]


@pytest.mark.parametrize(("field", "volume", "diagonal"), CLOSED_FORMS, ids=lambda v: getattr(v, "kind", ""))
def test_closed_forms(field: Field, volume: float, diagonal: list[float]) -> None:
    part = Part(field, (10, -20, 30), (0.5, 0.5, 0.5, 0.5))
    found = mass_properties(part)
    assert found.volume == pytest.approx(volume, rel=2e-3)
    assert np.allclose(found.centre, (10, -20, 30), atol=1e-3)
    # local x, y, z lie along world y, z, x
    expected = np.diag([diagonal[2], diagonal[0], diagonal[1]])
    assert np.allclose(found.inertia, expected, atol=4e-3 * max(diagonal))


def test_a_polyhedron_is_exact_however_far_and_small() -> None:
    box = trimesh.creation.box((1e-3, 2e-3, 3e-3))
    box.apply_translation((1e3, 0, 0))
    found = mass_properties(box)
    assert found.volume == pytest.approx(6e-9, rel=1e-8)
    diagonal = 6e-9 / 12 * np.array([13e-6, 10e-6, 5e-6])
    assert np.allclose(found.inertia, np.diag(diagonal), rtol=1e-6, atol=1e-8 * diagonal.max())


def test_a_bent_blended_assembly_as_sampling_finds_it() -> None:
    arc = Part(SuperFrustum((0.4, 0.5, 1.4), 0.5, 0.05, 0.8, 0.5), (0.2, 0, 0), (0.9, 0.1, 0.3, 0.2))
    assembly = Assembly((Part(Box((1, 0.6, 0.4))), Part(Sphere(0.4), (0.4, 0, 0), blend=0.1), arc))
    lower, upper = assembly.bounds()
    points = np.random.default_rng(0).uniform(lower, upper, (400_000, 3))
    inside = points[assembly.distance(points) < 0]
    volume = float(np.prod(upper - lower)) * len(inside) / len(points)
    offset = inside - inside.mean(axis=0)
    second = offset.T @ offset / len(inside) * volume
    found = mass_properties(assembly)
    assert found.volume == pytest.approx(volume, rel=0.01)
    assert np.allclose(found.centre, inside.mean(axis=0), atol=3e-3)
    assert np.allclose(found.inertia, np.trace(second) * np.eye(3) - second, atol=0.02 * np.trace(second))


def test_overlaps_count_once() -> None:
    box = Part(Box((1, 1, 1)))
    assert mass_properties(Assembly((box, box))).volume == pytest.approx(1, rel=1e-3)


@settings(max_examples=25)
@given(
    st.floats(0.01, 100.0),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    st.tuples(*[st.floats(-10, 10)] * 3),
)
def test_motion_and_scale(
    scale: float, rotation: tuple[float, float, float, float], place: tuple[float, float, float]
) -> None:
    similarity = Similarity(scale, rotation, place)
    mesh = trimesh.creation.cone(0.5, 1.0, sections=7)
    moved = mesh.copy().apply_transform(similarity.matrix())
    expected, found = mass_properties(mesh).transformed(similarity), mass_properties(moved)
    assert found.volume == pytest.approx(expected.volume)
    assert np.allclose(found.centre, expected.centre, rtol=1e-7, atol=1e-7 * scale)
    assert np.allclose(found.inertia, expected.inertia, rtol=1e-6, atol=1e-8 * scale**5)
    assert np.linalg.eigvalsh(found.inertia).min() > 0


def test_the_report_has_density_only_where_it_is_given() -> None:
    found = mass_properties(trimesh.creation.box((1, 1, 1)))
    assert set(found.to_dict("m")) == {"unit", "volume", "centre", "inertia_per_density"}
    report = found.to_dict("m", density=7800.0)
    assert report["mass"] == pytest.approx(7800)
    assert np.allclose(report["inertia"], np.eye(3) * 1300)


def test_what_has_no_mass() -> None:
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
    with pytest.raises(NoSurfaceError, match="no volume"):
        mass_properties(flat)
    for density in (0, -1.0, float("nan"), float("inf"), True, "heavy"):
        with pytest.raises(ParameterError, match="density"):
            mass_properties(trimesh.creation.box((1, 1, 1))).mass(density)  # type: ignore[arg-type]
