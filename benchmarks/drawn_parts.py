"""Parts as a person draws them, whose every feature and number is known: plates, flanges, housings, shafts,
mouldings.

Lengths are whole or half millimetres. A feature is one part of a tree: a body with the rims it has, holes
of one size with all their copies, a pocket. Its numbers are those that can be seen: levels of faces along the
axes, diameters, radii of corners, fillets and chamfers, drafts; where a cut ends in the open is none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Part, Similarity, ring
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cylinder, Extrusion, Frustum, Profile, Revolution, Sphere, Tube
from partwright.fields.extrusion import RIMS
from partwright.fields.profile import circle_of

Rng = np.random.Generator
Number = tuple[str, float]
ACROSS_Y = (0.5**0.5, 0.5**0.5, 0.0, 0.0)  # the solid's z along y
OVERTURNED = (0.0, 1.0, 0.0, 0.0)  # the solid's z downwards
OVER = 5.0  # beyond a face that a cut opens


@dataclass(frozen=True)
class Feature:
    """One part of a tree. unseen: its numbers that the shape does not show, such as ("z", 12)."""

    part: Part
    added: bool
    unseen: tuple[Number, ...] = ()

    @property
    def numbers(self) -> list[Number]:
        return [
            n
            for n in numbers(self.part)
            if not any(n[0] == k and abs(n[1] - v) < 1e-6 for k, v in self.unseen)
        ]


@dataclass(frozen=True)
class Drawn:
    """A part as it was drawn."""

    family: str
    features: tuple[Feature, ...]

    @property
    def assembly(self) -> Assembly:
        added = [feature.part for feature in self.features if feature.added]
        cuts = [feature.part for feature in self.features if not feature.added]
        body = added[0] if len(added) == 1 else Assembly(tuple(added))
        return Assembly((body, *cuts), "difference" if cuts else "union", unit="mm")


def numbers(part: Part) -> list[Number]:
    """What a drawing of the part, not of its copies, gives: ("x", level), ("diameter", length) and so on."""
    low, high = part.copies[0].bounds().tolist()
    found: list[Number] = [(axis, v) for i, axis in enumerate("xyz") for v in (low[i], high[i])]
    field = part.field
    if isinstance(field, Cylinder | Sphere):
        found.append(("diameter", 2 * field.radius))
    elif isinstance(field, Tube):
        found += [("diameter", 2 * field.radius), ("diameter", 2 * (field.radius - field.thickness))]
    elif isinstance(field, Frustum):
        found += [("diameter", 2 * field.bottom_radius), ("diameter", 2 * field.top_radius)]
    elif isinstance(field, Revolution):
        axis = rotation_matrix(part.rotation)[:, 2]
        k = int(np.abs(axis).argmax())
        for x, y, _ in {corner for loop in field.profile.loops for corner in loop}:
            found += [
                ("xyz"[k], part.translation[k] + float(axis[k]) * y),
                *([("diameter", 2 * x)] if x else []),
            ]
    elif isinstance(field, Extrusion):
        whole = [circle_of(loop) for loop in field.profile.loops]
        found += [("diameter", 2 * one[0]) for one in whole if one is not None]
        sides = (s for loop, one in zip(field.profile.sides, whole, strict=True) if one is None for s in loop)
        found += [("radius", side.radius) for side in sides if side.centre is not None]
        found += [(name.split("_")[1], getattr(field, name)) for name in RIMS if getattr(field, name)]
        found += [("taper", field.taper)] if field.taper else []
    return list(dict.fromkeys((kind, round(value, 6)) for kind, value in found))


def half(rng: Rng, low: float, high: float) -> float:
    """A multiple of half a millimetre."""
    return float(rng.integers(round(2 * low), round(2 * high) + 1)) / 2


def drilled(
    diameter: float, top: float, depth: float, at: tuple[float, float], moves: tuple[Similarity, ...]
) -> Feature:
    """Holes from a face at the height `top` down, through where the depth is 0 (the part stands on z = 0)."""
    low = -OVER if depth == 0 else top - depth
    field = Cylinder(diameter / 2, top + OVER - low)
    part = Part(field, (*at, (top + OVER + low) / 2), name="hole", instances=moves)
    unseen = (("z", top + OVER), *((("z", low),) if depth == 0 else ()))
    return Feature(part, False, unseen)


def corners_of(x: float, y: float) -> tuple[Similarity, ...]:
    """From (x, y) to the other three corners."""
    return tuple(
        Similarity(translation=(dx, dy, 0.0)) for dx, dy in ((-2 * x, 0.0), (-2 * x, -2 * y), (0.0, -2 * y))
    )


def plate(rng: Rng) -> Drawn:
    """Rounded corners, a rim or none, four bolt holes, and a bore, a pocket or a slot in the middle."""
    x, y, z = half(rng, 70, 140), half(rng, 50, 90), half(rng, 8, 16)
    corner = half(rng, 8, 14)
    rims = [
        {},
        {"top_fillet": half(rng, 1.5, 3)},
        {"top_chamfer": half(rng, 1, 2.5)},
        {"top_fillet": 2.0, "bottom_chamfer": 1.0},
    ]
    body = Extrusion(Profile.rectangle(x, y, corner), z, **rims[rng.integers(4)])
    bolt = half(rng, 4, 7)
    place = (x / 2 - corner - 1, y / 2 - corner - 1)
    features = [
        Feature(Part(body, (0, 0, z / 2), name="plate"), True),
        drilled(bolt, z, 0, place, corners_of(*place)),
    ]
    middle = rng.integers(3)
    if middle == 0:
        features.append(drilled(half(rng, 12, 20), z, 0, (0, 0), ()))
    else:
        depth = half(rng, 3, z - 3) if middle == 1 else z + OVER
        opening = Profile.rectangle(half(rng, 24, 34), 16.0, 4.0 if middle == 1 else 8.0)
        cut = Part(Extrusion(opening, depth + OVER), (0, 0, z + OVER - (depth + OVER) / 2), name="opening")
        open_ends = [("z", z + OVER), *([("z", z - depth)] if middle == 2 else [])]
        features.append(Feature(cut, False, tuple(open_ends)))
    return Drawn("plate", tuple(features))


def flange(rng: Rng) -> Drawn:
    """A disc with a hub and a bore, turned in one, and holes around it."""
    bore, wall, reach = half(rng, 6, 12), half(rng, 4, 8), half(rng, 18, 30)
    thick, tall = half(rng, 6, 12), half(rng, 10, 30)
    hub, outer = bore + wall, bore + wall + reach
    outline = [(bore, 0), (outer, 0), (outer, thick), (hub, thick), (hub, thick + tall), (bore, thick + tall)]
    count, bolt = int(rng.integers(3, 9)), half(rng, 5, 8)
    body = Part(Revolution(Profile(outline)), name="flange")
    sides = tuple(("xy"[k], s * outer) for k in (0, 1) for s in (-1, 1))
    holes = drilled(bolt, thick, 0, (hub + reach / 2, 0), ring(count))
    return Drawn("flange", (Feature(body, True, sides), holes))


def housing(rng: Rng) -> Drawn:
    """A box with rounded edges, hollow from above, with holes in its floor and one in a wall."""
    x, y, z = half(rng, 70, 120), half(rng, 50, 80), half(rng, 30, 50)
    wall, floor, corner = half(rng, 4, 8), half(rng, 4, 9), half(rng, 9, 14)
    inside = Profile.rectangle(x - 2 * wall, y - 2 * wall, corner - wall)
    cavity = Part(Extrusion(inside, z - floor + OVER), (0, 0, (z + OVER + floor) / 2), name="cavity")
    place = (x / 2 - wall - 10, y / 2 - wall - 8)
    feet = drilled(half(rng, 4, 7), floor, 0, place, corners_of(*place))
    port = Part(
        Cylinder(half(rng, 5, 8), wall + 2 * OVER),
        (0, y / 2 - wall / 2, (z + floor) / 2),
        ACROSS_Y,
        name="port",
    )
    open_port = tuple(("y", y / 2 - wall / 2 + s * (wall / 2 + OVER)) for s in (-1, 1))
    body = Part(Extrusion(Profile.rectangle(x, y, corner), z), (0, 0, z / 2), name="housing")
    return Drawn(
        "housing",
        (
            Feature(body, True),
            Feature(cavity, False, (("z", z + OVER),)),
            feet,
            Feature(port, False, open_port),
        ),
    )


def shaft(rng: Rng) -> Drawn:
    """Three to five steps with a chamfer at one end, a keyway, and a hole across."""
    count = int(rng.integers(3, 6))
    radii = 1.5 * rng.permutation(np.arange(6, 16))[:count]
    lengths = [half(rng, 20, 40) for _ in range(count)]
    levels = np.concatenate([[0.0], np.cumsum(lengths)])
    chamfer = half(rng, 1, 2)
    outline: list[tuple[float, float]] = [(0.0, 0.0), (radii[0] - chamfer, 0.0), (radii[0], chamfer)]
    for i, radius in enumerate(radii):
        outline += [(radius, levels[i])] if i else []
        outline.append((radius, levels[i + 1]))
    body = Part(Revolution(Profile([*outline, (0.0, levels[-1])])), name="shaft")
    widest = int(np.argmax(radii))
    radius, middle = float(radii[widest]), float(levels[widest] + levels[widest + 1]) / 2
    width, length, depth = half(rng, 4, 6), half(rng, 10, 15), half(rng, 3, 4)
    key = Part(
        Box((width, depth + OVER, length)), (0, radius - depth + (depth + OVER) / 2, middle), name="keyway"
    )
    sides = tuple(("xy"[k], s * radius) for k in (0, 1) for s in (-1, 1))
    features = [Feature(body, True, sides), Feature(key, False, (("y", radius + OVER),))]
    across = int(np.argmin(radii))
    if across != widest:
        own, at = float(radii[across]), float(levels[across] + levels[across + 1]) / 2
        pin = Part(Cylinder(half(rng, 2, 3), 2 * own + 2 * OVER), (0, 0, at), ACROSS_Y, name="pin_hole")
        features.append(Feature(pin, False, tuple(("y", s * (own + OVER)) for s in (-1, 1))))
    return Drawn("shaft", tuple(features))


def moulding(rng: Rng) -> Drawn:
    """A block whose walls lean, hollow from below as a cap, or from above; then it stands on a plate with
    four holes. There may be a hole through its floor."""
    x, y, z = half(rng, 50, 90), half(rng, 36, 60), half(rng, 18, 30)
    wall, floor, corner = half(rng, 4, 6), half(rng, 3, 6), half(rng, 7, 10)
    draft, core, is_cap = half(rng, 1, 4), half(rng, 0.5, 2), bool(rng.integers(2))
    thick, rim = (0.0, 0.0) if is_cap else (half(rng, 4, 6), half(rng, 10, 14))
    top = thick + z
    block = Extrusion(Profile.rectangle(x, y, corner), z, taper=draft)
    features = [Feature(Part(block, (0, 0, thick + z / 2), name="block"), True)]
    if not is_cap:
        plate = Extrusion(Profile.rectangle(x + 2 * rim, y + 2 * rim, corner), thick)
        place = (x / 2 + rim / 2, y / 2 + rim / 2)
        features += [
            Feature(Part(plate, (0, 0, thick / 2), name="plate"), True),
            drilled(half(rng, 4, 6), thick, 0, place, corners_of(*place)),
        ]
    lost = 0.0 if is_cap else z * np.tan(np.radians(draft))  # of the wall, up to where the pocket opens
    around = wall + np.ceil(2 * lost) / 2
    cavity = Extrusion(Profile.rectangle(x - 2 * around, y - 2 * around, 3.0), z - floor, taper=core)
    mouth, middle = (0.0, (z - floor) / 2) if is_cap else (top, top - (z - floor) / 2)
    turn = (1.0, 0.0, 0.0, 0.0) if is_cap else OVERTURNED
    features.append(Feature(Part(cavity, (0, 0, middle), turn, name="pocket"), False, (("z", mouth),)))
    if rng.integers(2):
        features.append(drilled(half(rng, 5, 10), top, 0, (0, 0), ()))
    return Drawn("moulding", tuple(features))


FAMILIES: tuple[Callable[[Rng], Drawn], ...] = (plate, flange, housing, shaft)


def drawn_moulding(number: int) -> Drawn:
    """The moulding of that number, always the same; they have numbers of their own."""
    return moulding(np.random.default_rng([number, 18, 1]))


def drawn_part(number: int) -> Drawn:
    """The part of that number, always the same; families take turns, all but mouldings."""
    return FAMILIES[number % len(FAMILIES)](np.random.default_rng([number, 18]))
