"""Cars: a body whose wheel wells follow the wheels, and four wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.making import AROUND, Point, bar, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

WHEELS = ("wheel_front_left", "wheel_front_right", "wheel_back_left", "wheel_back_right")
PARTS = ("body", *WHEELS)


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
    x = width / 2 - broad * rng.uniform(0.5, 0.65)

    wheel = _wheel(rng, radius, broad)
    axle = rod(broad, radius * 0.28).rotate((0, 90, 0)).translate((-0.95 * broad, 0, 0))
    gap = rng.uniform(1.08, 1.2)
    well = rod(200, radius * gap, radius * gap).rotate((0, 90, 0)).translate((-0.75 * broad, 0, 0))
    body = _body(rng, style, length, width, clearance, floor=2.25 * radius)
    wells, wheels = [], {}
    for name, y in zip(WHEELS, (front, front, back, back), strict=True):
        place = (x, y, radius)
        turned = [solid.translate(place) for solid in (well, wheel + axle)]
        if "left" in name:
            turned = [solid.mirror((1, 0, 0)) for solid in turned]
        wells.append(turned[0])
        wheels[name] = turned[1]
    for well in wells:
        body = body - well
    return {"body": body, **wheels}


def _wheel(rng: np.random.Generator, radius: float, broad: float) -> Manifold:
    """Around x, its outer side at x > 0: a tyre with round shoulders, a dish in it, perhaps spokes."""
    from manifold3d import CrossSection, JoinType, Manifold

    shoulder = broad * rng.uniform(0.15, 0.3)
    flat = CrossSection.square((radius - shoulder, broad - 2 * shoulder)).translate((0, shoulder - broad / 2))
    section = flat.offset(shoulder, JoinType.Round, circular_segments=16) ^ CrossSection.square(
        (radius, broad)
    ).translate((0, -broad / 2))
    tyre = Manifold.revolve(section, AROUND)
    rim, deep = radius * rng.uniform(0.55, 0.7), broad * rng.uniform(0.12, 0.3)
    dish = rod(broad, rim).translate((0, 0, broad / 2 - deep))
    hub = rod(broad / 2 - deep * 0.3, rim * 0.28)
    spokes = int(rng.choice([0, 5, 6, 8]))
    wheel = tyre - dish + hub
    for number in range(spokes):
        spoke = bar(rim * 1.02, rim * 0.24, deep * 0.8).translate((rim * 0.51, 0, broad / 2 - deep * 0.65))
        wheel = wheel + spoke.rotate((0, 0, 360 * number / spokes))
    return wheel.rotate((0, 90, 0))


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
    low = clearance + edge

    def slab(*points: tuple[float, float, float]) -> Manifold:
        """Hull of balls whose tops reach (share of the length, half width, height), on both sides."""
        places: list[Point] = []
        for share, wide, z in points:
            y = float(np.clip((share - 0.5) * length, edge - length / 2, length / 2 - edge))
            places += [(wide - edge, y, max(z - edge, low)), (edge - wide, y, max(z - edge, low))]
        return _hull(places, edge)

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


def _hull(places: list[Point], radius: float) -> Manifold:
    from manifold3d import Manifold

    ball = Manifold.sphere(radius, AROUND // 2)
    return Manifold.batch_hull([ball.translate(place) for place in places])
