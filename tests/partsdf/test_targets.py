"""What points alone tell of a shape: how far its surface is at most and at least, not what is inside."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

import partwright as pw
from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.config import LossSettings
from partwright.partsdf.model import Model
from partwright.partsdf.reconstruction import ReconstructionSettings, mean_error, reconstruct_unknown
from partwright.partsdf.targets import SURFACE, Target
from partwright.shapes.sampling import sample_triangles

RADIUS = 0.9
PLAIN = LossSettings()


def on_ball(count: int) -> np.ndarray:
    direction = np.random.default_rng(0).standard_normal((count, 3))
    return RADIUS * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def ball(target: Target, radius: float = RADIUS) -> torch.Tensor:
    return target.points.norm(dim=1) - radius


def test_the_surface_lies_between_what_points_say() -> None:
    target = Target.of_points(on_ball(2000), count=8000)
    assert target.low is not None
    away = ball(target).abs()
    assert (away <= target.sdf + 1e-5).all()
    assert (away >= target.low - 1e-5).float().mean() > 0.98
    on, off = target.halves()
    assert len(on) == len(off) == 4000
    assert away[on].max() < 1e-5
    assert (target.sdf - target.low)[off].mean() < 0.04  # the points are 0.07 apart
    assert target.surface is not None
    assert len(target.surface) == 2000
    again = Target.of_points(on_ball(2000), count=8000)
    assert torch.equal(again.points, target.points)


def test_errors_know_no_sign_and_no_more_than_points_do() -> None:
    target = Target.of_points(on_ball(2000), count=8000)
    rows = torch.arange(8000)
    true = target.error(ball(target)[None], rows, PLAIN)
    assert true.shape == (1, 8000)
    assert true.mean() < 2e-4
    torch.testing.assert_close(target.error(-ball(target)[None], rows, PLAIN), true)
    for radius in (RADIUS - 0.05, RADIUS + 0.05):
        assert target.error(ball(target, radius), rows, PLAIN).mean() > 0.02
    # Far away any distance will do that is as large as the clamp.
    far = torch.full_like(target.sdf, 5.0)
    assert target.error(far, rows, PLAIN)[target.low > 0.1].max() == 0  # type: ignore[operator]


def test_a_shape_that_came_as_points_is_known_by_them() -> None:
    points = 30 * on_ball(3000) + 7
    seen = pw.load_shape(points)
    assert seen.points is not None
    target = Target.seen_in(seen)
    assert target.low is not None
    assert target.surface is not None
    assert len(target.surface) == SURFACE
    np.testing.assert_allclose(target.surface.norm(dim=1), RADIUS, atol=0.02)
    points *= 2  # the shape's are its own
    np.testing.assert_allclose(np.ptp(seen.points, axis=0), 60 * RADIUS, rtol=0.01)
    mesh = pw.load_shape(trimesh.creation.icosphere(2))
    assert mesh.points is None
    assert Target.seen_in(mesh).low is None


def test_parts_are_found_from_few_points(model: Model, lamps: PreparedFamily) -> None:
    """Two hundred points that no surface is laid through."""
    held = lamps.load(lamps.split("test")[0])
    points, _ = sample_triangles(held.vertices.astype(float), held.faces.astype(int), 200, 0)
    target, true = Target.of_points(points), Target(torch.tensor(held.points), torch.tensor(held.sdf))
    start = reconstruct_unknown(model, target, ReconstructionSettings(iterations=0, start="nearest"))
    few = ReconstructionSettings(iterations=120, points=512, starts=2)
    found = reconstruct_unknown(model, target, few)
    assert mean_error(found, true) < 0.85 * mean_error(start, true)
    assert {"plate", "ball"} <= set(found.names())
