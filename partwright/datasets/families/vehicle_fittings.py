"""What is set into or onto a vehicle's body, cut where it sits: windows, lights, bumpers and mirrors.

Windows and lights follow the surface that they sit in: between two copies of the body, one moved further in
than the other, lies the slab that a region of the surface cuts out. All of them lie a little below or above
the body, so that the whole vehicle's surface shows where they end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families.vehicle_bodies import Frame, cabin
from partwright.datasets.making import bar, pebble

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

PARTS = (
    *("windscreen", "window_back", "windows_left", "windows_right"),
    *("mirror_left", "mirror_right"),
    *("lights_front", "lights_back"),
    *("bumper_front", "bumper_back"),
)
# Shares of vehicles that lack them: a model then learns what may be missing.
_PLAIN, _NO_WINDOWS, _NO_BACK_WINDOW = 0.05, 0.06, 0.12
_NO_MIRRORS, _NO_LIGHTS, _NO_BUMPER = 0.15, 0.1, 0.1
_CLOSED = {"van": 0.5, "milk": 0.75}  # shares without windows behind the doors
_GLASS = 3.5  # cm
_GAP = 0.4  # cm between an inset part and its opening, and its floor: no two faces lie upon one another
_LEAST_PANE, _LEAST_WINDOW = 120.0, 400.0  # cm2
_FAR = 400.0  # cm, beyond any vehicle's side

Solids = dict[str, "Manifold"]


def fitted(rng: np.random.Generator, frame: Frame, body: Manifold) -> tuple[Manifold, Solids, Solids]:
    """The body cut for windows and lights; what else it gives way to, and what gives way to it."""
    if rng.random() < _PLAIN:
        return body, {}, {}
    bumpers, over = {}, {}
    for name, low in (("front", frame.nose), ("back", frame.boot)):
        solid, top = _bumper(rng, frame, name, low)
        over[name] = top
        if rng.random() >= _NO_BUMPER:
            bumpers[f"bumper_{name}"] = solid
    insets = []
    for name in ("front", "back"):
        regions = _light(rng, frame, name, over[name])
        if regions is not None and rng.random() >= _NO_LIGHTS:
            insets.append(_light_in(rng, body, name, regions))
    if rng.random() >= _NO_WINDOWS:
        insets += _windows(rng, frame)
    for _, _, cut in insets:
        body = body - cut
    mirrors = _mirrors(rng, frame) if rng.random() >= _NO_MIRRORS else {}
    return body, bumpers | {name: solid for name, solid, _ in insets}, mirrors


def _windows(rng: np.random.Generator, frame: Frame) -> list[tuple[str, Manifold, Manifold]]:
    """Name, glass, and what it takes from the body."""
    glazed, recess = cabin(frame), rng.uniform(1.0, 1.8)
    side = rng.uniform(4, 9) + 0.3 * frame.edge
    deep = recess + _GLASS
    found = []

    def add(name: str, opening: Manifold, pane: Manifold, inward: np.ndarray) -> None:
        outer, floor, inner = (
            glazed.translate(tuple(inward * depth)) for depth in (recess, recess + _GAP, recess + _GLASS)
        )
        found.append((name, (pane ^ outer) - inner, opening - floor))

    front = _Slope(frame, frame.screen, frame.roof_front, frame.bonnet)
    pane = _pane(rng, frame, front, side)
    if pane is not None:
        end = frame.along(frame.roof_front) + 2 * deep + 10
        opening, inset = (_across(p, _FAR).translate((0, end, 0)) for p in (pane, pane.offset(-_GAP)))
        add("windscreen", opening, inset, front.inward)
    back = _Slope(frame, frame.window, frame.roof_back, frame.shoulder)
    closed = rng.random() < _CLOSED.get(frame.style, 0.0)
    lacks = 0.6 if closed else _NO_BACK_WINDOW
    pane = _pane(rng, frame, back, side)
    if pane is not None and frame.style != "lorry" and rng.random() >= lacks:
        start = frame.along(frame.roof_back) - 2 * deep - 10
        opening, inset = (
            _across(p, _FAR).translate((0, start + _FAR, 0)) for p in (pane, pane.offset(-_GAP))
        )
        add("window_back", opening, inset, back.inward)
    panes = _side_panes(rng, frame, side, closed)
    if panes is not None:
        inward = -np.array((frame.brow - frame.shoulder, 0, frame.foot - frame.top))
        inner_side = (0.35 * frame.half, 0, 0)
        opening, inset = (_sideways(p, _FAR).translate(inner_side) for p in (panes, panes.offset(-_GAP)))
        add("windows_left", opening, inset, inward / np.linalg.norm(inward))
        name, glass, cut = found[-1]
        found.append((name.replace("left", "right"), glass.mirror((1, 0, 0)), cut.mirror((1, 0, 0))))
    return found


class _Slope:
    """The screen or the rear window: its foot and its height, and which way is into the car."""

    def __init__(self, frame: Frame, foot: float, top: float, base: float) -> None:
        along, up = frame.along(top) - frame.along(foot), frame.brow - base
        self.base = base
        inward = np.array((0, up, -abs(along))) / np.hypot(up, along)
        self.inward = inward * (1, 1 if foot < top else -1, 1)


def _pane(rng: np.random.Generator, frame: Frame, slope: _Slope, side: float) -> CrossSection | None:
    """Across the car, as x and z; None where too little is left between its margins."""
    low = slope.base + rng.uniform(2, 6)
    high = frame.brow - rng.uniform(3, 7) - 6 * abs(slope.inward[2]) - 0.3 * frame.edge
    rise = frame.brow - slope.base
    wide = [
        frame.foot + (frame.top - frame.foot) * (z - slope.base) / rise - side - 0.3 * frame.edge
        for z in (low, high)
    ]
    if (high - low) * min(wide) < _LEAST_WINDOW:
        return None
    corners = [(-wide[0], low), (wide[0], low), (wide[1], high), (-wide[1], high)]
    return _rounded(corners, rng.uniform(0, min(6, 0.3 * (high - low))))


def _side_panes(rng: np.random.Generator, frame: Frame, margin: float, closed: bool) -> CrossSection | None:
    """As y and z, with pillars between them."""
    from manifold3d import CrossSection, JoinType

    middle = (frame.roof_front + frame.roof_back) / 2
    outline = [
        (frame.along(frame.screen), frame.bonnet - 30),
        (frame.along(frame.window), frame.bonnet - 30),
        (frame.along(frame.window), frame.shoulder),
        (frame.along(frame.roof_back), frame.brow),
        (frame.along(middle), frame.roof),
        (frame.along(frame.roof_front), frame.brow),
        (frame.along(frame.screen), frame.bonnet),
    ]
    panes = CrossSection([outline]).offset(-margin - 0.2 * frame.edge, JoinType.Miter, 4.0)
    belt = frame.shoulder + rng.uniform(2, 6)
    panes = panes ^ _box(-_FAR, _FAR, belt, _FAR)
    start, stop = frame.along(frame.roof_front), frame.along(frame.roof_back)
    wide, doors = rng.uniform(5, 10), rng.uniform(75, 115)
    many = {"lorry": 1, "coupe": 1, "sports": 1, "pickup": 1, "utility": 1, "milk": 3, "van": 3, "estate": 3}
    count = int(rng.integers(1, many.get(frame.style, 2) + 1))
    if frame.style in ("saloon", "hatchback", "estate"):
        count = max(count, 2)
    if closed:
        panes = panes ^ _box(-_FAR, start + doors, 0, _FAR)
    else:
        for pillar in np.linspace(start, stop, count + 1)[1:-1] + rng.uniform(-8, 8):
            panes = panes - _box(pillar - wide / 2, pillar + wide / 2, 0, _FAR)
    kept = [pane for pane in panes.decompose() if pane.area() > _LEAST_PANE]
    panes = CrossSection.compose(kept) if kept else CrossSection()
    return panes if panes.area() > _LEAST_WINDOW else None


def _bumper(rng: np.random.Generator, frame: Frame, end: str, low: float) -> tuple[Manifold, float]:
    """A straight bar, or one that follows the body round its corners; and the height of its top."""
    from manifold3d import CrossSection, JoinType, Manifold

    rise = frame.deck - frame.clearance if frame.style == "lorry" else low - frame.clearance
    share = rng.uniform(0.28, 0.48) if end == "front" else rng.uniform(0.2, 0.36)
    tall, bottom = min(share * rise, 38), frame.clearance + rise * rng.uniform(0.04, 0.14)
    out, deep = rng.uniform(2, 9), rng.uniform(9, 14)
    wide = frame.snout if end == "front" else frame.rump
    if rng.random() < 0.5 or frame.style == "lorry":
        wide = rng.choice([wide * rng.uniform(0.85, 1.0), frame.half * rng.uniform(0.95, 1.03)])
        thick = deep + out
        y, z = (deep - out - frame.length) / 2, bottom + tall / 2
        corners = [(y + i * thick / 2, z + j * tall / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        section = _rounded(corners, rng.uniform(0.15, 0.45) * min(thick, tall))
        solid = _sideways(section, 2 * wide).translate((-wide, 0, 0))
    else:
        y, far = -frame.length / 2, 0.1 * frame.length - frame.length / 2
        plan = CrossSection([[(-wide, y), (wide, y), (frame.half, far), (-frame.half, far)]])
        out *= 0.6
        outer = plan.offset(out, JoinType.Round, circular_segments=24)
        inner = plan.offset(-deep, JoinType.Miter)
        wrapped = (outer - inner) ^ _box(-_FAR, _FAR, -_FAR - frame.length, y + deep + 3)
        solid = Manifold.extrude(wrapped.simplify(0.05), tall).translate((0, 0, bottom))
    return solid if end == "front" else solid.mirror((0, 1, 0)), bottom + tall


def _light(rng: np.random.Generator, frame: Frame, end: str, low: float) -> CrossSection | None:
    """Both lights of an end as x and z, above `low`; None where they find no room."""
    from manifold3d import CrossSection

    if end == "front":
        corner, high = frame.snout - 0.6 * frame.edge, 0.87 * frame.nose - 0.4 * frame.edge
    else:
        corner, high = frame.rump - 0.5 * frame.edge, 0.94 * frame.boot - 0.5 * frame.edge
        if frame.style == "lorry":
            corner, high = 0.88 * frame.half, frame.deck + 2
    room = high - low - 3
    if room < 7:
        return None
    style = rng.choice(["round", "square", "slanted"])
    upright = end == "back" and rng.random() < 0.6
    wide = rng.uniform(11, 18) if upright else rng.uniform(18, 42)
    tall = min(rng.uniform(20, 45) if upright else rng.uniform(9, 20), room)
    if style == "round":
        wide = tall = min(rng.uniform(13, 22), room)
    z = low + 2 + tall / 2 + rng.uniform(0.3, 1) * (room - tall)
    x = corner - wide / 2 - rng.uniform(0, 5)
    if style == "round":
        light = CrossSection.circle(tall / 2, 32)
    else:
        lean = wide * rng.uniform(0.1, 0.35) if style == "slanted" and not upright else 0.0
        cut = tall * (rng.uniform(0.2, 0.5) if lean else 0.0)
        w, t = wide / 2, tall / 2
        light = _rounded(
            [(-w, -t), (w - lean, -t), (w, t), (-w, t - cut)], rng.uniform(0, 0.25 * min(wide, tall))
        )
    light = light.translate((x, z))
    return light + light.mirror((1, 0))


def _light_in(
    rng: np.random.Generator, body: Manifold, end: str, lights: CrossSection
) -> tuple[str, Manifold, Manifold]:
    """Name, lights, and what they take from the body, which they follow, a little further out or in."""
    from manifold3d import Manifold

    ahead = -1 if end == "front" else 1
    _, first, _, _, last, _ = body.bounding_box()
    y = first + 18 if end == "front" else last - 18 + _FAR
    region = _across(lights, _FAR).translate((0, y, 0))
    out, deep = rng.uniform(1.2, 5) if rng.random() < 0.7 else -rng.uniform(1.2, 2), rng.uniform(5, 8)
    outer, inner = (body.translate((0, ahead * by, 0)) for by in (out, -deep))
    cut = Manifold()
    if out < 0:
        cut = region - body.translate((0, ahead * (out - _GAP), 0))
        region = _across(lights.offset(-_GAP), _FAR).translate((0, y, 0))
    lights = ((region ^ outer) - inner).decompose()
    most = max(light.volume() for light in lights)
    return f"lights_{end}", Manifold.compose([x for x in lights if x.volume() > 0.2 * most]), cut


def _mirrors(rng: np.random.Generator, frame: Frame) -> Solids:
    """On an arm under the front of the side windows; those of vans and lorries are tall."""
    tall = frame.style in ("lorry", "milk", "van") and rng.random() < 0.7
    wide, deep = rng.uniform(14, 22), rng.uniform(6, 12)
    high = rng.uniform(22, 38) if tall else rng.uniform(10, 16)
    thick = rng.uniform(4, 6)
    z = frame.shoulder - thick / 2 - 1
    screen, roof = frame.along(frame.screen), frame.along(frame.roof_front)
    rise = (frame.shoulder - frame.bonnet) / (frame.brow - frame.bonnet)
    y, side = screen + (roof - screen) * rise + rng.uniform(9, 18), frame.half
    x = side + rng.uniform(2, 9) + wide / 2
    arm = bar(x - side + 15, thick, thick).translate(((x + side - 15) / 2, y, z))
    head = pebble(wide, deep, high, rng.uniform(0.2, 0.48) * deep)
    head = head.translate((x, y, z + rng.uniform(0.2, 0.45) * (high - thick)))
    left = head + arm
    return {"mirror_left": left, "mirror_right": left.mirror((1, 0, 0))}


def _rounded(corners: list[tuple[float, float]], radius: float) -> CrossSection:
    """A convex outline, counter-clockwise, with rounded corners."""
    from manifold3d import CrossSection, JoinType

    outline = CrossSection([corners])
    if radius < 0.5:
        return outline
    return outline.offset(-radius, JoinType.Miter, 4.0).offset(radius, JoinType.Round, circular_segments=24)


def _box(left: float, right: float, low: float, high: float) -> CrossSection:
    from manifold3d import CrossSection

    return CrossSection([[(left, low), (right, low), (right, high), (left, high)]])


def _across(section: CrossSection, deep: float) -> Manifold:
    """x and z of a section, from y = 0 forward to -deep."""
    from manifold3d import Manifold

    return Manifold.extrude(section, deep).rotate((90, 0, 0))


def _sideways(section: CrossSection, deep: float) -> Manifold:
    """y and z of a section, from x = 0 to deep."""
    from manifold3d import Manifold

    return Manifold.extrude(section, deep).transform(((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0)))
