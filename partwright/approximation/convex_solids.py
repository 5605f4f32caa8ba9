"""A convex of quadrics as the solid that it is: planes along one axis a prism, surfaces about one axis a
turned profile.

Boxes, cylinders, cones, frusta and spheres get their names; others are extrusions or revolutions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from partwright.approximation.convex_region import ConvexRegion, Disc
from partwright.approximation.profile_parts import extruded_part, revolved_part
from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields import (
    Box,
    Cone,
    Cylinder,
    Extrusion,
    Frustum,
    NormalForm,
    Profile,
    Quadric,
    Revolution,
    Sphere,
    normal_form,
)

PARALLEL = 0.01
"""Radians: directions that differ by less are the same."""
_ON_AXIS = 5e-3  # of the size: how far from the axis a centre may lie
_SAME = 1e-5  # of the size: lengths that differ by less are equal
_CURVED = ("sphere", "cylinder", "cone")


@dataclass(frozen=True)
class Convex:
    """What is within all surfaces.

    points: (K, 3) corners of what matters: what does not end is closed off beyond them. inside: (3,) a point
    of it. size: its own longest side.
    """

    forms: tuple[NormalForm, ...]
    points: np.ndarray
    inside: np.ndarray
    size: float

    @classmethod
    def of(cls, quadrics: Sequence[Quadric], points: np.ndarray, inside: np.ndarray, size: float) -> Convex:
        return cls(tuple(normal_form(q, size, 1e-6) for q in quadrics), points, inside, size)

    @property
    def planes(self) -> tuple[np.ndarray, np.ndarray]:
        """Outward unit normals (K, 3) and offsets (K,)."""
        flat = [form for form in self.forms if form.name == "plane"]
        normals = np.array([f.axes[:, 2] * (-1 if f.complement else 1) for f in flat]).reshape(-1, 3)
        return normals, np.array([n @ f.centre for n, f in zip(normals, flat, strict=True)])

    @property
    def curved(self) -> list[NormalForm]:
        return [form for form in self.forms if form.name != "plane"]


def candidates(convex: Convex, ends: float) -> Iterator[Part]:
    """Solids that the convex may be, the plainest first; each has to be compared with it.

    ends: how far beyond its points a side is closed off that does not end.
    """
    if any(form.complement or form.name not in _CURVED for form in convex.curved):
        return
    found = [part for axis in _axes(convex) for part in _along(convex, axis, ends)]
    order = (Sphere, Box, Cylinder, Cone, Frustum, Revolution, Extrusion)
    yield from sorted(found, key=lambda part: order.index(type(part.field)))


def _along(convex: Convex, axis: np.ndarray, ends: float) -> Iterator[Part]:
    for make in (_prism, _turned):
        try:
            part = make(convex, axis, ends)
        except ParameterError:  # the surfaces leave no profile
            continue
        if part is not None:
            yield part


def _axes(convex: Convex) -> list[np.ndarray]:
    """Directions along which it may be swept: of the axes of its surfaces, and along its edges."""
    normals, _ = convex.planes
    wanted = [form.axes[:, 2] for form in convex.curved if form.name != "sphere"]
    wanted += list(normals)
    wanted += (
        [np.cross(a, b) for i, a in enumerate(normals) for b in normals[:i]] if len(normals) <= 12 else []
    )
    wanted += [np.eye(3)[2]]
    found: list[np.ndarray] = []
    for axis in wanted:
        length = float(np.linalg.norm(axis))
        if length < 10 * PARALLEL:
            continue
        axis = _snapped(axis / length)
        if all(np.linalg.norm(np.cross(axis, other)) > PARALLEL for other in found):
            found.append(axis)
    return sorted(found, key=lambda axis: -abs(axis[2]))


def _snapped(axis: np.ndarray) -> np.ndarray:
    """With its largest entry positive; a coordinate axis where it is one but for rounding."""
    largest = int(np.abs(axis).argmax())
    axis = axis * np.sign(axis[largest])
    unit = np.eye(3)[largest]
    return unit if np.abs(axis - unit).max() < 1e-6 else axis


def _frame(axis: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(3, 3) right-handed, the axis last; x along a normal that is square to it, or a coordinate axis."""
    square = [n for n in normals if abs(n @ axis) < PARALLEL]
    across = [e for e in np.eye(3) if abs(e @ axis) < 1e-6]
    aligned = [e for e in across if any(abs(e @ n) > 1 - PARALLEL**2 for n in square) or not square]
    x = (aligned or square or across or [np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])])[0]
    x = x - (x @ axis) * axis
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def _ends(convex: Convex, axis: np.ndarray, ends: float) -> tuple[float, float]:
    """From where to where it reaches along the axis, by its flat ends or by its points."""
    normals, offsets = convex.planes
    reach = convex.points @ axis
    caps = normals @ axis
    tops = [o * c for o, c in zip(offsets, caps, strict=True) if c > math.cos(PARALLEL)]
    bottoms = [o * c for o, c in zip(offsets, caps, strict=True) if c < -math.cos(PARALLEL)]
    low, high = float(reach.min()) - ends, float(reach.max()) + ends
    return max([low, *bottoms]), min([high, *tops])


