"""Armchairs, couches and sofas: a base with cushions, a thick back, thick closed arms, short legs or none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.making import bar, pebble, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

_NO_ARMS, _NO_LEGS = 0.12, 0.5
_SEAM = 0.5  # cm of a cushion that lies in the next thing to it


def couch(rng: np.random.Generator) -> dict[str, Manifold]:
    """Stands on z = 0 and looks along -y, in centimetres; named as the parts of a chair."""
    places = int(rng.choice([1, 2, 3], p=[0.5, 0.3, 0.2]))
    width = places * rng.uniform(50, 66)  # between the arms
    depth, top = rng.uniform(48, 68), rng.uniform(32, 46)
    legs = rng.random() >= _NO_LEGS
    low = rng.uniform(5, 16) if legs else 0.0
    thick = rng.uniform(12, 24)  # of the back
    height = top + rng.uniform(24, 52)
    arms = rng.random() >= _NO_ARMS
    broad = rng.uniform(9, 26)
    parts = {"seat": _seat(rng, places, width, depth, low, top)}
    parts["back"] = _back(rng, places, width, depth, low, top, height, thick, arms, broad)
    if arms:
        high = rng.uniform(top + 6, min(height, top + 30))
        front = -depth / 2 - rng.choice([0.0, rng.uniform(-6, 6)])
        arm = _arm(rng, broad, front, depth / 2 + thick * rng.uniform(0.3, 1.0), low, high)
        parts["arm_left"] = arm.translate((width / 2 - _SEAM + broad / 2, 0, 0))
        parts["arm_right"] = parts["arm_left"].mirror((1, 0, 0))
    if legs:
        parts |= _legs(rng, width, depth, low)
    return parts


def _seat(
    rng: np.random.Generator, places: int, width: float, depth: float, low: float, top: float
) -> Manifold:
    """A base with a cushion a place, or one for all, on it."""
    cushion = rng.uniform(0.3, 0.6) * (top - low)
    seam = top - cushion
    base = pebble(width, depth, seam - low + 2 * _SEAM, rng.uniform(0.5, 3))
    base = base.translate((0, 0, (seam + low) / 2 + _SEAM))
    count = places if rng.random() < 0.6 else 1
    out = rng.uniform(0, 3)
    one = pebble(width / count + _SEAM, depth + out, cushion + _SEAM, rng.uniform(0.1, 0.4) * cushion)
    for x in (np.arange(count) - (count - 1) / 2) * width / count:
        base = base + one.translate((x, -out / 2, top - (cushion + _SEAM) / 2))
    return base


def _back(
    rng: np.random.Generator,
    places: int,
    width: float,
    depth: float,
    low: float,
    top: float,
    height: float,
    thick: float,
    arms: bool,
    broad: float,
) -> Manifold:
    """A slab behind the seat, between the arms or behind them too, perhaps with cushions before it."""
    wide = width + (2 * broad * rng.uniform(0, 1) if arms else 0.0)
    edge = rng.uniform(0.1, 0.45) * thick
    slab = pebble(wide, thick, height - low, edge).translate((0, thick / 2, (height - low) / 2))
    lean = rng.uniform(0, 14)
    if rng.random() < 0.5:
        count, fat = places if rng.random() < 0.7 else 1, rng.uniform(8, 16)
        tall = (height - top) * rng.uniform(0.75, 1.1)
        cushion = pebble(width / count + _SEAM, fat, tall, 0.35 * fat)
        for x in (np.arange(count) - (count - 1) / 2) * width / count:
            slab = slab + cushion.translate((x, -fat * 0.3, top - low + tall / 2 - 1))
    slab = slab.translate((0, 0, low - top)).rotate((-lean, 0, 0)).translate((0, depth / 2 - _SEAM, top))
    return slab.trim_by_plane((0, 0, 1), low)


def _arm(
    rng: np.random.Generator, broad: float, front: float, behind: float, low: float, high: float
) -> Manifold:
    """Around x = 0: a block with more or less round edges, or one with a roll on it."""
    from manifold3d import Manifold

    long, tall = behind - front, high - low
    if rng.random() < 0.25:
        roll = rod(long, broad * 0.5).rotate((90, 0, 0)).translate((0, long / 2, tall / 2 - broad * 0.5))
        arm = bar(broad * 0.85, long - 2, tall - broad * 0.5).translate((0, 0, -broad * 0.25)) + roll
    else:
        arm = pebble(broad, long, tall, rng.uniform(0.08, 0.48) * broad)
        if rng.random() < 0.3:  # its top falls to the front
            slope = rng.uniform(2, 9)
            wedge = bar(broad + 2, 2 * long, tall).translate((0, 0, tall / 2))
            arm = arm - wedge.rotate((slope, 0, 0)).translate(
                (0, 0, tall / 2 - 0.5 * long * np.tan(np.radians(slope)))
            )
    assert isinstance(arm, Manifold)
    return arm.translate((0, (front + behind) / 2, (low + high) / 2))


def _legs(rng: np.random.Generator, width: float, depth: float, low: float) -> dict[str, Manifold]:
    """Short blocks or round feet under the seat."""
    side = rng.uniform(4, 9)
    tall = low + 4
    leg = (
        bar(side, side, tall)
        if rng.random() < 0.5
        else rod(tall, side * 0.35, side * 0.5).translate((0, 0, -tall / 2))
    )
    inset = side / 2 + rng.uniform(1.5, 6)
    leg = leg.translate((width / 2 - inset, -depth / 2 + inset, tall / 2))
    back, across = leg.mirror((0, 1, 0)), (1, 0, 0)
    return {
        "leg_front_left": leg,
        "leg_front_right": leg.mirror(across),
        "leg_back_left": back,
        "leg_back_right": back.mirror(across),
    }
