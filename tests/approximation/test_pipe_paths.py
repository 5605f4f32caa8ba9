"""Rods and tubes that bend are found with their numbers, and nothing else is taken for one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from partwright.approximation.sketches.pipe_paths import pipe_candidates
from partwright.fields import Pipe, Torus
from partwright.meshing.manifolds import closed
from partwright.meshing.named_solids import named_solid
from partwright.meshing.pipes import piped
from partwright.meshing.revolve import quads

SNAKE = Pipe(((-0.8, -0.3, 0), (0.0, -0.3, 0, 0.2), (0.0, 0.4, 0, 0.25), (0.7, 0.4, 0)), 0.08)
SPATIAL = Pipe(((-0.6, -0.5, -0.4), (0.5, -0.5, -0.4, 0.3), (0.5, 0.5, -0.4, 0.2), (0.5, 0.5, 0.6)), 0.1)
ELBOW = Pipe(((-0.7, 0, 0), (0.5, 0, 0, 0.5), (0.5, 0.9, 0)), 0.22, 0.05)
HOOK = Pipe(((0.6, -0.3, 0), (-0.3, -0.3, 0, 0.3), (-0.3, 0.3, 0, 0.3), (0.2, 0.3, 0)), 0.07)
DOUBLE = Pipe(((-0.7, 0.0, 0), (-0.2, 0.0, 0, 0.2), (0.2, 0.4, 0, 0.2), (0.7, 0.4, 0)), 0.06)


def found(body: Manifold) -> list[Pipe]:
    fields = [candidate.part.field for candidate in pipe_candidates(body)]
    assert all(isinstance(field, Pipe) for field in fields)
    return fields  # type: ignore[return-value]


def same_body(one: Pipe, other: Pipe) -> float:
    """Volume that only one of them has, over that of the other."""
    a, b = (piped(pipe, 1e-4) for pipe in (one, other))
    return float(((a - b) + (b - a)).volume() / b.volume())


PIPES = {"snake": SNAKE, "3d": SPATIAL, "tube": ELBOW, "hook": HOOK, "s": DOUBLE}


@pytest.mark.parametrize("pipe", PIPES.values(), ids=PIPES.keys())
@pytest.mark.parametrize("turn", [(0, 0, 0), (25, 40, 10)])
def test_a_pipe_is_found_with_its_numbers(pipe: Pipe, turn: tuple[float, float, float]) -> None:
    body = piped(pipe, 3e-4).rotate(turn)
    (again,) = found(body)
    assert again.radius == pytest.approx(pipe.radius, rel=5e-3)
    assert again.bore == pytest.approx(pipe.bore, rel=1e-2)
    assert len(again.path) == len(pipe.path)
    bends, wanted = (sorted(corner[3] for corner in one.path[1:-1]) for one in (again, pipe))
    assert bends == pytest.approx(wanted, rel=0.02)
    whole = piped(again, 1e-4)
    assert float(((whole - body) + (body - whole)).volume() / body.volume()) < 0.02


def test_coarse_facets_and_a_flat_side_do_not_hide_a_rod() -> None:
    """Twelve facets around, and a hundredth of the width cut off along a side, so that it can be printed."""
    body = piped(SNAKE, 5e-3) - Manifold.cube((4, 4, 0.2), True).translate((0, 0, 0.178))
    (again,) = found(body)
    assert same_body(again, SNAKE) < 0.06


def test_what_meets_a_rod_does_not_end_it() -> None:
    body = piped(SNAKE, 1e-3) + Manifold.cylinder(0.5, 0.08, 0.08, 48).translate((-0.45, -0.3, 0))
    (again,) = found(body)
    assert same_body(again, SNAKE) < 0.02


def test_a_handle_goes_on_into_its_mug_and_not_through_its_wall() -> None:
    mug = Manifold.cylinder(1.0, 0.5, 0.5, 96, True) - Manifold.cylinder(0.9, 0.4, 0.4, 96).translate(
        (0, 0, -0.4)
    )
    handle = Pipe(((0.45, 0, -0.25), (0.8, 0, -0.25, 0.15), (0.8, 0, 0.25, 0.15), (0.45, 0, 0.25)), 0.06)
    outside = piped(handle, 1e-3) - Manifold.cylinder(1.0, 0.4, 0.4, 96, True)
    (again,) = found(mug + outside)
    reach = np.hypot(*np.array([again.path[0], again.path[-1]])[:, :2].T)
    assert (reach > 0.4).all()
    assert (reach < 0.5).all()
    assert again.radius == pytest.approx(0.06, rel=5e-3)


def test_a_bent_bore_of_a_block_is_a_pipe_of_what_is_missing() -> None:
    block = Manifold.cube((1.2, 1.2, 0.5), True)
    channel = Pipe(((-0.7, 0, 0), (0.1, 0, 0, 0.25), (0.1, 0.7, 0)), 0.1)
    missing = block - (block - piped(channel, 1e-3))
    (again,) = found(missing)
    assert again.radius == pytest.approx(0.1, rel=5e-3)
    assert again.path[1][3] == pytest.approx(0.25, rel=0.02)


def _ball() -> Manifold:
    return Manifold.sphere(0.6, 64)


def _ring() -> Manifold:
    return named_solid(Torus(0.6, 0.1), 1e-3)


def _horn() -> Manifold:
    """A bend whose radius grows from .05 to .2."""
    rings, count = 40, 32
    turn = np.linspace(0, np.pi / 2, rings)[:, None]
    width = np.linspace(0.05, 0.2, rings)[:, None]
    around = np.linspace(0, 2 * np.pi, count, endpoint=False)
    out, up = 0.6 + width * np.cos(around), width * np.sin(around)
    points = np.stack([out * np.cos(turn), out * np.sin(turn), up], 2).reshape(-1, 3)
    index = np.arange(rings * count).reshape(rings, count)
    low, high = index[:-1], index[1:]
    wall = quads(low, high, np.roll(high, -1, 1), np.roll(low, -1, 1))
    lids = [
        np.stack([np.full(count - 2, ring[0]), ring[1:-1], ring[2:]], 1)
        for ring in (index[0], index[-1][::-1])
    ]
    return closed(points, np.concatenate([wall, *lids]))


def _square_bar() -> Manifold:
    """Bent, and not round."""
    square = [[(0.5, -0.1), (0.7, -0.1), (0.7, 0.1), (0.5, 0.1)]]
    return Manifold.revolve(CrossSection(square), 64, 120.0)


@pytest.mark.parametrize("body", [_ball, _ring, _horn, _square_bar], ids=lambda make: make.__name__)
def test_nothing_else_is_taken_for_a_pipe(body: Any) -> None:
    assert not body().is_empty()
    assert found(body()) == []


def test_a_straight_rod_is_a_cylinder_for_others_to_find() -> None:
    assert found(Manifold.cylinder(1.0, 0.1, 0.1, 48)) == []
