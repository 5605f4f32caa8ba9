"""Assemblies of named solids whose every number is known: what a fit may be asked to find again.

Four sorts: solids that only touch one another, solids that run into each other, bodies with holes, slots and
pockets, and symmetric ones. Lengths are whole millimetres, about a hundred along the longest side. A number
of a part is *seen* where the faces that it places are on the surface of the whole; each part shows most of
its own surface, none is thin, and the whole hangs together.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.cleaning.dimensions import dimensions
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    HollowBox,
    Sphere,
    Torus,
    Tube,
)
from partwright.meshing import mesh_assembly, mesh_part
from partwright.superfrusta.flat_tree import flattened

Rng = np.random.Generator
Floats = NDArray[np.float64]

_SHOWN, _SHOWN_OF_CUTS = 0.5, 0.25  # of a part's surface, at least, is the whole's
_FACE_SHOWN = 0.25  # of a face, for the numbers that place it to be seen
_ON = 0.1  # millimetres: how near to the surface a point is on it
_FACING = 0.7
_SAMPLES = 2000
_HALF = math.sqrt(0.5)
_TURNS = ((1.0, 0.0, 0.0, 0.0), (_HALF, 0.0, _HALF, 0.0), (_HALF, _HALF, 0.0, 0.0))  # z along z, x, y


def _whole(rng: Rng, low: int, high: int) -> float:
    return float(rng.integers(low, high + 1))


def _solid(rng: Rng) -> Field:
    """One of the kinds, 15 to 60 mm."""

    def radius() -> float:
        return _whole(rng, 9, 24)

    makers: list[Callable[[], Field]] = [
        lambda: Box((_whole(rng, 18, 60), _whole(rng, 18, 60), _whole(rng, 12, 50))),
        lambda: Cylinder(radius(), _whole(rng, 16, 60)),
        lambda: Cone(_whole(rng, 12, 24), _whole(rng, 24, 50)),
        lambda: Frustum(_whole(rng, 16, 26), _whole(rng, 5, 12), _whole(rng, 20, 50)),
        lambda: Sphere(_whole(rng, 10, 26)),
        lambda: Capsule(_whole(rng, 7, 14), _whole(rng, 24, 50)),
        lambda: Tube(_whole(rng, 14, 26), _whole(rng, 4, 7), _whole(rng, 16, 50)),
        lambda: Torus(_whole(rng, 16, 28), _whole(rng, 5, 9)),
        lambda: HollowBox((_whole(rng, 30, 60), _whole(rng, 30, 60), _whole(rng, 20, 50)), _whole(rng, 4, 7)),
    ]
    return makers[int(rng.integers(len(makers)))]()


def _turn(rng: Rng, askew: bool) -> tuple[float, float, float, float]:
    """Along an axis of the frame, or, askew, turned by a multiple of 15 degrees about another besides."""
    base = Similarity(1.0, _TURNS[int(rng.integers(3))])
    if not askew:
        return base.rotation
    angle = math.radians(15.0 * float(rng.integers(1, 6)))
    about = np.eye(3)[int(rng.integers(3))] * math.sin(angle / 2)
    return (Similarity(1.0, (math.cos(angle / 2), *about.tolist())) @ base).rotation


def touching(rng: Rng) -> Assembly:
    """Two to five solids in a row or a pile: each one meets the one before by a millimetre or two."""
    return _piled(rng, int(rng.integers(2, 6)), into=1.5, askew=0.0)


def overlapping(rng: Rng) -> Assembly:
    """Two to five solids, each well into one of those before; one in three is turned askew."""
    return _piled(rng, int(rng.integers(2, 6)), into=9.0, askew=1 / 3)


def _piled(rng: Rng, count: int, into: float, askew: float) -> Assembly:
    parts = [Part(_solid(rng), rotation=_turn(rng, False), name="solid_1")]
    while len(parts) < count:
        near = parts[int(rng.integers(len(parts)))]
        new = Part(_solid(rng), rotation=_turn(rng, rng.uniform() < askew), name=f"solid_{len(parts) + 1}")
        axis, side = int(rng.integers(3)), (-1.0, 1.0)[int(rng.integers(2))]
        low, high = near.bounds()
        own_low, own_high = new.bounds()
        place = np.round((low + high) / 2 + rng.integers(-6, 7, 3))
        reach = (high - low)[axis] / 2 + (own_high - own_low)[axis] / 2 - into
        place[axis] = np.floor((low + high)[axis] / 2 + side * reach + (side < 0))
        parts.append(dataclasses.replace(new, translation=tuple(place.tolist())))
    return Assembly(tuple(parts))


def carved(rng: Rng) -> Assembly:
    """A plate, block or disc with two to five holes, slots, pockets and dimples."""
    body: Field
    if rng.uniform() < 0.7:
        body = Box((_whole(rng, 70, 100), _whole(rng, 50, 80), _whole(rng, 12, 40)))
    else:
        body = Cylinder(_whole(rng, 35, 50), _whole(rng, 12, 40))
    low, high = body.bounds()
    depth = float(high[2] - low[2])
    cuts = [
        dataclasses.replace(_cut(rng, depth), name=f"cut_{i + 1}") for i in range(int(rng.integers(2, 6)))
    ]
    moved = []
    for cut in cuts:
        x, y = (np.round(rng.uniform(-0.8, 0.8, 2) * (high - low)[:2] / 2)).tolist()
        moved.append(dataclasses.replace(cut, translation=(x, y, cut.translation[2])))
    return Assembly((Part(body, name="body"), *moved), operation="difference")


def _cut(rng: Rng, depth: float) -> Part:
    """What is taken from the top of a body, or all through."""
    top = depth / 2
    deep = float(round(rng.uniform(0.4, 0.7) * depth))
    kind = int(rng.integers(5))
    if kind == 0:
        return Part(Cylinder(_whole(rng, 4, 12), 2 * depth))
    if kind == 1:
        return Part(Cylinder(_whole(rng, 5, 14), 2 * deep), (0, 0, top))
    if kind == 2:
        return Part(Box((_whole(rng, 8, 16), _whole(rng, 16, 40), 2 * depth)))
    if kind == 3:
        return Part(Box((_whole(rng, 12, 30), _whole(rng, 12, 30), 2 * deep)), (0, 0, top))
    return Part(Sphere(float(round(rng.uniform(0.5, 0.75) * depth))), (0, 0, top))


def symmetric(rng: Rng) -> Assembly:
    """A plate with posts or holes at its corners, or a disc with them around a circle, and a boss in the
    middle."""
    height = _whole(rng, 8, 16)
    drilled = bool(rng.uniform() < 0.5)
    size = _whole(rng, 4, 7)
    one: Field = (
        Cylinder(size, 3 * height) if drilled or rng.uniform() < 0.5 else Box((2 * size, 2 * size, 30))
    )
    z = 0.0 if drilled else float(round(height / 2 + 12))
    if rng.uniform() < 0.5:
        x, y = _whole(rng, 30, 38), _whole(rng, 22, 30)
        body: Field = Box((2 * x + 28, 2 * y + 28, height))
        places = [(x, y), (-x, y), (-x, -y), (x, -y)]
        moves = tuple(Similarity(translation=(a - x, b - y, 0)) for a, b in places[1:])
        first = Part(one, (x, y, z), name="repeat", instances=moves)
    else:
        count, radius = int(rng.integers(3, 9)), _whole(rng, 30, 36)
        body = Cylinder(radius + 14, height)
        turns = (2 * math.pi * k / count for k in range(1, count))
        moves = tuple(Similarity(1.0, (math.cos(t / 2), 0.0, 0.0, math.sin(t / 2))) for t in turns)
        first = Part(one, (radius, 0, z), name="repeat", instances=moves)
    boss: Field = (
        Cylinder(_whole(rng, 10, 18), 36)
        if rng.uniform() < 0.5
        else Tube(_whole(rng, 12, 18), _whole(rng, 4, 6), 36)
    )
    middle = Part(boss, (0, 0, float(round(height / 2 + 14))), name="boss")
    plate = Part(body, name="body")
    if drilled:
        return Assembly((Assembly((plate, middle)), first), operation="difference")
    return Assembly((plate, middle, first))


SORTS = {"touching": touching, "overlapping": overlapping, "carved": carved, "symmetric": symmetric}
COUNTS = {"touching": 12, "overlapping": 12, "carved": 14, "symmetric": 12}


@dataclass(frozen=True)
class Known:
    """One assembly; seen: of each leaf, which of its dimensions are."""

    name: str
    sort: str
    assembly: Assembly
    seen: tuple[tuple[bool, ...], ...]


NAMES = tuple(f"{sort}_{i + 1:02d}" for sort, count in COUNTS.items() for i in range(count))  # all 50


def known_assembly(name: str) -> Known:
    """The one of this name, the same every time."""
    sort, number = name.split("_")
    rng = np.random.default_rng([list(SORTS).index(sort), int(number)])
    while True:
        assembly = dataclasses.replace(SORTS[sort](rng), unit="mm", name=f"{sort} {int(number)}")
        if fair(assembly):
            return Known(name, sort, assembly, tuple(_seen(assembly, part) for part in assembly.parts))


def fair(assembly: Assembly) -> bool:
    """Whether the whole hangs together and every copy shows enough of itself."""
    if mesh_assembly(assembly).body_count != 1:
        return False
    added = {part.name: plus for part, plus in flattened(assembly)}
    return all(
        float(_shown(assembly, copy)[0].mean()) > (_SHOWN if added[part.name] else _SHOWN_OF_CUTS)
        for part in assembly.parts
        for copy in part.copies
    )


def _shown(assembly: Assembly, copy: Part) -> tuple[NDArray[np.bool_], Floats]:
    """Whether points (n,) all over one copy's surface are on the whole's, and its normals (n, 3) there, in
    the copy's own frame."""
    mesh = mesh_part(dataclasses.replace(copy, instances=()))
    points, face = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    shown = np.abs(assembly.distance(np.asarray(points))) < _ON
    return np.asarray(shown), np.asarray(mesh.face_normals[face] @ rotation_matrix(copy.rotation))


def _seen(assembly: Assembly, part: Part) -> tuple[bool, ...]:
    """Which of the part's dimensions are seen: those whose faces on both sides are."""
    shown, normals = _shown(assembly, part)

    def face(axis: int, side: float) -> bool:
        facing = side * normals[:, axis] > _FACING
        return bool(facing.any() and shown[facing].mean() > _FACE_SHOWN)

    both = [face(axis, -1.0) and face(axis, 1.0) for axis in range(3)]
    seen = {f"size {name}": both[axis] for axis, name in enumerate("xyz")} | {"height": both[2]}
    if isinstance(part.field, Frustum):
        seen |= {"bottom_radius": face(2, -1.0), "top_radius": face(2, 1.0)}
    if isinstance(part.field, Cone):
        seen |= {"radius": face(2, -1.0), "height": face(2, -1.0)}
    return tuple(seen.get(d.name, True) for d in dimensions(type(part.field)))
