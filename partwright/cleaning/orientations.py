"""Parts turn to where a person would put them: along the input's frame, along each other, at plain angles."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.assembly.euler_angles import rotation_of
from partwright.assembly.motion import signed_permutations
from partwright.assembly.similarity import rotation_matrix
from partwright.cleaning.acceptance import AcceptanceTest
from partwright.cleaning.deviation_samples import State
from partwright.cleaning.dimensions import turned_freely
from partwright.cleaning.grid import plain_rotation, rounded_rotations
from partwright.cleaning.model import Model, quaternion_of, size_of
from partwright.fields import Box, Field

Floats = NDArray[np.float64]

_NEAR = 5.0  # degrees: directions that are nearly so
_SENSIBLE, _SENSIBLE_NEAR = 15.0, 2.0  # degrees between plain directions, and how near to one
_ALIKE = 1e-6  # radians
_SAME = 1e-4  # degrees
_FINEST = 0.005  # degrees: half of the finest step
_ORDERS = range(2, 13)
_MIRROR = np.diag([1.0, -1.0, 1.0])  # every SuperFrustum is its own mirror image in y


CUBE = [matrix.T for matrix in signed_permutations() if np.linalg.det(matrix) > 0]
"""The 24 turns of a cube."""
_HALF_TURNS = {
    "box": [np.diag(s) for s in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0])],
    "half": [np.diag(s) for s in ([1, 1, 1], [-1, -1, 1.0])],
    "none": [np.eye(3)],
}


@dataclass(frozen=True)
class Frames:
    """Directions along which parts lie."""

    rotations: tuple[Floats, ...] = (np.eye(3),)
    """(3, 3) each, its columns the axes; the input's own is the first."""

    def axes(self) -> Iterator[Floats]:
        for rotation in self.rotations:
            yield from rotation.T
            yield from -rotation.T

    def directions(self) -> Iterator[tuple[Floats, bool]]:
        """All axes, none twice, and whether they are the input's own."""
        seen: list[Floats] = []
        for f, rotation in enumerate(self.rotations):
            for axis in rotation.T:
                if all(abs(axis @ other) < 1 - 1e-9 for other in seen):
                    seen.append(axis)
                    yield axis, f == 0

    def find(self, axis: Floats) -> tuple[int, int]:
        """Which frame's which axis it is."""
        return next(
            (f, k)
            for f, rotation in enumerate(self.rotations)
            for k in range(3)
            if np.array_equal(rotation[:, k], axis)
        )

    def with_rotation(self, rotation: Floats, freely: str) -> Frames:
        """With the part's own frame, unless it lies along one of these."""
        if freely == "all" or any(aligned(frame, rotation, freely) is not None for frame in self.rotations):
            return self
        return Frames((*self.rotations, rotation))


def aligned(frame: Floats, rotation: Floats, freely: str) -> NDArray[np.int64] | None:
    """(3,) the local axis that lies along each axis of the frame; None where one lies askew.

    Of an axis of revolution only its direction counts: across it, -1.
    """
    if freely == "all":
        return np.full(3, -1)
    cosines = np.abs(frame.T @ rotation)
    if freely in ("axis", "arrow"):
        along = int(cosines[:, 2].argmax())
        if cosines[along, 2] < 1 - _ALIKE:
            return None
        result = np.full(3, -1)
        result[along] = 2
        return result
    if (cosines.max(axis=1) < 1 - _ALIKE).any():
        return None
    return np.asarray(cosines.argmax(axis=1))


def turned(state: State, acceptance: AcceptanceTest) -> tuple[State, Frames]:
    """Every leaf and its copies in their places' plainest orientation that costs little enough; parts that
    own the most samples come first. The frames are those along which parts lie then."""
    frames = _known(state.model)
    size = np.bincount(state.samples.owner, minlength=len(state.model.leaves))
    for leaf in np.argsort(-size, kind="stable").tolist():
        part = state.model.leaves[leaf]
        freely = turned_freely(part.field)
        if not _plain_already(state.model, leaf, freely, frames):
            for candidate in _candidates(state, leaf, frames, acceptance):
                copies = _turned_copies(part, candidate, freely, frames)
                found = acceptance.leaf(state, leaf, state.model.with_leaf(leaf, copies), ("turn",))
                if found is not None:
                    state = found
                    break
            else:
                state = _rounded(state, acceptance, leaf, freely, frames)
        frames = frames.with_rotation(state.model.rotations[int(state.model.firsts[leaf])], freely)
    return state, frames