def _prism(convex: Convex, axis: np.ndarray, ends: float) -> Part | None:
    """Planes along the axis, or leaning by one angle, cylinders along it, and flat ends."""
    normals, offsets = convex.planes
    if any(f.name != "cylinder" or not _parallel(f.axes[:, 2], axis) for f in convex.curved):
        return None
    lean = normals @ axis
    sides = np.abs(lean) < math.cos(PARALLEL)
    taper = float(np.median(lean[sides])) if sides.any() else 0.0
    if np.abs(lean[sides] - taper).max(initial=0.0) > PARALLEL or (abs(taper) > PARALLEL and convex.curved):
        return None
    if taper < -PARALLEL:
        return _prism(convex, -axis, ends)
    low, high = _ends(convex, axis, ends)
    if high - low <= _SAME * convex.size:
        return None
    frame = _frame(axis, normals)
    leaning = taper if taper > PARALLEL else 0.0
    flat, rise = normals[sides] @ frame[:, :2], low * leaning
    length = np.linalg.norm(flat, axis=1)
    flat, limits = flat / length[:, None], (offsets[sides] - rise) / length
    square = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], dtype=np.float64)
    reach = (convex.points @ frame[:, :2] @ square.T).max(axis=0) + ends
    discs = tuple(_disc(f, frame) for f in convex.curved)
    region = ConvexRegion(
        np.concatenate([flat, square]), np.concatenate([limits, reach]), discs, float(np.ptp(convex.points))
    )
    loop = region.loop()
    if loop is None:
        return None
    angle = math.degrees(math.asin(leaning))
    return extruded_part(Profile(loop), frame, low, high, angle)


def _parallel(a: np.ndarray, b: np.ndarray) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < PARALLEL


def _disc(form: NormalForm, frame: np.ndarray) -> Disc:
    x, y = (form.centre @ frame[:, :2]).tolist()
    return Disc(x, y, float(form.radii[0]))


def _turned(convex: Convex, axis: np.ndarray, ends: float) -> Part | None:
    """Flat ends square to the axis, and cylinders, cones and spheres about it."""
    normals, _ = convex.planes
    if not convex.curved or any(not _parallel(n, axis) for n in normals):
        return None
    centre = np.mean([form.centre for form in convex.curved], axis=0)
    foot = centre - (centre @ axis) * axis
    for form in convex.curved:
        off = form.centre - foot
        aside = float(np.linalg.norm(off - (off @ axis) * axis))
        if aside > _ON_AXIS * convex.size or (form.name != "sphere" and not _parallel(form.axes[:, 2], axis)):
            return None
    low, high = _ends(convex, axis, ends)
    across = convex.points - foot
    reach = float(np.linalg.norm(across - np.outer(across @ axis, axis), axis=1).max()) + ends
    lines = [((-1.0, 0.0), 0.0), ((0.0, -1.0), -low), ((0.0, 1.0), high), ((1.0, 0.0), reach)]
    discs = []
    for form in convex.curved:
        at = float(form.centre @ axis)
        if form.name == "sphere":
            discs.append(Disc(0.0, at, float(form.radii[0])))
        elif form.name == "cylinder":
            lines.append(((1.0, 0.0), float(form.radii[0])))
        else:
            slope = form.widening * (1.0 if convex.inside @ axis > at else -1.0)
            length = math.hypot(1.0, slope)
            lines.append(((1 / length, -slope / length), -slope * at / length))
            beyond = math.copysign(1.0, slope)  # one of its two halves
            lines.append(((0.0, -beyond), -beyond * at))
    region = ConvexRegion(
        np.array([n for n, _ in lines]),
        np.array([c for _, c in lines]),
        tuple(discs),
        float(np.ptp(convex.points)),
    )
    loop = region.loop()
    if loop is None:
        return None
    frame = _frame(axis, normals)
    return revolved_part(Profile(loop), frame, frame.T @ foot)
