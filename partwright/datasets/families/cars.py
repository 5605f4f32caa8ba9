"""Cars: a body whose wheel wells follow the wheels, and four wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families import car_shapes
from partwright.datasets.making import bar

if TYPE_CHECKING:
    from manifold3d import Manifold

PARTS = ("body", *car_shapes.WHEELS)


@dataclass(frozen=True)
class _Style:
    """A kind of body as shares of its length, from the nose (0) to the tail (1): where the screen starts and
    ends, where the roof ends and where the rear window does; the heights of bonnet and boot as shares of the
    height of the shoulder; the height of the roof and the length in centimetres, from and to."""

    screen: float
    roof_front: float
    roof_back: float
    window: float
    bonnet: float
    boot: float
    roof: tuple[float, float]
    length: tuple[float, float]


_STYLES = {
    "saloon": _Style(0.28, 0.42, 0.70, 0.85, 0.92, 0.98, (138, 150), (430, 500)),
    "hatchback": _Style(0.26, 0.40, 0.82, 0.97, 0.94, 1.0, (142, 156), (360, 430)),
    "estate": _Style(0.27, 0.40, 0.90, 0.985, 0.92, 1.0, (142, 155), (440, 490)),
    "coupe": _Style(0.32, 0.48, 0.62, 0.92, 0.94, 1.0, (128, 138), (410, 470)),
    "van": _Style(0.10, 0.24, 0.95, 0.99, 0.96, 1.0, (170, 205), (430, 520)),
    "pickup": _Style(0.27, 0.38, 0.56, 0.60, 0.97, 1.0, (165, 185), (480, 540)),
}


def make(rng: np.random.Generator) -> dict[str, Manifold]:
    """A car that stands on z = 0 and drives along -y, in centimetres."""
    style = _STYLES[rng.choice(list(_STYLES))]
    length = rng.uniform(*style.length)
    width = rng.uniform(165, 195)
    radius = rng.uniform(29, 34) * (1.1 if style.roof[0] > 160 else 1.0)
    broad = rng.uniform(18, 26)
    clearance = rng.uniform(0.5, 0.7) * radius
    front, back = -length * rng.uniform(0.29, 0.33), length * rng.uniform(0.26, 0.32)
    out = width / 2 - broad * rng.uniform(0.5, 0.65)

    wheel = car_shapes.wheel(rng, radius, broad, shoulder=(0.15, 0.3), rim=(0.55, 0.7))
    places = car_shapes.Places(front, back, out, mirrored="left")
    wells, wheels = car_shapes.on_axles(wheel, radius, broad, rng.uniform(1.08, 1.2), places)
    body = _body(rng, style, length, width, clearance, floor=2.25 * radius)
    for well in wells:
        body = body - well
    return {"body": body, **wheels}


def _body(
    rng: np.random.Generator, style: _Style, length: float, width: float, clearance: float, floor: float
) -> Manifold:
    """Hulls of balls, so that all edges are round: the lower body in two, and the cabin on it. A
    pickup's bed goes down to `floor`, above the wells."""
    roof = rng.uniform(*style.roof)
    shoulder = clearance + (roof - clearance) * rng.uniform(0.58, 0.64)
    bonnet, boot = shoulder * style.bonnet, shoulder * style.boot
    nose = bonnet * rng.uniform(0.78, 0.92)
    edge = rng.uniform(7, 13)
    half = width / 2
    snout, rump = half * rng.uniform(0.72, 0.88), half * rng.uniform(0.82, 0.94)

    def slab(*points: tuple[float, float, float]) -> Manifold:
        return car_shapes.slab(length, edge, clearance, points)

    screen, window = (style.screen, half, bonnet), (style.window, half, shoulder)
    flanks = [(0.1, half, 0), (0.9, half, 0)]
    front = [
        (0, snout, nose * 0.4),
        (0, snout, nose * 0.8),
        (0.05, half * 0.95, nose),
        (0.1, half, nose * 1.01),
    ]
    back = [(1, rump, boot * 0.5), (1, rump, boot * 0.92), (0.95, half * 0.97, boot), (0.86, half, boot)]
    lower = slab(*front, *flanks, screen) + slab(*back, *flanks, screen, window)
    top = half * rng.uniform(0.72, 0.82)
    foot, brow = half * 0.96, roof - rng.uniform(2, 6)
    cabin = slab(
        (style.screen, foot, bonnet),
        (style.roof_front, top, brow),
        ((style.roof_front + style.roof_back) / 2, top, roof),
        (style.roof_back, top, brow),
        (style.window, foot, shoulder),
    )
    body = lower + cabin
    if style is _STYLES["pickup"]:
        start, end = (style.window - 0.5) * length + 8, length / 2 - 9
        bed = bar(2 * rump - 18, end - start, 2 * (shoulder - floor))
        body = body - bed.translate((0, (start + end) / 2, shoulder))
    return body
