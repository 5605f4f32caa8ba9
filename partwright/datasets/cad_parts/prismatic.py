"""CAD parts made of slabs and blocks: plates, brackets, housings, clevises, bearing blocks, levers."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from partwright.assembly import Node, Similarity
from partwright.datasets.cad_parts.pieces import (
    THROUGH,
    at_places,
    block,
    corners,
    fillet,
    gusset,
    hole,
    repeated,
    rod,
    rounded_plate,
    slot,
    union,
    without,
)

Rng = np.random.Generator


def plate(rng: Rng) -> Node:
    """A slab with rounded corners, holes at the corners, and a middle that varies."""
    x, y = rng.uniform(60, 160), rng.uniform(40, 110)
    z = rng.uniform(0.06, 0.16) * x
    radius = rng.choice([0.0, rng.uniform(0.05, 0.2) * min(x, y)])
    bore = rng.uniform(0.03, 0.06) * min(x, y) + 1.5
    inset = max(radius, 2.2 * bore)
    cuts: list[Node] = [at_places(hole(bore, z + THROUGH, (0, 0, z)), corners(x / 2 - inset, y / 2 - inset))]
    if rng.random() < 0.4:  # counterbores
        cuts.append(
            at_places(
                hole(1.6 * bore, 0.45 * z, (0, 0, z), name="counterbore"),
                corners(x / 2 - inset, y / 2 - inset),
            )
        )
    room = min(x, y) / 2 - inset - 2.2 * bore
    cuts += _middle(rng, room, z)
    body = rounded_plate(x, y, z, radius)
    if rng.random() < 0.3 and room > 8:
        height = rng.uniform(0.5, 1.5) * z
        body = union(body, rod(0.9 * room, height, (0, 0, z), name="boss"))
        cuts.append(hole(0.5 * room, z + height + THROUGH, (0, 0, z + height), name="bore"))
    return without(body, cuts)


def _middle(rng: Rng, room: float, z: float) -> list[Node]:
    """Nothing, a round hole, a slot, a grid of holes, or a pocket, within a distance of the origin."""
    kind = rng.choice(["nothing", "bore", "slot", "grid", "pocket"])
    if room < 8 or kind == "nothing":
        return []
    if kind == "bore":
        return [hole(rng.uniform(0.3, 0.7) * room, z + THROUGH, (0, 0, z), name="bore")]
    if kind == "slot":
        return [slot(rng.uniform(0.6, 1.2) * room, rng.uniform(0.15, 0.3) * room, z + THROUGH, (0, 0, z))]
    if kind == "pocket":
        side = rng.uniform(0.8, 1.3) * room
        return [block(side, 0.8 * side, 0.5 * z + THROUGH, (0, 0, 0.5 * z), "pocket")]
    count = int(rng.integers(2, 5))
    ticks = (np.arange(count) - (count - 1) / 2) * (1.4 * room / count)
    small = 0.4 * room / count
    places = [(float(u), float(v), 0.0) for u in ticks for v in ticks]
    return [at_places(hole(small, z + THROUGH, (0, 0, z)), places)]


def bracket(rng: Rng) -> Node:
    """Two plates at a right angle with a fillet or ribs between them, and holes in both."""
    width, foot, wall = rng.uniform(40, 100), rng.uniform(40, 90), rng.uniform(40, 100)
    thick = rng.uniform(0.08, 0.16) * max(foot, wall)
    base = block(foot, width, thick, (foot / 2, 0, 0), "foot")
    back = block(thick, width, wall, (thick / 2, 0, 0), "wall")
    parts: list[Node] = [base, back]
    reach = min(foot, wall) - thick
    if rng.random() < 0.6:
        parts.append(fillet(rng.uniform(0.1, 0.2) * reach, width, (thick, 0, thick), (1, 1)))
    if rng.random() < 0.6:
        places = [0.0] if rng.random() < 0.4 else [-0.36 * width, 0.36 * width]
        for y in places:
            rib = rng.uniform(0.1, 0.14) * width
            parts.append(
                gusset(0.75 * (foot - thick), 0.75 * (wall - thick), max(rib, 4.0), (thick, y, thick))
            )
    bore = 0.07 * min(width, reach)
    across = 0.22 * width
    cuts: list[Node] = [
        at_places(
            hole(bore, thick + THROUGH, (0.62 * foot + thick / 2, 0, thick)),
            [(0.0, -across, 0.0), (0.0, across, 0.0)],
        )
    ]
    if rng.random() < 0.5:
        cuts.append(
            at_places(
                hole(bore, thick + THROUGH, (thick, 0, 0.62 * wall + thick / 2), "x"),
                [(0.0, -across, 0.0), (0.0, across, 0.0)],
            )
        )
    else:
        cuts.append(hole(2.2 * bore, thick + THROUGH, (thick, 0, 0.7 * wall), "x", "bore"))
    return without(union(*parts), cuts)


def housing(rng: Rng) -> Node:
    """A box open on top with bosses for screws inside, and holes or feet outside."""
    x, y, z = rng.uniform(60, 140), rng.uniform(50, 110), rng.uniform(30, 80)
    wall = min(rng.uniform(0.05, 0.08) * x + 1.0, 0.16 * z, 0.1 * y)
    radius = rng.choice([0.0, 2.0 * wall])
    body: list[Node] = [rounded_plate(x, y, z, radius)]
    feet = rng.random() < 0.4
    if feet:
        reach = 6 * wall
        body.append(rounded_plate(x + 2 * reach, 0.45 * y, 1.4 * wall, 1.5 * wall))
    inner = rounded_plate(x - 2 * wall, y - 2 * wall, z, max(0.0, radius - wall), (0.0, 0.0, 1.2 * wall))
    shell = without(union(*body), [inner])
    post = 1.6 * wall
    places = corners(x / 2 - wall - 0.7 * post, y / 2 - wall - 0.7 * post)
    full: list[Node] = [shell, at_places(rod(post, z - 3 * wall, (0, 0, wall), name="post"), places)]
    cuts: list[Node] = [at_places(hole(0.45 * post, 0.5 * z, (0, 0, z - 2 * wall)), places)]
    if feet:
        cuts.append(
            at_places(
                hole(0.9 * wall, 2 * wall + THROUGH, (0, 0, 1.4 * wall)),
                [(-x / 2 - 3.4 * wall, 0, 0), (x / 2 + 3.4 * wall, 0, 0)],
            )
        )
    opening = rng.choice(["none", "round", "both"])
    if opening != "none":
        radius = rng.uniform(0.15, 0.28) * min(y, z)
        depth = x + 2 * THROUGH if opening == "both" else 2 * wall
        cuts.append(hole(radius, depth, (x / 2, 0, 0.55 * z), "x", "port"))
    return without(union(*full), cuts)


def clevis(rng: Rng) -> Node:
    """A fork: a base, two ears with round ends, and a hole for a pin through both."""
    radius = rng.uniform(12, 28)
    gap, ear = rng.uniform(0.8, 1.6) * radius, rng.uniform(0.35, 0.6) * radius
    height, base = rng.uniform(1.6, 3.0) * radius, rng.uniform(0.5, 0.9) * radius
    width = gap + 2 * ear
    length = rng.uniform(2.2, 3.5) * radius
    place = gap / 2 + ear / 2
    other = Similarity(translation=(0.0, -2 * place, 0.0))
    foot = block(length, max(width, length * rng.uniform(0.6, 1.0)), base, (0, 0, 0), "base")
    side = repeated(block(2 * radius, ear, height + base, (0, place, 0), "ear"), [other])
    end = repeated(rod(radius, ear, (0, gap / 2, height + base), "y", "ear_end"), [other])
    pin = rod(
        rng.uniform(0.35, 0.55) * radius,
        width + 2 * THROUGH,
        (0, -width / 2 - THROUGH, height + base),
        "y",
        "pin",
    )
    cuts: list[Node] = [pin]
    if rng.random() < 0.6:
        cuts.append(hole(min(0.3 * gap, 0.25 * radius), base + THROUGH, (0, 0, base)))
    return without(union(foot, side, end), cuts)


def bearing_block(rng: Rng) -> Node:
    """A round housing on a foot with a bore, and a hole in each end of the foot."""
    outer = rng.uniform(18, 40)
    bore, depth = rng.uniform(0.45, 0.7) * outer, rng.uniform(0.8, 1.8) * outer
    height, foot = rng.uniform(1.2, 1.8) * outer, rng.uniform(0.35, 0.5) * outer
    length = rng.uniform(3.6, 4.8) * outer
    lug = (length - 2 * outer) / 4
    parts: list[Node] = [
        rounded_plate(length, depth, foot, rng.choice([0.0, 0.15 * depth])),
        block(2 * outer, depth, height, (0, 0, 0), "stand"),
        rod(outer, depth, (0, -depth / 2, height), "y", "housing"),
    ]
    if rng.random() < 0.5:
        ends = fillet(0.5 * lug, 0.9 * depth, (outer, 0, foot), (1, 1))
        parts += [ends, fillet(0.5 * lug, 0.9 * depth, (-outer, 0, foot), (-1, 1))]
    through = rod(bore, depth + 2 * THROUGH, (0, -depth / 2 - THROUGH, height), "y", "bore")
    cuts: list[Node] = [through]
    if rng.random() < 0.5:
        cuts.append(rod(1.18 * bore, 0.3 * depth + THROUGH, (0, 0.2 * depth, height), "y", "seat"))
    ears = [(-outer - 1.2 * lug, 0.0, 0.0), (outer + 1.2 * lug, 0.0, 0.0)]
    cuts.append(at_places(hole(min(0.4 * lug, 0.3 * depth), foot + THROUGH, (0, 0, foot)), ears))
    return without(union(*parts), cuts)


def lever(rng: Rng) -> Node:
    """Two or three bored eyes on an arm, which may be thinner or have a long hole."""
    big, small = rng.uniform(16, 30), rng.uniform(9, 15)
    length, thick = rng.uniform(3.0, 5.5) * big, rng.uniform(0.5, 0.9) * big
    web = thick * rng.uniform(0.45, 0.8)
    parts: list[Node] = [
        rod(big, thick, (0, 0, 0), name="eye"),
        rod(small, thick, (length, 0, 0), name="eye"),
        block(length, 1.5 * small, web, (length / 2, 0, (thick - web) / 2), "arm"),
    ]
    cuts: list[Node] = [
        rod(0.55 * big, thick + 2 * THROUGH, (0, 0, -THROUGH), name="bore"),
        rod(0.5 * small, thick + 2 * THROUGH, (length, 0, -THROUGH), name="bore"),
    ]
    if rng.random() < 0.4:
        parts += [rod(small, thick, (0.0, 0.6 * length, 0.0), name="eye")]
        parts += [block(1.5 * small, 0.6 * length, web, (0, 0.3 * length, (thick - web) / 2), "arm")]
        cuts.append(rod(0.5 * small, thick + 2 * THROUGH, (0, 0.6 * length, -THROUGH), name="bore"))
    free = length - big - small
    if rng.random() < 0.5 and free > 4 * small:
        cuts.append(slot(0.5 * free, 0.35 * small, thick + THROUGH, (big + free / 2, 0, thick)))
    if rng.random() < 0.5:  # a keyway
        cuts.append(block(0.4 * big, 0.3 * big, thick + 2 * THROUGH, (0.55 * big, 0, -THROUGH), "keyway"))
    return without(union(*parts), cuts)


def ribbed_plate(rng: Rng) -> Node:
    """A plate stiffened by ribs one way or both ways, with bosses in the fields between them."""
    x, y = rng.uniform(80, 150), rng.uniform(60, 110)
    z, height = rng.uniform(0.05, 0.08) * x, rng.uniform(0.12, 0.3) * x
    rib = 0.6 * z + 1.5
    count = int(rng.integers(2, 5))
    ticks = [float(v) for v in (np.arange(count) - (count - 1) / 2) * (x - 2 * rib) / max(count - 1, 1)]
    parts: list[Node] = [block(x, y, z, (0, 0, 0), "plate")]
    parts.append(at_places(block(rib, y, height, (0, 0, 0), "rib"), [(t, 0.0, 0.0) for t in ticks]))
    if rng.random() < 0.5:
        parts.append(block(x, rib, height, (0, 0, 0), "cross_rib"))
    field = min((x - 2 * rib) / max(count - 1, 1) - rib, y / 2 - rib)
    cuts: list[Node] = []
    places = [((a + b) / 2, s * y / 4, 0.0) for a, b in pairwise(ticks) for s in (-1, 1)]
    if rng.random() < 0.5:
        parts.append(at_places(rod(0.28 * field, 0.7 * height, (0, 0, 0), name="boss"), places))
        cuts.append(at_places(hole(0.15 * field, 0.7 * height + THROUGH, (0, 0, 0.7 * height)), places))
    else:
        cuts.append(at_places(hole(0.25 * field, z + THROUGH, (0, 0, z)), places))
    return without(union(*parts), cuts)


def port_block(rng: Rng) -> Node:
    """A block with bores along two or three axes that meet inside, with wider mouths or stubs outside."""
    side = np.sort(rng.uniform(40, 90, 3))[::-1]
    x, y, z = (float(v) for v in side)
    radius = rng.uniform(0.12, 0.22) * z
    body: list[Node] = [rounded_plate(x, y, z, rng.choice([0.0, 0.12 * y]))]
    cuts: list[Node] = [hole(radius, 0.5 * x + 1.2 * radius, (x / 2, 0, z / 2), "x", "bore")]
    cuts.append(hole(rng.uniform(0.8, 1.2) * radius, 0.5 * y + radius, (0, y / 2, z / 2), "y", "bore"))
    if rng.random() < 0.6:
        cuts.append(hole(radius, 0.5 * z + radius, (0, 0, z), "z", "bore"))
    if rng.random() < 0.5:
        stub = rng.uniform(0.15, 0.4) * x
        body.append(rod(1.8 * radius, stub, (x / 2 - THROUGH, 0, z / 2), "x", "stub"))
        cuts.append(hole(radius, stub + THROUGH, (x / 2 + stub, 0, z / 2), "x", "stub_bore"))
    else:
        cuts.append(hole(1.6 * radius, 0.15 * x, (x / 2, 0, z / 2), "x", "mouth"))
    if rng.random() < 0.6:
        inset = 0.12 * y
        cuts.append(at_places(hole(0.05 * y, z + THROUGH, (0, 0, z)), corners(x / 2 - inset, y / 2 - inset)))
    return without(union(*body), cuts)


def channel(rng: Rng) -> Node:
    """A length of U-, L-, T- or I-section with rows of holes."""
    length, high, wide = rng.uniform(90, 170), rng.uniform(35, 70), rng.uniform(35, 70)
    thick = rng.uniform(0.09, 0.15) * max(high, wide)
    kind = rng.choice(["U", "T", "I", "L"])
    web = block(length, thick, high, (0, 0 if kind in "TI" else wide / 2 - thick / 2, 0), "web")
    base = block(length, wide, thick, (0, 0, 0), "base")
    parts: list[Node] = [base, web]
    if kind == "U":
        parts.append(block(length, thick, high, (0, thick / 2 - wide / 2, 0), "web"))
    if kind == "I":
        parts.append(block(length, wide, thick, (0, 0, high - thick), "lid"))
    count = int(rng.integers(2, 6))
    ticks = (np.arange(count) - (count - 1) / 2) * (0.85 * length / count)
    bore = min(0.12 * (wide - 2 * thick), 0.25 * 0.85 * length / count)
    y = wide / 4 if kind in "TI" else 0.0
    cuts: list[Node] = [
        at_places(hole(bore, thick + THROUGH, (0, y, thick)), [(float(t), 0.0, 0.0) for t in ticks])
    ]
    if rng.random() < 0.5:
        across = rod(1.2 * bore, wide + 2 * THROUGH, (0, -wide / 2 - THROUGH, 0.6 * high), "y", "side_hole")
        cuts.append(at_places(across, [(float(t), 0.0, 0.0) for t in ticks]))
    return without(union(*parts), cuts)


RECIPES = (plate, bracket, housing, clevis, bearing_block, lever, ribbed_plate, port_block, channel)
