"""Paths of straight runs and bends through traced middles, and the pipes of a body."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, Manifold
from numpy.typing import NDArray
from scipy.optimize import least_squares

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.directions import frame_along
from partwright.approximation.sketches.pipe_tracing import PipeTracing, Traced
from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields import Pipe
from partwright.fields.bent_path import Bend, Run, bend_between, lacking, taken_of_legs, with_fitting_bends
from partwright.fields.pipe import path_of
from partwright.meshing.manifolds import surface_of
from partwright.meshing.pipes import piped

Floats = NDArray[np.float64]

_CURVED = 0.03  # of one over the radius: where a path turns less it is straight
_SAME_WAY = math.cos(math.radians(40))  # between axes about which one bend turns
_SHARPEST = math.radians(115)  # a bend that turns by more is two corners, which lie less far out
_LEAST_TURN = math.radians(4)
_WIDER = 1.02  # times the radius, that bends are at least
_NEAR = 0.1  # of the radius: so near to the wall vertices are its own
_POINTS = 1500
_ROBUST = 0.01  # of the radius: of places that are further off only the sense counts
_STAY = 1e-3  # of how far a corner is moved, against how far vertices are off: ends may slide freely
_FITS = 0.5  # the same of bends that do not fit, or halves that are not alike
_OFF = 0.03  # of the radius, by which most of its vertices may be off a wall
_TIGHT = 0.05  # of a leg's length, by which its bends may be longer than it before they are made to fit
_ENTERS = 3.0  # radii that a rod goes on into what it meets at most
_PARTLY, _FULL = 0.3, 0.97  # of its section, that lies in that on the way and in the end
_STEPS = 12
_CHORDS = 1e-3  # unit lengths
_COMPLEX = 120_000  # triangles of a body whose rods are not traced


def pipe_candidates(body: Manifold) -> Iterator[Candidate]:
    """Rods and tubes of a body that bend."""
    if body.is_empty() or body.num_tri() > _COMPLEX:
        return
    vertices, faces = surface_of(body)
    for traced in PipeTracing(vertices, faces).found():
        pipe = pipe_of(traced)
        if pipe is not None:
            yield _candidate(_entering(pipe, body))


def _candidate(pipe: Pipe) -> Candidate:
    def make(further: float) -> Manifold:
        widest = min(p.radius for p in pipe.pieces if isinstance(p, Bend)) * (1 - 1e-3)
        radius = min(pipe.radius + further, widest)
        wall = pipe.thickness + (radius - pipe.radius) + further if pipe.thickness else 0.0
        return piped(dataclasses.replace(pipe, radius=radius, thickness=min(wall, 0.99 * radius)), _CHORDS)

    area = math.pi * (pipe.radius**2 - pipe.bore**2)
    return Candidate(Part(pipe), make, len(pipe.pieces), area * pipe.length)


def pipe_of(traced: Traced) -> Pipe | None:
    """The pipe whose wall is nearest to the one that was traced; None where none is near."""
    first = _corners(traced)
    if first is None:
        return None
    walls = _walls(first.path, traced.radius, traced.wall)
    if walls is None:
        return None
    corners, radius = _fitted(first, traced.radius, walls)
    legs = _loose(corners)
    off = np.abs(_reach(legs, walls) - radius)
    if np.quantile(off, 0.9) > _OFF * radius:
        return None
    corners[1:-1, 3] = np.maximum(corners[1:-1, 3], _WIDER * radius)
    corners = with_fitting_bends(corners, _TIGHT)
    wall = radius - traced.bore if traced.bore else 0.0
    try:
        return Pipe(path_of(corners), radius, wall)
    except ParameterError:
        return None


class _Corners(NamedTuple):
    """path: (K, 4) corners and bends. halves: of a bend that turns too far for one corner, the first's place
    among the bends."""

    path: Floats
    halves: list[int]


class _Line(NamedTuple):
    place: Floats
    way: Floats


def _corners(traced: Traced) -> _Corners | None:
    """Corners near the traced middles; None where it is straight."""
    ends, middles = traced.middles[[0, -1]], _evenly(traced.middles)
    ways, curving, axes = _curvature(middles)
    turns = curving * traced.radius > _CURVED
    runs = _runs(turns, axes)
    lines: list[_Line] = []
    bends: list[float] = []
    halves: list[int] = []
    start = 0
    for first, last in runs:
        angle = math.acos(float(np.clip(ways[max(first - 1, 0)] @ ways[min(last + 1, len(ways) - 1)], -1, 1)))
        if angle < _LEAST_TURN:
            continue
        lines.append(_line(middles, ways, start, first))
        strong = curving[first : last + 1]
        bend = 1 / float(np.median(strong[strong >= np.median(strong)]))
        if angle > _SHARPEST:
            middle = (first + last) // 2
            lines.append(_Line(middles[middle], ways[middle]))
            bends.append(bend)
            halves.append(len(bends) - 1)
        bends.append(bend)
        start = last
    if not bends:
        return None
    lines.append(_line(middles, ways, start, len(middles) - 1))
    places = [_foot(lines[0], ends[0])]
    places += [_meeting(one, other) for one, other in pairwise(lines)]
    places.append(_foot(lines[-1], ends[1]))
    return _Corners(np.column_stack([np.array(places), [0.0, *bends, 0.0]]), halves)


def _evenly(middles: Floats) -> Floats:
    """Without the last at either end where it is nearer than the others are to one another."""
    steps = np.linalg.norm(np.diff(middles, axis=0), axis=1)
    least = 0.6 * float(np.median(steps))
    return middles[int(steps[0] < least) : len(middles) - int(steps[-1] < least)]


def _curvature(middles: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit tangents (K, 3), how much a path curves (K,), and unit axes (K, 3) about which."""
    steps = np.diff(middles, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    chords = steps / lengths[:, None]
    turned = np.cross(chords[:-1], chords[1:])
    sine = np.linalg.norm(turned, axis=1)
    angle = np.arctan2(sine, (chords[:-1] * chords[1:]).sum(axis=1))
    curving = np.zeros(len(middles))
    curving[1:-1] = 2 * angle / (lengths[:-1] + lengths[1:])
    axes = np.zeros_like(middles)
    axes[1:-1] = turned / np.maximum(sine, 1e-12)[:, None]
    for end, inner in ((0, 1), (-1, -2)):
        curving[end], axes[end] = curving[inner], axes[inner]
    shares = lengths[:-1] / (lengths[:-1] + lengths[1:])
    ways = np.empty_like(middles)
    inner = shares[:, None] * chords[1:] + (1 - shares)[:, None] * chords[:-1]
    ways[1:-1] = inner / np.linalg.norm(inner, axis=1)[:, None]
    ways[0], ways[-1] = chords[0], chords[-1]
    return ways, curving, axes


def _runs(turns: NDArray[np.bool_], axes: Floats) -> list[tuple[int, int]]:
    """First and last of middles that turn one after another, about one axis."""
    found: list[tuple[int, int]] = []
    for i in np.flatnonzero(turns).tolist():
        if found and found[-1][1] == i - 1 and float(axes[found[-1][1]] @ axes[i]) > _SAME_WAY:
            found[-1] = found[-1][0], i
        else:
            found.append((i, i))
    return [(first, last) for first, last in found if last > first]


def _line(middles: Floats, ways: Floats, first: int, last: int) -> _Line:
    """Through what is straight between two bends, or where the one goes over into the other."""
    own = middles[first : last + 1]
    if len(own) < 4:
        middle = (first + last) // 2
        return _Line(middles[middle], ways[middle])
    own = own[1:-1]
    mean = own.mean(axis=0)
    way = np.linalg.svd(own - mean, full_matrices=False)[2][0]
    return _Line(mean, way if float(way @ ways[(first + last) // 2]) > 0 else -way)


def _foot(line: _Line, place: Floats) -> Floats:
    return np.asarray(line.place + ((place - line.place) @ line.way) * line.way)


def _meeting(one: _Line, other: _Line) -> Floats:
    """Half way between the places where two lines are nearest."""
    between, cosine = other.place - one.place, float(one.way @ other.way)
    a, b = float(between @ one.way), float(between @ other.way)
    square = max(1 - cosine * cosine, 1e-9)
    first = one.place + (a - b * cosine) / square * one.way
    second = other.place + (a * cosine - b) / square * other.way
    return np.asarray((first + second) / 2)


def _loose(corners: Floats) -> list[Run | Bend]:
    """The legs and bends of a path, whether or not these fit between one another."""
    places = corners[:, :3]
    legs = [Run(a, b) for a, b in pairwise(places)]
    ways = [leg.directions(np.zeros(1))[0] for leg in legs]
    begins = places[1:-1] - taken_of_legs(corners)[1:-1, None] * np.array(ways[:-1])
    bends = map(bend_between, ways[:-1], ways[1:], begins, corners[1:-1, 3].tolist())
    return [*legs, *bends]


class _Walls(NamedTuple):
    """Places (N, 3) on the walls, and of which leg or bend (N,)."""

    points: Floats
    owner: NDArray[np.int64]


def _walls(corners: Floats, radius: float, near: Floats) -> _Walls | None:
    own, taken = [], taken_of_legs(corners)
    for k, piece in enumerate(_loose(corners)):
        squared = piece.squared(near, 0.0)
        if isinstance(piece, Run):  # without what the bends at its ends take
            along = (near - piece.start) @ (piece.end - piece.start) / piece.length
            straight = (along > taken[k]) & (along < piece.length - taken[k + 1])
            squared = np.where(straight, squared, np.inf)
        own.append(squared)
    squares = np.array(own)
    owner = squares.argmin(axis=0)
    reach = np.sqrt(squares.min(axis=0))
    walls = np.flatnonzero(np.abs(reach - radius) < _NEAR * radius)
    if len(walls) < 8 * len(corners):
        return None
    chosen = walls[np.linspace(0, len(walls) - 1, min(_POINTS, len(walls))).astype(int)]
    return _Walls(near[chosen], owner[chosen])


def _reach(legs: Sequence[Run | Bend], walls: _Walls) -> Floats:
    """(N,) how far vertices are from the path."""
    found = np.empty(len(walls.points))
    for k, piece in enumerate(legs):
        own = walls.owner == k
        if own.any():
            found[own] = np.sqrt(piece.squared(walls.points[own], math.inf))
    return found


def _fitted(first: _Corners, radius: float, walls: _Walls) -> tuple[Floats, float]:
    """Corners and bends (K, 4), and the radius, for which places are nearest to the wall: bends fit between
    one another, and the halves of one are alike."""
    corners, count = first.path, len(first.path)
    given = np.concatenate([corners[:, :3].ravel(), corners[1:-1, 3], [radius]])
    weight = math.sqrt(len(walls.points))
    halves = np.array(first.halves, dtype=int)

    def taken(values: Floats) -> tuple[Floats, float]:
        moved = corners.copy()
        moved[:, :3] = values[: 3 * count].reshape(count, 3)
        moved[1:-1, 3] = values[3 * count : -1]
        return moved, float(values[-1])

    def off(values: Floats) -> Floats:
        moved, size = taken(values)
        bends = moved[1:-1, 3]
        over = np.maximum(lacking(moved), 0)
        unlike = bends[halves] - bends[halves + 1]
        held = weight * np.concatenate([_STAY * (values - given), _FITS * over, _FITS * unlike])
        return np.concatenate([_reach(_loose(moved), walls) - size, held])

    found = least_squares(off, given, loss="soft_l1", f_scale=_ROBUST * radius, x_scale=radius, max_nfev=30)
    return taken(found.x)


def _entering(pipe: Pipe, body: Manifold) -> Pipe:
    """The pipe with ends that go on into what it meets, until all of its section lies in that: a handle's,
    into the wall of its mug, also where it is round or they meet askew."""
    corners = pipe.corners
    disc = CrossSection.circle(pipe.radius, 32)
    for end, (place, out) in zip((0, -1), pipe.ends, strict=True):
        frame = frame_along(out)
        there = body.transform(np.column_stack([frame.T, -frame.T @ place]))
        for step in range(1, _STEPS + 1):
            by = _ENTERS * pipe.radius * step / _STEPS
            within = float((there.slice(by) ^ disc).area()) / disc.area()
            if within < _PARTLY:
                break
            if within > _FULL:
                corners[end, :3] += by * out
                break
    try:
        return pipe.with_corners(corners)
    except ParameterError:
        return pipe
