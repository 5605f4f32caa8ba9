"""Pipes as closed meshes: rings of corners on the surface, carried along the path without a twist."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from manifold3d import Manifold

from partwright.fields.bent_path import Bend, perpendicular
from partwright.fields.pipe import Pipe
from partwright.fields.profile import arc_chords
from partwright.meshing.manifolds import closed
from partwright.meshing.revolve import corners_of_circle, quads


def piped(field: Pipe, tolerance: float) -> Manifold:
    """The pipe in its own frame."""
    places, across = rings(field, tolerance)
    count = corners_of_circle(field.radius, tolerance)
    angle = np.arange(count) * (2 * np.pi / count)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across  # (K, count, 3)
    index = np.arange(len(places) * count).reshape(len(places), count)
    outer = (places[:, None] + field.radius * circle).reshape(-1, 3)
    wall = _walls(index)
    if not field.bore:
        lids = [_fan(index[0][::-1]), _fan(index[-1])]
        return closed(outer, np.concatenate([wall, *lids]))
    inner = (places[:, None] + field.bore * circle).reshape(-1, 3)
    within = index + len(outer)
    rims = []
    for out, in_ in ((index[0], within[0]), (within[-1], index[-1])):
        rims.append(quads(out, in_, np.roll(in_, -1), np.roll(out, -1)))
    return closed(np.concatenate([outer, inner]), np.concatenate([wall, _walls(within)[:, ::-1], *rims]))


def rings(field: Pipe, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) places along the path between which chords of bends are within the tolerance, and (K, 2, 3) two
    unit vectors across it at each: those of the next are turned as the path is."""
    places: list[np.ndarray] = []
    ways: list[np.ndarray] = []
    for piece in field.pieces:
        count = 1
        if isinstance(piece, Bend):
            count = arc_chords(piece.radius + field.radius, piece.angle, tolerance)
        share = np.linspace(0.0, 1.0, count + 1)[1 if places else 0 :]
        places.append(piece.at(share))
        ways.append(piece.directions(share))
    path, along = np.concatenate(places), np.concatenate(ways)
    across = [perpendicular(along[0])]
    for before, after in pairwise(along):
        across.append(_turned(across[-1], before, after))
    one = np.array(across)
    return path, np.stack([one, np.cross(along, one)], axis=1)


def _turned(vector: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The vector after the least turn that takes one unit vector to another."""
    axis, cosine = np.cross(before, after), float(before @ after)
    turned = cosine * vector + np.cross(axis, vector) + axis * (axis @ vector) / (1 + cosine)
    turned = turned - after * (after @ turned)
    return np.asarray(turned / math.sqrt(turned @ turned))


def _walls(index: np.ndarray) -> np.ndarray:
    low, high = index[:-1], index[1:]
    return quads(low, np.roll(low, -1, axis=1), np.roll(high, -1, axis=1), high)


def _fan(ring: np.ndarray) -> np.ndarray:
    """Triangles of a convex ring, all at its first corner."""
    return np.stack([np.full(len(ring) - 2, ring[0]), ring[1:-1], ring[2:]], axis=1)