def _rounded(state: State, acceptance: AcceptanceTest, leaf: int, freely: str, frames: Frames) -> State:
    """At hundredths of a degree, whatever they cost: all angles are plain in the end."""
    rotation = state.model.rotations[int(state.model.firsts[leaf])]
    rotation = along(rotation[:, 2], freely) if freely in ("axis", "arrow") else rotation
    nearest = next(rounded_rotations(rotation, _FINEST))
    copies = _turned_copies(state.model.leaves[leaf], nearest, freely, frames)
    model = state.model.with_leaf(leaf, copies)
    return acceptance.without_limit().leaf(state, leaf, model, ("turn", "number")) or state


def _known(model: Model) -> Frames:
    """The input's frame, and those of parts that lie at plain angles already."""
    frames = Frames()
    for leaf, part in enumerate(model.leaves):
        rotation = model.rotations[int(model.firsts[leaf])]
        if plain_rotation(rotation):
            frames = frames.with_rotation(rotation, turned_freely(part.field))
    return frames


def _plain_already(model: Model, leaf: int, freely: str, frames: Frames) -> bool:
    """Whether the part lies plainly, and each copy as it does or as a plain isometry takes it there."""
    first, *others = model.rotations[model.leaf_of == leaf]
    if not _plain_itself(first, model.leaves[leaf].field, frames):
        return False
    images = [_moved(move, first) for move in _isometries(frames)] if others else []
    return all(min(angle(image, other, freely) for image in (first, *images)) < _SAME for other in others)


def _plain_itself(rotation: Floats, field: Field, frames: Frames) -> bool:
    freely = turned_freely(field)
    if freely == "all":
        return bool((rotation == np.eye(3)).all())
    if freely in ("axis", "arrow"):
        known = any(rotation[:, 2] @ axis > 1 - _ALIKE**2 for axis in frames.axes())
        return known or plain_rotation(along(rotation[:, 2], freely))
    if isinstance(field, Box) and aligned(np.eye(3), rotation, freely) is not None:
        return angle(rotation, np.eye(3), "box") < _SAME  # its sides in the frame's order
    lying = any(angle(frame @ turn, rotation) < _SAME for frame in frames.rotations for turn in CUBE)
    return lying or plain_rotation(rotation)


def _candidates(state: State, leaf: int, frames: Frames, acceptance: AcceptanceTest) -> Iterator[Floats]:
    """Rotations of the leaf's first copy, plainest first."""
    model = state.model
    rotation = model.rotations[int(model.firsts[leaf])]
    freely = turned_freely(model.leaves[leaf].field)
    if freely == "all":
        yield np.eye(3)
        return
    fine = np.degrees(2 * acceptance.tolerance / state.samples.scale / size_of(model.leaves[leaf]))
    if freely in ("axis", "arrow"):
        direction = rotation[:, 2]
        for axis in [*_near(direction, frames.axes(), _NEAR), *_sensible(direction)]:
            yield along(axis, freely)
        yield from (along(r[:, 2], freely) for r in rounded_rotations(along(direction, freely), fine))
        return
    for frame in frames.rotations:
        nearest = max((frame @ turn for turn in CUBE), key=lambda r: float(np.trace(r.T @ rotation)))
        if angle(nearest, rotation) < _NEAR:
            yield nearest
    for local in range(3):
        for axis in _near(rotation[:, local], frames.axes(), _NEAR):
            yield from _about(axis, local, rotation)
    yield from rounded_rotations(rotation, fine)


def _near(direction: Floats, axes: Iterator[Floats], limit: float) -> list[Floats]:
    """Axes at most `limit` degrees off, the nearest first."""
    least = np.cos(np.radians(limit))
    return sorted((a for a in axes if a @ direction > least), key=lambda a: -float(a @ direction))


def _sensible(direction: Floats) -> list[Floats]:
    """Directions in the input's planes at multiples of 15 degrees, if near."""
    steps = np.radians(np.arange(0.0, 360.0, _SENSIBLE))
    fans = [
        np.roll([np.cos(step), np.sin(step), 0.0], shift) for shift in range(3) for step in steps.tolist()
    ]
    return _near(direction, iter(fans), _SENSIBLE_NEAR)


