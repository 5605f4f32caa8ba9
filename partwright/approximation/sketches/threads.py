"""Screw threads of a closed body: found by the screw motion that keeps their flanks where they are, and taken
out, so that what is left is the plain rod or hole that a drawing shows.

A surface is kept by a motion where the velocity of every point is across the normal there. Over a patch this
is least squares in the six numbers of the motion (Pottmann and Wallner, Computational Line Geometry, 2001).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from partwright.meshing.manifolds import as_mesh
from partwright.shapes.topology import components

if TYPE_CHECKING:
    import trimesh

_SMOOTH = math.radians(25), math.radians(10)  # between faces of a patch; run-outs turn into rods by less
_LEAST_AREA, _LEAST_FACES = 2e-3, 24  # of the surface, that a patch has
_TRIMMED, _ROUNDS = 0.85, 3  # of a patch, that is fitted again: chords beside edges lean
_UPRIGHT = 1e-3  # of the largest: least spread of normals that are those of no cylinder and no plane
_ACROSS = 0.03  # root mean square of the cosine between velocity and normal, at most
_ONLY = 30.0  # times as far off all other motions are, squared
_KEPT, _RADIAL = 0.1, 0.95  # of a face: cosine to the velocity, and to the way out, at most
_UNEVEN, _PITCHES = 0.06, 241  # of the pitch, that is tried around it, in so many steps
_COHERENT = 0.5  # of the flanks' area, that agrees on where a turn lies, at least
_STARTS = 6  # ridges that wind beside one another, at most
_TURNS = 1.3  # that a patch goes around, at least
_DEPTH = (0.02, 0.35)  # of the outer radius
_CLIMB = (0.7, 30.0)  # depths that a thread climbs in a turn
_STEEP = 1.5  # outer radii that it climbs, at most
_SAME = 0.03  # of the outer radius, and of the pitch, by which flanks of one thread differ
_SECTIONS, _OFFSET = 24, 0.01  # half planes through the axis, radians
_BESIDE = 0.03  # of the outer radius, beside the flanks
_WHOLE = 0.9  # of what is behind a thread, that is solid
_EVEN = 0.6  # of the median area of its sections, that each of them has: no slot runs across
_CIRCLE, _ROUNDING = 96, 0.03  # of the depth
_OVERLAP = 1e-3  # unit lengths


Screw = tuple[np.ndarray, np.ndarray, float]
"""A point (3,) of the axis, its direction (3,), and the climb in a radian."""


@dataclass(frozen=True)
class Thread:
    """axis: (3,) a point of it, in the middle of the thread. direction: (3,) unit. pitch: length that it
    climbs in a turn, negative where it is left-handed. inner, outer: radii. length: along the direction.
    internal: whether it is in a hole."""

    axis: np.ndarray
    direction: np.ndarray
    pitch: float
    inner: float
    outer: float
    length: float
    internal: bool

    @property
    def frame(self) -> np.ndarray:
        """(3, 4): from where the axis is z, and its point the origin."""
        x = np.cross(self.direction, np.eye(3)[int(np.abs(self.direction).argmin())])
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(self.direction, x), self.direction, self.axis])


def without_threads(body: Manifold) -> tuple[Manifold, list[Thread]]:
    """The body with its grooves filled as far as their crests, and the threads: those of coarse meshes first,
    the larger before the smaller. One that a slot runs across stays."""
    mesh = as_mesh(body)
    found: list[Thread] = []
    for thread in chain.from_iterable(_candidates(mesh, smooth) for smooth in _SMOOTH):
        if any(_overlap(thread, other) for other in found):
            continue
        sections = _sections(body, thread)
        kinds = [kind for kind in (False, True) if _is_behind(sections, thread, kind)]
        if len(kinds) != 1:  # a spring, a worm's free flight
            continue
        areas = np.array([(section ^ _strip(thread, 0, 0)).area() for section in sections])
        if areas.min() < _EVEN * np.median(areas):
            continue
        thread = dataclasses.replace(thread, internal=kinds[0])
        body = (body - _grooves(thread)) + _filling(sections, thread)
        found.append(thread)
    return body, found


def _candidates(mesh: trimesh.Trimesh, smooth: float) -> list[Thread]:
    """Of patches, whose faces turn by less than an angle from one to the next, that a screw motion keeps, and
    no other motion does; internal or not is not known yet."""
    pairs, angles = mesh.face_adjacency, mesh.face_adjacency_angles
    patch = components(len(mesh.faces), *pairs[angles < smooth].T)
    areas, counts = np.bincount(patch, mesh.area_faces), np.bincount(patch)
    large = np.flatnonzero((areas > _LEAST_AREA * mesh.area) & (counts >= _LEAST_FACES))
    found: list[Thread] = []
    for k in large[np.argsort(-areas[large])].tolist():
        faces = np.flatnonzero(patch == k)
        screw = _screw(mesh, faces)
        if screw is None:
            continue
        corners = mesh.vertices[np.unique(mesh.faces[faces])]
        whole = _between_ends(screw, corners)
        if not _is_like_a_thread(whole):
            continue
        leaning = _flanks(whole, mesh)
        if not len(leaning):  # waves are too flat to have any
            continue
        for flanks in _apart(whole, mesh, leaning):
            thread = _measured(whole, screw, mesh, corners, flanks)
            if thread is None or not _is_like_a_thread(thread):
                continue
            if not any(_is_same(thread, other) for other in found):
                found.append(thread)
    return found


def _is_like_a_thread(thread: Thread) -> bool:
    """Whether it goes around often enough, and is as deep and as steep as one may be."""
    depth, climb = thread.outer - thread.inner, abs(thread.pitch)
    return (
        thread.length > _TURNS * climb
        and _DEPTH[0] * thread.outer < depth < _DEPTH[1] * thread.outer
        and _CLIMB[0] * depth < climb < min(_CLIMB[1] * depth, _STEEP * thread.outer)
    )


def _apart(thread: Thread, mesh: trimesh.Trimesh, flanks: np.ndarray) -> list[np.ndarray]:
    """The flanks of each thread, where a plain piece of the rod as long as a turn lies between: those of both
    ends of a stud go over into one another along its shank."""
    heights = (mesh.triangles[flanks] - thread.axis) @ thread.direction
    order = np.argsort(heights.min(axis=1))
    lowest, highest = heights.min(axis=1)[order], np.maximum.accumulate(heights.max(axis=1)[order])
    gaps = np.flatnonzero(lowest[1:] - highest[:-1] > abs(thread.pitch)) + 1
    return [flanks[piece] for piece in np.split(order, gaps)]


def _measured(
    whole: Thread, screw: Screw, mesh: trimesh.Trimesh, corners: np.ndarray, flanks: np.ndarray
) -> Thread | None:
    """The thread of these flanks, with the radii of the patch's corners (N, 3) that lie between its ends;
    None where they do not wind."""
    own = mesh.vertices[np.unique(mesh.faces[flanks])]
    heights, along = ((points - whole.axis) @ whole.direction for points in (own, corners))
    beside = corners[(along >= heights.min() - _OVERLAP) & (along <= heights.max() + _OVERLAP)]
    thread = _between_ends(_screw(mesh, flanks) or screw, beside if len(beside) else own)
    return _winding(_as_long_as(thread, own), mesh, flanks)


def _between_ends(screw: Screw, corners: np.ndarray) -> Thread:
    """With the ends and the radii of the corners (N, 3) of a patch."""
    place, direction, climb = screw
    along = (corners - place) @ direction
    radii = np.linalg.norm(corners - place - along[:, None] * direction, axis=1)
    low, high = float(along.min()), float(along.max())
    middle = place + (low + high) / 2 * direction
    pitch = 2 * math.pi * climb
    return Thread(middle, direction, pitch, float(radii.min()), float(radii.max()), high - low, False)


def _flanks(thread: Thread, mesh: trimesh.Trimesh) -> np.ndarray:
    """All faces that its motion keeps, up to a turn further on: the other flank may begin before, and run
    into what is no thread."""
    off = mesh.triangles_center - thread.axis
    along = off @ thread.direction
    out = off - along[:, None] * thread.direction
    radius = np.linalg.norm(out, axis=1)
    velocity = np.cross(thread.direction, off) + thread.pitch / (2 * math.pi) * thread.direction
    across = np.abs((mesh.face_normals * velocity).sum(axis=1)) / np.linalg.norm(velocity, axis=1)
    leaning = np.abs((mesh.face_normals * out).sum(axis=1)) < _RADIAL * radius
    width = _BESIDE * thread.outer
    kept = leaning & (across < _KEPT) & (radius > thread.inner - width) & (radius < thread.outer + width)
    kept &= np.abs(along) < thread.length / 2 + abs(thread.pitch)
    return np.flatnonzero(kept)


def _as_long_as(thread: Thread, corners: np.ndarray) -> Thread:
    """From the first to the last of corners (N, 3)."""
    along = (corners - thread.axis) @ thread.direction
    low, high = float(along.min()), float(along.max())
    middle = thread.axis + (low + high) / 2 * thread.direction
    return dataclasses.replace(thread, axis=middle, length=high - low)


def _winding(thread: Thread, mesh: trimesh.Trimesh, flanks: np.ndarray) -> Thread | None:
    """With the pitch at which each turn lies on the one before: normals of chords tell it to a few
    hundredths, the places of many turns much better. None where flanks do not lie the further along, the
    further around they are, as those of rings do not: coarse chords of rings lean as a helix would."""
    off = mesh.triangles_center[flanks] - thread.axis
    frame = thread.frame
    angle = np.arctan2(off @ frame[:, 1], off @ frame[:, 0])
    turns = 2 * math.pi * (off @ thread.direction) / thread.pitch
    upwards = mesh.face_normals[flanks] @ thread.direction > 0
    weights = mesh.area_faces[flanks]

    def coherent(starts: int, share: float) -> float:
        waves = weights * np.exp(1j * starts * (turns / share - angle))
        return float(abs(waves[upwards].sum()) + abs(waves[~upwards].sum()))

    shares = np.linspace(1 - _UNEVEN, 1 + _UNEVEN, _PITCHES).tolist()
    for starts in range(1, _STARTS + 1):
        most, share = max((coherent(starts, share), share) for share in shares)
        if most > _COHERENT * float(weights.sum()):
            return dataclasses.replace(thread, pitch=share * thread.pitch)
    return None


def _screw(mesh: trimesh.Trimesh, faces: np.ndarray) -> Screw | None:
    """The motion that keeps faces where they are; None where there is none, or more than one."""
    points, normals, weights = mesh.triangles_center[faces], mesh.face_normals[faces], mesh.area_faces[faces]
    middle = np.average(points, axis=0, weights=weights)
    size = math.sqrt(float(np.average(((points - middle) ** 2).sum(axis=1), weights=weights)))
    x = (points - middle) / size
    kept = np.ones(len(x), bool)
    for _ in range(_ROUNDS):
        rows = np.hstack([np.cross(x[kept], normals[kept]), normals[kept]])
        moments = (rows * weights[kept, None]).T @ rows
        turning, both, shifting = moments[:3, :3], moments[:3, 3:], moments[3:, 3:]
        spread = np.linalg.eigvalsh(shifting)
        if spread[0] < _UPRIGHT * spread[2]:
            return None
        values, vectors = np.linalg.eigh(turning - both @ np.linalg.solve(shifting, both.T))
        turn = vectors[:, 0]
        shift = -np.linalg.solve(shifting, both.T @ turn)
        velocity = np.cross(turn, x) + shift
        across = np.abs((normals * velocity).sum(axis=1)) / np.linalg.norm(velocity, axis=1)
        kept = across <= np.quantile(across, _TRIMMED)
    off = math.sqrt(float(np.average(across[kept] ** 2, weights=weights[kept])))
    if off > _ACROSS or values[1] < _ONLY * values[0]:
        return None
    return np.cross(turn, shift) * size + middle, turn, float(turn @ shift) * size


def _is_same(one: Thread, other: Thread) -> bool:
    """Whether they are flanks of one thread: those of both ends of a stud lie apart."""
    apart = abs(float((one.axis - other.axis) @ other.direction))
    beside = apart < (one.length + other.length) / 2
    return beside and _is_coaxial(one, other) and abs(one.pitch - other.pitch) < _SAME * abs(other.pitch)


def _overlap(one: Thread, other: Thread) -> bool:
    """Whether they are in one place, whatever their pitches: that of more than one start is told to a few
    hundredths only."""
    apart = abs(float((one.axis - other.axis) @ other.direction))
    beside = max(one.inner, other.inner) < min(one.outer, other.outer)
    return _is_coaxial(one, other) and beside and apart < (one.length + other.length) / 2


def _is_coaxial(one: Thread, other: Thread) -> bool:
    off = one.axis - other.axis
    off = off - (off @ other.direction) * other.direction
    lean = np.linalg.norm(np.cross(one.direction, other.direction))
    return bool(np.linalg.norm(off) < _SAME * other.outer and lean * one.length < _SAME * other.outer)


def _strip(thread: Thread, within: float, beyond: float) -> CrossSection:
    """Half a section of the thread, with so many widths on the axis' side and outside, and a little at its
    ends where it has more than one."""
    width = _BESIDE * thread.outer
    half = thread.length / 2 + (_OVERLAP if max(within, beyond) > 1 else 0.0)
    low, high = thread.inner - within * width, thread.outer + beyond * width
    return CrossSection.square((high - low, 2 * half)).translate((low, -half))


def _sections(body: Manifold, thread: Thread) -> list[CrossSection]:
    """In half planes through the axis: x away from it, y along it."""
    frame = thread.frame
    result = []
    for k in range(_SECTIONS):
        angle = _OFFSET + 2 * math.pi * k / _SECTIONS
        out = math.cos(angle) * frame[:, 0] + math.sin(angle) * frame[:, 1]
        turned = np.stack([out, thread.direction, np.cross(out, thread.direction)])
        local = body.transform(np.column_stack([turned, -turned @ thread.axis]))
        result.append(local.slice(0.0) ^ _strip(thread, 3, 3))
    return result


def _is_behind(sections: Sequence[CrossSection], thread: Thread, outside: bool) -> bool:
    """Whether there is solid behind the flanks all along, on the axis' side or outside."""
    width, half = _BESIDE * thread.outer, thread.length / 2
    start = thread.outer + width if outside else thread.inner - 2 * width
    strip = CrossSection.square((width, 2 * half)).translate((start, -half))
    solid = sum(float((section ^ strip).area()) for section in sections)
    return solid > _WHOLE * len(sections) * width * thread.length


def _grooves(thread: Thread) -> Manifold:
    """All that is between its radii."""
    return _strip(thread, 1, 1).revolve(_CIRCLE).transform(thread.frame)


def _filling(sections: Sequence[CrossSection], thread: Thread) -> Manifold:
    """What its crests sweep about the axis, and a little of what is behind them."""
    strip = _strip(thread, 1, 2) if thread.internal else _strip(thread, 2, 1)
    seen = CrossSection.batch_boolean([section ^ strip for section in sections], OpType.Add)
    rounding = _ROUNDING * (thread.outer - thread.inner)  # crests are strips of chords
    return seen.simplify(rounding).revolve(_CIRCLE).transform(thread.frame)
