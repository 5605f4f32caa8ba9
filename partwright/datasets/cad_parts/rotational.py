"""CAD parts made about an axis: flanges, shafts, wheels, nuts, nozzles, domes."""

from __future__ import annotations

import math

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.datasets.cad_parts.pieces import (
    THROUGH,
    around,
    block,
    chamfered,
    cone,
    hole,
    placed,
    rod,
    union,
    without,
)
from partwright.fields import Quadric, Torus

Rng = np.random.Generator


def flange(rng: Rng) -> Node:
    """A disc with a bolt circle, a hub that may taper, and a bore."""
    outer = rng.uniform(40, 80)
    bore, thick = rng.uniform(0.2, 0.4) * outer, rng.uniform(0.12, 0.25) * outer
    hub, height = bore + rng.uniform(0.12, 0.22) * outer, rng.uniform(0.2, 0.8) * outer
    parts: list[Node] = [rod(outer, thick, (0, 0, 0), name="disc")]
    if rng.random() < 0.5:
        parts.append(cone(hub * 1.15, hub * 0.95, height, (0, 0, thick), name="hub"))
    else:
        parts.append(rod(hub, height, (0, 0, thick), name="hub"))
    through = thick + height + 2 * THROUGH
    cuts: list[Node] = [rod(bore, through, (0, 0, -THROUGH), name="bore")]
    middle = (outer + 1.15 * hub) / 2
    bolt = rng.uniform(0.16, 0.26) * (outer - 1.15 * hub)
    count = int(rng.choice([3, 4, 6, 8]))
    cuts.append(around(hole(bolt, thick + THROUGH, (middle, 0, thick), name="bolt_hole"), count))
    if rng.random() < 0.4:
        cuts.append(rod(1.25 * bore, 0.4 * thick, (0, 0, -0.15 * thick), name="recess"))
    if rng.random() < 0.4:
        width = 0.4 * bore
        cuts.append(block(width, width, through, (bore, 0, -THROUGH), "keyway"))
    if rng.random() < 0.3:
        parts.append(rod(middle - 1.6 * bolt, 0.25 * thick, (0, 0, -0.2 * thick), name="raised_face"))
        cuts[0] = rod(bore, through + thick, (0, 0, -0.5 * thick), name="bore")
    return without(union(*parts), cuts)


def shaft(rng: Rng) -> Node:
    """A stack of cylinders along x with chamfered ends, keyways, grooves, flats and bores."""
    count = int(rng.integers(2, 6))
    radii = rng.uniform(10, 26, count)
    lengths = rng.uniform(15, 50, count)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    steps: list[Node] = []
    for i in range(count):
        first, last = i == 0, i == count - 1
        step = rod(radii[i], lengths[i] + (0.0 if last else THROUGH), (starts[i], 0, 0), "x", "step")
        if first or last:
            end, outward = (0.0, -1.0) if first else (starts[-1], 1.0)
            steps.append(chamfered(step, rng.uniform(0.8, 0.9) * radii[i], (end, 0, 0), outward))
        else:
            steps.append(step)
    cuts: list[Node] = []
    chosen = int(rng.integers(count))
    middle, r = (starts[chosen] + starts[chosen + 1]) / 2, radii[chosen]
    kind = rng.choice(["nothing", "keyway", "groove", "flat", "cross"])
    if kind == "keyway":
        cuts.append(block(0.6 * lengths[chosen], 0.5 * r, r, (middle, 0, 0.7 * r), "keyway"))
    elif kind == "flat":
        cuts.append(block(0.8 * lengths[chosen], 3 * r, r, (middle, 0, 0.65 * r), "flat"))
    elif kind == "cross":
        cuts.append(rod(0.3 * r, 4 * r, (middle, 0, -2 * r), name="cross_hole"))
    elif kind == "groove":
        width = 0.25 * lengths[chosen]
        ring = rod(1.5 * r, width, (middle - width / 2, 0, 0), "x", "groove")
        core = rod(0.8 * r, width + 2 * THROUGH, (middle - width / 2 - THROUGH, 0, 0), "x", "groove_floor")
        cuts.append(Assembly((ring, core), "difference"))
    if rng.random() < 0.3:
        bore = 0.45 * float(radii.min())
        cuts.append(rod(bore, starts[-1] + 60, (-30.0, 0, 0), "x", "bore"))
    return without(union(*steps), cuts)