def _about(axis: Floats, local: int, rotation: Floats) -> Iterator[Floats]:
    """Rotations with a local axis along one of the input's, at a multiple of 15 degrees about it, if near."""
    upright = _onto(rotation[:, local], axis) @ rotation
    whole = np.abs(axis).argmax()
    if abs(axis[whole]) < 1 - _ALIKE:
        return
    # Where the next local axis points, as an angle in the plane across.
    plane = [(whole + 1) % 3, (whole + 2) % 3]
    pointer = upright[plane, (local + 1) % 3]
    degrees = float(np.degrees(np.arctan2(pointer[1], pointer[0])))
    rounded = round(degrees / _SENSIBLE) * _SENSIBLE
    if abs(rounded - degrees) < _SENSIBLE_NEAR:
        back = np.zeros(3)
        back[whole] = rounded - degrees
        yield rotation_of(*back.tolist()) @ upright


def _onto(a: Floats, b: Floats) -> Floats:
    """The least turn that takes the unit vector a to b."""
    v, c = np.cross(a, b), float(a @ b)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + c))


def along(direction: Floats, freely: str) -> Floats:
    """The plain rotation that puts the local z along a direction; of a field without top or bottom, along
    the one of the two directions that looks up."""
    direction = np.where(np.abs(direction) < _ALIKE, 0.0, direction)
    if freely == "axis" and direction[np.flatnonzero(direction)[-1]] < 0:
        direction = 0.0 - direction
    tilt = float(np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), direction[2])))
    heading = float(np.degrees(np.arctan2(direction[1], direction[0])))
    tilt, heading = (round(a) if abs(a - round(a)) < _ALIKE else a for a in (tilt, heading))
    return rotation_of(0.0, tilt, heading)


def angle(a: Floats, b: Floats, freely: str = "none") -> float:
    """Degrees between two rotations of a field that may be turned freely in some ways."""
    if freely == "all":
        return 0.0
    if freely in ("axis", "arrow"):
        cosine = float(a[:, 2] @ b[:, 2])
        return float(np.degrees(np.arccos(min(1.0, abs(cosine) if freely == "axis" else cosine))))
    traces = [np.trace((a @ s).T @ b) for s in _HALF_TURNS[freely]]
    return float(np.degrees(np.arccos(np.clip((max(traces) - 1) / 2, -1.0, 1.0))))


def _turned_copies(part: Part, rotation: Floats, freely: str, frames: Frames) -> list[Part]:
    """The part's copies when its first is turned to `rotation`: each as some symmetry takes the first there.

    A box along a frame comes with its sides in the frame's order.
    """
    copies = part.copies
    before = [rotation_matrix(copy.rotation) for copy in copies]
    if isinstance(part.field, Box):
        for frame in frames.rotations:
            order = aligned(frame, rotation, freely)
            if order is not None:
                side = frame.T @ rotation  # a turn of the cube
                size = tuple(float(part.field.size[i]) for i in order)
                part = dataclasses.replace(part, field=Box((size[0], size[1], size[2])))
                before = [r @ np.rint(side).T for r in before]
                rotation = frame
                break
    moves = list(_isometries(frames))
    result: list[Part] = []
    for copy, old in zip(copies, before, strict=True):
        new = rotation if not result else _image(rotation, old, before[0], freely, moves)
        result.append(dataclasses.replace(copy, field=part.field, rotation=quaternion_of(new)))
    return result


def _image(rotation: Floats, old: Floats, first: Floats, freely: str, moves: Sequence[Floats]) -> Floats:
    """The rotation of a copy: that of the part where they were alike, else its image under a plain isometry,
    else as before against the part's."""
    if angle(rotation, old, freely) < _NEAR:
        return rotation
    images = [_moved(move, rotation) for move in moves]
    best = min(images, key=lambda image: angle(image, old, freely))
    if angle(best, old, freely) > _NEAR:
        best = old @ first.T @ rotation
    return along(best[:, 2], freely) if freely in ("axis", "arrow") else best


def _moved(move: Floats, rotation: Floats) -> Floats:
    return move @ rotation @ _MIRROR if np.linalg.det(move) < 0 else move @ rotation


def _isometries(frames: Frames) -> Iterator[Floats]:
    """Mirrors and turns about the frames' axes, linear parts alone; plainest first."""
    for frame in frames.rotations:
        for axis in range(3):
            yield frame @ np.diag([-1.0 if i == axis else 1.0 for i in range(3)]) @ frame.T
    for frame in frames.rotations:
        for order in _ORDERS:
            for k in range(1, order):
                for axis in range(3):
                    degrees = np.zeros(3)
                    degrees[axis] = 360.0 * k / order
                    yield frame @ rotation_of(*degrees.tolist()) @ frame.T
