"""One orientation for a part across its family.

A cuboid's axes can be named in 24 ways and a cylinder may be turned about its axis without any change of its
fit. Of all that fit as well, the naming is chosen that agrees best with the family's average: least sum of
squared angle and squared difference of the half-lengths' logarithms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from partwright.datasets.poses import mean_rotation
from partwright.datasets.primitives import CUBOID, CYLINDER, PrimitiveFit

_AS_GOOD, _SLACK = 1.25, 1e-6  # what a fit's Chamfer distance may exceed the best one's by to count as good
_WORTH = 0.8  # a cylinder is taken where its mean Chamfer distance is less than this share of the cuboid's
_REFERENCES, _ROUNDS = 24, 10

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """What the namings are compared with."""

    rotation: Array
    log_scale: Array


def _axis_namings() -> Array:
    """The 24 rotations (24, 3, 3) that map the axes onto axes."""
    matrices = [
        np.eye(3)[list(order)] * np.array(signs)
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return np.stack([m for m in matrices if np.linalg.det(m) > 0])


AXIS_NAMINGS = _axis_namings()


def namings(rotations: Array, log_scales: Array) -> tuple[Array, Array]:
    """Of boxes of rotations (F, 3, 3) and logarithms of half-lengths (F, 3) the same (F, 24, 3, 3) and
    (F, 24, 3), their axes named in every way; as they are in the first."""
    turned = rotations[:, None] @ AXIS_NAMINGS
    return turned, (np.abs(AXIS_NAMINGS).transpose(0, 2, 1) @ log_scales[:, None, :, None])[..., 0]


def agreed(shapes: Sequence[Sequence[PrimitiveFit]]) -> list[PrimitiveFit]:
    """One fit for each shape, from all fits of one part in the shapes that have it.

    All are of one kind: the cylinder where it fits clearly better on average.
    """
    kind = _kind_of(shapes)
    good = [_as_good(fits, kind) for fits in shapes]
    world = Reference(np.eye(3), np.zeros(3))
    every = max(len(good) // _REFERENCES, 1)
    starts = [_best(fits, world, turn_only=True) for fits in good[::every]]
    reference = min((_reference([fit]) for fit in starts), key=lambda r: _total(good, r))
    chosen = [_best(fits, reference) for fits in good]
    for _ in range(_ROUNDS):
        reference = _reference(chosen)
        again = [_best(fits, reference) for fits in good]
        if all(np.array_equal(a.rotation, b.rotation) for a, b in zip(chosen, again, strict=True)):
            break
        chosen = again
    return chosen


def _kind_of(shapes: Sequence[Sequence[PrimitiveFit]]) -> str:
    mean = {
        kind: np.mean([min(fit.chamfer for fit in fits if fit.kind == kind) for fits in shapes])
        for kind in (CUBOID, CYLINDER)
    }
    return CYLINDER if mean[CYLINDER] < _WORTH * mean[CUBOID] else CUBOID


def _as_good(fits: Sequence[PrimitiveFit], kind: str) -> list[PrimitiveFit]:
    own = [fit for fit in fits if fit.kind == kind]
    limit = _AS_GOOD * min(fit.chamfer for fit in own) + _SLACK
    return [fit for fit in own if fit.chamfer <= limit]


def _reference(fits: Sequence[PrimitiveFit]) -> Reference:
    from scipy.spatial.transform import Rotation

    quaternions = np.stack([Rotation.from_matrix(fit.rotation).as_quat() for fit in fits])
    x, y, z, w = mean_rotation(quaternions)
    log_scale = np.mean([np.log(fit.scale) for fit in fits], axis=0)
    return Reference(Rotation.from_quat([x, y, z, w]).as_matrix(), log_scale)


def _total(good: Sequence[Sequence[PrimitiveFit]], reference: Reference) -> float:
    return sum(float(costs(*_named(fits, reference), reference).min()) for fits in good)


def costs(rotations: Array, log_scales: Array, reference: Reference, turn_only: bool = False) -> Array:
    """(...) of rotations (..., 3, 3) and logarithms of half-lengths (..., 3): squared angles to a reference,
    and squared differences."""
    cosine = (np.sum(rotations * reference.rotation, axis=(-2, -1)) - 1) / 2
    angle = np.arccos(np.clip(cosine, -1, 1))
    apart = 0.0 if turn_only else np.sum((log_scales - reference.log_scale) ** 2, axis=-1)
    return np.asarray(angle**2 + apart)


def _best(fits: Sequence[PrimitiveFit], reference: Reference, turn_only: bool = False) -> PrimitiveFit:
    """The fit and naming nearest to the reference, or to its rotation alone."""
    rotations, log_scales = _named(fits, reference)
    best = int(costs(rotations, log_scales, reference, turn_only).argmin())
    fit = fits[best // (len(rotations) // len(fits))]
    return replace(fit, rotation=rotations[best], scale=np.exp(log_scales[best]))


def _named(fits: Sequence[PrimitiveFit], reference: Reference) -> tuple[Array, Array]:
    """Rotations (K, 3, 3) and logarithms of half-lengths (K, 3) of the same solids, axes named in every way.

    A cylinder is turned as near to the reference as may be. As many of each fit, one fit after the other.
    """
    sizes = np.log([fit.scale for fit in fits])
    if fits[0].kind == CUBOID:
        turned, named = namings(np.stack([fit.rotation for fit in fits]), sizes)
        return turned.reshape(-1, 3, 3), named.reshape(-1, 3)
    ends = [(fit.rotation[:, 2], -fit.rotation[:, 2]) for fit in fits]
    swung = [_swung(reference.rotation, axis) for pair in ends for axis in pair]
    return np.stack(swung), np.repeat(sizes, 2, axis=0)


def _swung(rotation: Array, axis: Array) -> Array:
    """`rotation`, turned the shortest way so that its z becomes `axis`."""
    from scipy.spatial.transform import Rotation

    across = np.cross(rotation[:, 2], axis)
    length = np.linalg.norm(across)
    if length < 1e-12:  # as it is, or head over heels about x
        return rotation if rotation[:, 2] @ axis > 0 else rotation * np.array([1, -1, -1])
    angle = np.arctan2(length, rotation[:, 2] @ axis)
    return Rotation.from_rotvec(across / length * angle).as_matrix() @ rotation
