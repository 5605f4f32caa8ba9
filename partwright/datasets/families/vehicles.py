"""Vehicles: cars and lorries with windows, mirrors, lights and bumpers as parts of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from partwright.datasets.families import car_shapes, vehicle_fittings
from partwright.datasets.families.vehicle_bodies import body, draw_frame

if TYPE_CHECKING:
    import numpy as np
    from manifold3d import Manifold

PARTS = ("body", *car_shapes.WHEELS, *vehicle_fittings.PARTS)


def make(rng: np.random.Generator) -> dict[str, Manifold]:
    """A vehicle that stands on z = 0 and drives along -y, in centimetres; left is the driver's, x > 0."""
    frame = draw_frame(rng)
    wheel = car_shapes.wheel(rng, frame.radius, frame.broad, shoulder=(0.1, 0.3), rim=(0.45, 0.7))
    out = frame.half - frame.broad * rng.uniform(0.4, 0.65)
    places = car_shapes.Places(frame.front, frame.back, out, mirrored="right")
    wells, wheels = car_shapes.on_axles(wheel, frame.radius, frame.broad, frame.gap, places)
    shell = body(rng, frame)
    for well in wells:
        shell = shell - well
    shell, set_in, set_on = vehicle_fittings.fitted(rng, frame, shell)
    return {**set_in, "body": shell, **wheels, **set_on}
