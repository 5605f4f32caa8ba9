"""Extrusions and revolutions: their distance against the mesh, derivatives, files, and bad input."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from partwright import fields
from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields import Cylinder, Extrusion, Frustum, Profile, Revolution, Swept, Torus
from partwright.fields.extrusion import RIMS
from partwright.fields.profile import circle
from partwright.meshing import mesh_part
from partwright.shapes import MeshDistance

RNG = np.random.default_rng(0)
PLATE = Profile([(-1, -0.6), (1, -0.6, 0.5), (1, 0.4), (-1, 0.4, -0.2)], [circle(0.2, (0.3, 0))])
HALF = Profile([(0, -0.5), (0.6, -0.5), (0.6, 0.1), (0.3, 0.5, 0.4), (0, 0.6)])
SOLIDS: dict[str, Swept] = {
    "plate": Extrusion(PLATE, 0.8),
    "ring": Revolution(PLATE.moved((1.5, 0))),
    "arc of a ring": Revolution(PLATE.moved((1.5, 0)), 250),
    "knob": Revolution(HALF),
    "wedge of a knob": Revolution(HALF, 100),
    "rounded block with taper": Extrusion(Profile.rectangle(2, 1.2, 0.3), 0.8, 10),
    "block with rims": Extrusion(Profile.rectangle(2, 1.2, 0.3), 0.8, top_fillet=0.3, bottom_chamfer=0.2),
    "dome": Extrusion(Profile.circle(0.5), 0.8, bottom_fillet=0.3, top_fillet=0.5),
}
LEANING = Extrusion(Profile.polygon([(-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)]), 0.8, 10)
RIMMED = Extrusion(
    Profile(PLATE.outline, [circle(0.15, (0.3, -0.1))]), 0.8, bottom_fillet=0.06, top_chamfer=0.05
)
CUT = replace(LEANING, taper=0.0, bottom_chamfer=0.2, top_fillet=0.25)


def to_mesh(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    return MeshDistance(mesh.vertices, mesh.faces, mesh.faces, True, True).signed(points)


def around(field: Swept, count: int) -> np.ndarray:
    lower, upper = field.bounds()
    return RNG.uniform(lower - 0.4, upper + 0.4, (count, 3))


@pytest.mark.parametrize("field", SOLIDS.values(), ids=SOLIDS)
def test_the_distance_is_that_to_the_exact_mesh(field: Swept) -> None:
    mesh = mesh_part(Part(field), 256)
    assert mesh.is_watertight
    assert np.abs(field(mesh.vertices)).max() < 1e-6
    points = around(field, 3000)
    np.testing.assert_allclose(field(points), to_mesh(mesh, points), atol=3e-3)
    np.testing.assert_allclose(mesh.bounds, field.bounds(), atol=2e-3)


def test_known_solids_under_another_name() -> None:
    points = RNG.uniform(-1.5, 1.5, (2000, 3))
    pairs = [
        (Extrusion(Profile.circle(0.4), 0.9), Cylinder(0.4, 0.9)),
        (Extrusion(Profile.circle(0.5), 0.8, math.degrees(math.atan(0.2 / 0.8))), Frustum(0.5, 0.3, 0.8)),
        (Revolution(Profile.circle(0.2, (0.6, 0))), Torus(0.6, 0.2)),
        (Revolution(Profile.polygon([(0, -0.45), (0.4, -0.45), (0.4, 0.45), (0, 0.45)])), Cylinder(0.4, 0.9)),
    ]
    for swept, solid in pairs:
        np.testing.assert_allclose(swept(points), solid(points), atol=1e-6)


def rebuilt(field: Swept, corners: np.ndarray, numbers: list[float]) -> Swept:
    starts = field.profile.starts
    loops = [corners[a:b].tolist() for a, b in pairwise(starts)]
    return type(field)(Profile.of_loops(loops), *numbers)  # type: ignore[call-arg]


def names(field: Swept) -> tuple[str, ...]:
    return ("height", "taper", *RIMS) if isinstance(field, Extrusion) else ("angle",)


@pytest.mark.parametrize("field", [*list(SOLIDS.values())[:5], LEANING, RIMMED, CUT])
def test_derivatives_by_every_corner_bulge_and_number(field: Swept) -> None:
    """Against central differences of the distance itself."""
    points, weights, step = around(field, 1500), RNG.normal(size=1500), 1e-6
    numbers = [getattr(field, name) for name in names(field)]
    corners, found = field.profile.corners, field.gradients(points, weights)

    def slope(at: np.ndarray, those: list[float], other: np.ndarray, these: list[float]) -> float:
        values = [rebuilt(field, c, n)._distance(points) for c, n in ((at, those), (other, these))]
        return float(weights @ (values[0] - values[1])) / (2 * step)

    for i, k in np.ndindex(*corners.shape):
        on_axis = isinstance(field, Revolution) and k == 0 and corners[i, 0] == 0
        if on_axis or (k == 2 and corners[i, 2] == 0):  # a line, or a corner that may not move so
            continue
        pair = [corners.copy(), corners.copy()]
        pair[0][i, k] += step
        pair[1][i, k] -= step
        expected = slope(pair[0], numbers, pair[1], numbers)
        assert found.corners[i, k] == pytest.approx(expected, abs=1e-3)
    for k, value in enumerate(numbers):
        if value in (0.0, 360.0):  # sharp, upright or whole
            continue
        more, less = list(numbers), list(numbers)
        more[k], less[k] = value + step, value - step
        assert found.numbers[k] == pytest.approx(slope(corners, more, corners, less), abs=1e-3)


@pytest.mark.parametrize("field", [*SOLIDS.values(), LEANING, RIMMED, CUT])
def test_tensors_files_and_sizes(field: Swept) -> None:
    points = around(field, 500)
    tensor = torch.tensor(points, requires_grad=True)
    value = field(tensor)
    np.testing.assert_allclose(value.detach(), field(points), atol=1e-6)
    value.sum().backward()
    assert (tensor.grad.norm(dim=1) < 1 + 1e-6).all()
    again = fields.from_dict(json.loads(json.dumps(field.to_dict())))
    assert again == field
    np.testing.assert_allclose(field.scaled(3)(3 * points), 3 * field(points), atol=1e-5)
    directions = RNG.normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    corners = mesh_part(Part(field), 256).vertices
    reach = (directions @ corners.T).max(1)
    assert (np.abs(field.support(directions) - reach) < 3e-3).all()


@pytest.mark.parametrize(
    "field", [LEANING, RIMMED, CUT], ids=["taper", "rims at arcs", "rims at an inner corner"]
)
def test_beyond_mitres_the_distance_never_says_too_much(field: Extrusion) -> None:
    """Outside of the edges between leaning walls, and between rims, it is a lower bound."""
    points = around(field, 3000)
    mesh = mesh_part(Part(field), 256)
    assert mesh.is_watertight
    assert np.abs(field(mesh.vertices)).max() < 1e-6
    truth = to_mesh(mesh, points)
    found = field(points)
    assert (np.abs(found) <= np.abs(truth) + 1e-3).all()
    assert ((found < 0) == (truth < 0))[np.abs(truth) > 1e-3].all()


@pytest.mark.parametrize("rims", [{"bottom_fillet": 0.3}, {"top_chamfer": 0.2, "bottom_chamfer": 0.1}])
@pytest.mark.parametrize("height", [0.1 * 3, 0.3, 0.3 + 1e-10])
def test_rims_that_take_all_but_the_last_digits_of_the_height_leave_a_closed_mesh(
    rims: dict[str, float], height: float
) -> None:
    field = Extrusion(Profile.rectangle(2, 1.2), height, **rims)
    mesh = mesh_part(Part(field), 64)
    assert mesh.is_watertight
    plain = mesh_part(Part(replace(field, height=0.5)), 64)
    assert mesh.volume == pytest.approx(plain.volume - (0.5 - height) * 2 * 1.2, rel=1e-3)


def test_rims_take_the_volume_that_they_should() -> None:
    """A chamfer c around a box takes prisms along its edges, less where these meet; rims that meet leave half
    a torus around a disc."""
    c = 0.2
    box = mesh_part(Part(Extrusion(Profile.rectangle(2, 1.2), 0.8, top_chamfer=c)), 64)
    assert box.volume == pytest.approx(2 * 1.2 * 0.8 - (6.4 * c**2 / 2 - 4 * c**3 / 3), rel=1e-6)
    disc = mesh_part(Part(Extrusion(Profile.circle(0.7), 0.6, bottom_fillet=0.3, top_fillet=0.3)), 512)
    bulge = math.pi * 0.3**2 / 2 * 2 * math.pi * (0.4 + 4 * 0.3 / (3 * math.pi))
    assert disc.volume == pytest.approx(math.pi * 0.4**2 * 0.6 + bulge, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        (Extrusion, {"height": 0.0}, "height"),
        (Extrusion, {"height": math.nan}, "height"),
        (Extrusion, {"taper": -1.0}, "taper"),
        (Extrusion, {"taper": 60.0}, "further inside"),
        (Extrusion, {"taper": 0.0, "top_fillet": -0.1}, "top_fillet"),
        (Extrusion, {"taper": 0.0, "top_fillet": math.nan}, "top_fillet"),
        (Extrusion, {"top_fillet": 0.1}, "upright walls"),
        (Extrusion, {"taper": 0.0, "top_fillet": 0.1, "top_chamfer": 0.1}, "one of them"),
        (Extrusion, {"taper": 0.0, "top_fillet": 0.41, "bottom_chamfer": 0.4}, "rims take 0.81"),
        (Extrusion, {"taper": 0.0, "height": 3, "top_fillet": 0.6}, "further inside"),
        (Extrusion, {"profile": "circle"}, "expected a Profile"),
        (Revolution, {"angle": 0.0}, "angle"),
        (Revolution, {"angle": 361.0}, "angle"),
        (Revolution, {"profile": PLATE}, "distance from the axis"),
    ],
)
def test_bad_input_is_named(kind: Any, change: dict[str, Any], message: str) -> None:
    good = LEANING if kind is Extrusion else SOLIDS["knob"]
    with pytest.raises(ParameterError, match=message):
        replace(good, **change)


def test_files_say_what_is_wrong() -> None:
    for broken in (
        {"kind": "extrusion", "height": 1},
        {"kind": "extrusion", "profile": [], "height": 1},
        {"kind": "extrusion", "profile": {"outline": [[0, 0], [1, 0], [0, 1]], "hole": []}, "height": 1},
        {"kind": "revolution", "profile": {"outline": [[0, 0], [1, 0], [0, 1, "x"]]}},
    ):
        with pytest.raises(ParameterError, match="profile"):
            fields.from_dict(broken)
