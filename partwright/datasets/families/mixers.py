"""Static mixers: a thin tube, open at both ends, a twisted blade in it, and two points to attach it by."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.making import AROUND, bar, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

PARTS = ("tube", "helix", "attach_left", "attach_right")


def make(rng: np.random.Generator) -> dict[str, Manifold]:
    """A mixer along x, attached at its top, in centimetres."""
    length = rng.uniform(14, 26)
    radius = rng.uniform(2.2, 4.2)
    wall = radius * rng.uniform(0.05, 0.1)
    tube = _lying(_tube(rng, length, radius, wall))
    half_wall = _lying(rod(length * 2, radius - 0.5 * wall).translate((0, 0, -length)))
    helix = _lying(_helix(rng, length, radius)) ^ half_wall
    attach = _attach(rng, radius)
    place = length * rng.uniform(0.24, 0.36)
    left, right = (attach.translate((x, 0, 0)) - half_wall for x in (-place, place))
    return {"tube": tube, "helix": helix, "attach_left": left, "attach_right": right}


def _lying(solid: Manifold) -> Manifold:
    """What runs along z from its middle runs along x."""
    return solid.rotate((0, 90, 0))


def _tube(rng: np.random.Generator, length: float, radius: float, wall: float) -> Manifold:
    """Along z around the origin; perhaps with a collar at each end, or flanges."""
    body = rod(length, radius)
    style = rng.choice(["plain", "collar", "flange"], p=[0.4, 0.35, 0.25])
    if style != "plain":
        width = rng.uniform(0.5, 1.2) if style == "flange" else rng.uniform(1.0, 2.2)
        out = wall * rng.uniform(1.0, 2.0) if style == "collar" else radius * rng.uniform(0.2, 0.35)
        end = rod(width, radius + out)
        body = body + end + end.translate((0, 0, length - width))
    return (body - rod(length + 2, radius - wall).translate((0, 0, -1))).translate((0, 0, -length / 2))


def _helix(rng: np.random.Generator, length: float, radius: float) -> Manifold:
    """A blade across the tube that turns along it, perhaps with a thicker middle or a second blade across.

    Left- or right-handed, half a turn in 1.2 to 1.8 diameters, as static mixers are made; it stands upright
    halfway along, between the attach points, so that both ends of a mixer are alike.
    """
    from manifold3d import CrossSection, Manifold

    thickness = radius * rng.uniform(0.12, 0.24)
    blade = CrossSection.square((2 * radius, thickness), True)
    style = rng.choice(["ribbon", "core", "cross"], p=[0.5, 0.3, 0.2])
    if style == "core":
        blade = blade + CrossSection.circle(radius * rng.uniform(0.16, 0.3), AROUND // 2)
    if style == "cross":
        blade = blade + blade.rotate(90)
    long = length * rng.uniform(0.6, 0.95)
    turns = long / (4 * radius * rng.uniform(1.2, 1.8)) * rng.choice([-1, 1])
    steps = max(int(abs(turns) * 40), 24)
    twisted = Manifold.extrude(blade, long, steps, 360 * turns).translate((0, 0, -long / 2))
    return twisted.rotate((0, 0, -180 * turns))


def _attach(rng: np.random.Generator, radius: float) -> Manifold:
    """A lug with an eye, a threaded boss, or a block, upright on the tube's top."""
    height = radius * rng.uniform(0.5, 1.1)
    width = radius * rng.uniform(0.5, 0.9)
    top = radius + height
    style = rng.choice(["lug", "boss", "block"])
    if style == "boss":
        solid = rod(top, width * 0.75)
        cap = rod(height * 0.3, width * rng.uniform(0.85, 1.1)).translate((0, 0, top - height * 0.3))
        return solid + cap - rod(height, width * rng.uniform(0.3, 0.5)).translate((0, 0, top - height * 0.8))
    if style == "block":
        depth = radius * rng.uniform(0.7, 1.3)
        return bar(width, depth, top).translate((0, 0, top / 2))
    thick = radius * rng.uniform(0.25, 0.45)
    eye = rod(thick, width).rotate((90, 0, 0)).translate((0, thick / 2, top))
    hole = rod(3 * thick, width * rng.uniform(0.4, 0.6)).rotate((90, 0, 0)).translate((0, 1.5 * thick, top))
    return bar(2 * width, thick, top).translate((0, 0, top / 2)) + eye - hole