def wheel(rng: Rng) -> Node:
    """A rim, a web with round holes or spokes, a hub with a bore and perhaps a keyway."""
    outer = rng.uniform(45, 90)
    width, rim = rng.uniform(0.2, 0.45) * outer, rng.uniform(0.1, 0.16) * outer
    hub, bore = rng.uniform(0.24, 0.32) * outer, rng.uniform(0.1, 0.15) * outer
    web, long = rng.uniform(0.25, 0.5) * width, rng.uniform(1.0, 1.4) * width
    ring = without(
        rod(outer, width, (0, 0, -width / 2), name="rim"),
        [rod(outer - rim, width + 2 * THROUGH, (0, 0, -width / 2 - THROUGH), name="inside")],
    )
    parts: list[Node] = [ring, rod(hub, long, (0, 0, -long / 2), name="hub")]
    cuts: list[Node] = [rod(bore, long + 2 * THROUGH, (0, 0, -long / 2 - THROUGH), name="bore")]
    middle, count = (outer - rim + hub) / 2, int(rng.choice([3, 4, 5, 6]))
    if rng.random() < 0.5:
        parts.append(rod(outer - rim / 2, web, (0, 0, -web / 2), name="web"))
        light = 0.36 * (outer - rim - hub)
        light = min(light, 0.75 * middle * math.sin(math.pi / count))
        cuts.append(around(rod(light, web + 2, (middle, 0, -web / 2 - 1), name="light_hole"), count))
    else:
        reach = outer - rim / 2
        arm = max(0.35 * hub, 4.0)
        parts.append(around(block(reach, arm, web, (reach / 2, 0, -web / 2), "spoke"), count))
    if rng.random() < 0.4:
        key = 0.7 * bore
        cuts.append(block(key, key, long + 2 * THROUGH, (bore, 0, -long / 2 - THROUGH), "keyway"))
    if rng.random() < 0.4:  # a groove for a belt or a ring
        profile = Torus(outer, 0.3 * width if 0.3 * width < 0.6 * rim else 0.6 * rim)
        cuts.append(placed(profile, (0, 0, 0), name="groove"))
    return without(union(*parts), cuts)


def nut(rng: Rng) -> Node:
    """A prism of 4 to 8 sides with a bore, perhaps with a collar or with its corners turned off by a cone."""
    sides = int(rng.choice([4, 5, 6, 8]))
    inner = rng.uniform(18, 40)
    height = rng.uniform(0.6, 2.0) * inner
    turns = [2 * math.pi * i / sides for i in range(sides)]
    faces: list[Node] = [
        Part(Quadric.plane((math.cos(t), math.sin(t), 0.0), inner), name="side") for t in turns
    ]
    corner = inner / math.cos(math.pi / sides)
    core = rod(1.1 * corner, height, (0, 0, 0), name="core")
    if rng.random() < 0.6:
        slope = rng.uniform(1.2, 2.0)
        apex = height + (corner - 0.25 * (corner - inner)) / slope
        faces.append(Part(Quadric.cone(slope, apex=(0.0, 0.0, apex)), name="turned_off"))
    parts: list[Node] = [Assembly((core, *faces), "intersection", name="prism")]
    bottom = 0.0
    if rng.random() < 0.5:
        collar = rng.uniform(0.12, 0.25) * inner
        parts.append(rod(1.25 * corner, collar, (0, 0, -collar + THROUGH / 2), name="collar"))
        bottom = -collar
    bore = rng.uniform(0.4, 0.65) * inner
    cuts: list[Node] = [rod(bore, height - bottom + 4, (0, 0, bottom - 2), name="bore")]
    if rng.random() < 0.5:
        cuts.append(
            cone(bore * 0.95, bore + 0.2 * inner, 0.2 * inner, (0, 0, height - 0.18 * inner), name="sink")
        )
    return without(union(*parts), cuts)


