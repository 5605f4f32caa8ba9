"""What cars and vehicles have in common: wheels, the wells around them, and hulls whose edges are round."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from partwright.datasets.making import AROUND, Point, bar, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

WHEELS = ("wheel_front_left", "wheel_front_right", "wheel_back_left", "wheel_back_right")
Range = tuple[float, float]


class Places(NamedTuple):
    """Where wheels are: y of both axles, x of the middle of a wheel on the side x > 0, and what the wheels on
    the side x < 0, which are mirrored, have in their names."""

    front: float
    back: float
    out: float
    mirrored: str


def wheel(rng: np.random.Generator, radius: float, broad: float, shoulder: Range, rim: Range) -> Manifold:
    """Around x, its outer side at x > 0: a tyre with round shoulders (a share of its breadth), a dish in it
    (the rim, a share of its radius), perhaps spokes."""
    from manifold3d import CrossSection, JoinType, Manifold

    round_off = broad * rng.uniform(*shoulder)
    flat = CrossSection.square((radius - round_off, broad - 2 * round_off))
    section = flat.translate((0, round_off - broad / 2)).offset(
        round_off, JoinType.Round, circular_segments=16
    ) ^ CrossSection.square((radius, broad)).translate((0, -broad / 2))
    tyre = Manifold.revolve(section, AROUND)
    inner, deep = radius * rng.uniform(*rim), broad * rng.uniform(0.12, 0.3)
    dish = rod(broad, inner).translate((0, 0, broad / 2 - deep))
    hub = rod(broad / 2 - deep * 0.3, inner * 0.28)
    spokes = int(rng.choice([0, 5, 6, 8]))
    solid = tyre - dish + hub
    for number in range(spokes):
        spoke = bar(inner * 1.02, inner * 0.24, deep * 0.8)
        spoke = spoke.translate((inner * 0.51, 0, broad / 2 - deep * 0.65))
        solid = solid + spoke.rotate((0, 0, 360 * number / spokes))
    return solid.rotate((0, 90, 0))


def on_axles(
    wheel: Manifold, radius: float, broad: float, gap: float, places: Places
) -> tuple[list[Manifold], dict[str, Manifold]]:
    """The wells that a body gives way to, `gap` times as wide as the wheels, and by name the wheels, each
    with a stub of its axle that reaches the body."""
    axle = rod(broad, radius * 0.28).rotate((0, 90, 0)).translate((-0.95 * broad, 0, 0))
    well = rod(200, radius * gap).rotate((0, 90, 0)).translate((-0.75 * broad, 0, 0))
    wells, wheels = [], {}
    for name in WHEELS:
        place = (places.out, places.front if "front" in name else places.back, radius)
        # Joined anew at every place: a solid that was made elsewhere and moved has other last digits.
        turned = [solid.translate(place) for solid in (well, wheel + axle)]
        if places.mirrored in name:
            turned = [solid.mirror((1, 0, 0)) for solid in turned]
        wells.append(turned[0])
        wheels[name] = turned[1]
    return wells, wheels


def slab(length: float, edge: float, sill: float, points: tuple[tuple[float, float, float], ...]) -> Manifold:
    """Hull of balls of radius `edge`, whose tops reach (share of the length, half width, height) on both
    sides; none goes below the sill, or beyond the length."""
    from manifold3d import Manifold

    end, low = length / 2 - edge, sill + edge
    places: list[Point] = []
    for share, wide, z in points:
        y = float(np.clip((share - 0.5) * length, -end, end))
        places += [(wide - edge, y, max(z - edge, low)), (edge - wide, y, max(z - edge, low))]
    ball = Manifold.sphere(edge, AROUND // 2)
    return Manifold.batch_hull([ball.translate(place) for place in places])