def nozzle(rng: Rng) -> Node:
    """A hollow stack of cones and cylinders, with a collar, and perhaps side ports."""
    wide, narrow = rng.uniform(25, 45), rng.uniform(10, 18)
    wall = rng.uniform(0.12, 0.2) * wide
    lower, taper, tip = (
        rng.uniform(0.4, 1.2) * wide,
        rng.uniform(0.6, 1.6) * wide,
        rng.uniform(0.5, 1.2) * wide,
    )
    parts: list[Node] = [
        rod(wide, lower, (0, 0, 0), name="foot"),
        cone(wide, narrow + wall, taper, (0, 0, lower), name="taper"),
        rod(narrow + wall, tip, (0, 0, lower + taper), name="tip"),
    ]
    bores: list[Node] = [
        rod(wide - wall, lower + THROUGH, (0, 0, -THROUGH), name="foot_bore"),
        cone(wide - wall, narrow, taper, (0, 0, lower - 0.01), name="taper_bore"),
        rod(narrow, tip + 2 * THROUGH + 1, (0, 0, lower + taper - 1), name="tip_bore"),
    ]
    cuts: list[Node] = [union(*bores)]
    if rng.random() < 0.6:
        collar, thick = wide + rng.uniform(0.3, 0.6) * wide, rng.uniform(0.15, 0.3) * wide
        parts.append(rod(collar, thick, (0, 0, 0), name="collar"))
        bolt = 0.22 * (collar - wide)
        ring = hole(bolt, thick + THROUGH, ((collar + wide) / 2, 0, thick), name="bolt_hole")
        cuts.append(around(ring, int(rng.choice([4, 6, 8]))))
    if rng.random() < 0.4:
        port = rod(0.2 * lower, 2 * wide, (0, 0, 0.65 * lower), "x", "port")
        cuts.append(around(port, int(rng.choice([2, 3, 4]))))
    return without(union(*parts), cuts)


def dome(rng: Rng) -> Node:
    """A ball, or an ellipsoid, cut flat below, on a disc or a stem, solid or a shell."""
    radius = rng.uniform(20, 40)
    rise = radius * rng.choice([1.0, rng.uniform(0.5, 1.6)])
    foot = rng.uniform(0.15, 0.4) * radius
    ground = Part(Quadric.plane((0.0, 0.0, -1.0), 0.5 * foot), name="ground")
    cap = Assembly((Part(Quadric.ellipsoid((radius, radius, rise)), name="cap"), ground), "intersection")
    shell = rng.random() < 0.5
    wall = rng.uniform(0.12, 0.2) * radius
    rim = radius * rng.uniform(1.0, 1.5)
    parts: list[Node] = [cap, rod(rim, foot, (0, 0, -foot), name="foot")]
    cuts: list[Node] = []
    if shell:
        inner = Part(Quadric.ellipsoid((radius - wall, radius - wall, rise - wall)), name="cavity")
        cuts += [inner, rod(radius - wall, foot + THROUGH, (0, 0, -foot - THROUGH), name="cavity_foot")]
    if rng.random() < 0.6:
        cuts.append(rod(0.25 * radius, rise + foot + 2, (0, 0, -foot - 1), name="bore"))
    elif not shell:
        parts.append(rod(0.4 * radius, 1.5 * radius, (0, 0, -foot - 1.5 * radius + THROUGH), name="stem"))
    if rim > 1.3 * radius:
        bolt = 0.25 * (rim - radius)
        cuts.append(
            around(
                hole(bolt, foot + THROUGH, ((rim + radius) / 2, 0, 0), name="bolt_hole"),
                int(rng.integers(3, 7)),
            )
        )
    return without(union(*parts), cuts)


RECIPES = (flange, shaft, wheel, nut, nozzle, dome)
