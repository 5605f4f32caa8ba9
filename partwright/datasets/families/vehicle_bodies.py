"""Bodies of vehicles: from a style's ranges to one's measures, and from those to a solid without openings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families.car_shapes import Range, slab
from partwright.datasets.making import bar, plate, rod

if TYPE_CHECKING:
    from manifold3d import Manifold


@dataclass(frozen=True)
class Style:
    """A kind of body. screen, roof_front, roof_back, window: shares of its length from the nose (0) to the
    tail (1), where the screen starts and ends, where the roof ends and where the rear window does. The rest
    are ranges: bonnet and boot as shares of the height of the shoulder; roof, length, width, wheel radius,
    wheel breadth and roundness of edges in centimetres; clearance as a share of the radius; belt, the height
    of the shoulder between sill and roof; top, snout and rump as shares of half the width."""

    name: str
    screen: float
    roof_front: float
    roof_back: float
    window: float
    bonnet: Range
    boot: Range
    roof: Range
    length: Range
    width: Range = (165, 195)
    radius: Range = (28, 35)
    broad: Range = (18, 26)
    edge: Range = (5, 14)
    clearance: Range = (0.45, 0.7)
    belt: Range = (0.56, 0.66)
    nose: Range = (0.74, 0.95)
    top: Range = (0.7, 0.86)
    snout: Range = (0.72, 0.95)
    rump: Range = (0.82, 0.96)
    share: float = 1.0


STYLES = (
    Style("saloon", 0.28, 0.42, 0.70, 0.85, (0.86, 0.96), (0.93, 1.0), (136, 152), (420, 510), share=1.1),
    Style("hatchback", 0.25, 0.39, 0.82, 0.97, (0.86, 0.97), (1.0, 1.0), (142, 160), (350, 430), share=1.1),
    Style("estate", 0.27, 0.40, 0.90, 0.985, (0.86, 0.96), (1.0, 1.0), (142, 158), (430, 500)),
    Style(
        *("coupe", 0.32, 0.48, 0.62, 0.92, (0.88, 0.98), (0.97, 1.0), (125, 138), (400, 470)),
        belt=(0.58, 0.67),
    ),
    Style(
        *("sports", 0.34, 0.50, 0.60, 0.90, (0.88, 1.0), (0.97, 1.0), (108, 126), (380, 470)),
        width=(175, 205), radius=(29, 36), broad=(22, 32), clearance=(0.3, 0.5), belt=(0.6, 0.7),
        nose=(0.82, 0.97),
    ),
    Style(
        *("van", 0.10, 0.24, 0.95, 0.99, (0.9, 0.98), (1.0, 1.0), (165, 215), (430, 540)),
        top=(0.76, 0.92), rump=(0.9, 0.97), belt=(0.5, 0.62),
    ),
    Style(
        *("milk", 0.15, 0.22, 1.0, 1.0, (0.92, 1.0), (1.0, 1.0), (220, 290), (430, 560)),
        width=(190, 235), radius=(34, 46), edge=(3, 8), clearance=(0.55, 0.72), belt=(0.52, 0.66),
        nose=(0.8, 0.97), top=(0.9, 0.99), snout=(0.85, 1.0), rump=(0.94, 1.0), share=1.2,
    ),
    Style(
        *("pickup", 0.27, 0.38, 0.56, 0.60, (0.9, 0.98), (1.0, 1.0), (160, 195), (460, 560)),
        width=(170, 210), radius=(31, 42), clearance=(0.55, 0.8), snout=(0.8, 1.0), rump=(0.88, 1.0),
        share=1.1,
    ),
    Style(
        *("offroad", 0.27, 0.34, 0.92, 0.98, (0.9, 1.0), (1.0, 1.0), (160, 205), (350, 440)),
        width=(175, 225), radius=(35, 48), broad=(22, 42), edge=(3, 9), clearance=(0.6, 0.9),
        nose=(0.85, 0.98), top=(0.72, 0.9), snout=(0.85, 1.0), rump=(0.9, 1.0), share=1.2,
    ),
    Style(
        *("utility", 0.26, 0.33, 0.54, 0.58, (0.88, 1.0), (0.95, 1.0), (165, 215), (360, 460)),
        width=(175, 225), radius=(35, 48), broad=(22, 42), edge=(3, 9), clearance=(0.6, 0.9),
        nose=(0.85, 0.98), top=(0.72, 0.9), snout=(0.85, 1.0), rump=(0.9, 1.0), share=1.2,
    ),
    Style(
        *("lorry", 0.015, 0.05, 0.22, 0.25, (0.97, 1.0), (1.0, 1.0), (230, 300), (520, 760)),
        width=(200, 245), radius=(40, 50), broad=(22, 32), edge=(4, 10), clearance=(0.6, 0.75),
        belt=(0.48, 0.56), nose=(0.95, 1.0), top=(0.88, 0.98), snout=(0.92, 1.0), rump=(0.95, 1.0),
    ),
)  # fmt: skip
BEDS = ("pickup", "utility")
_VARIED = 0.025  # of the length, by which the places along it vary


@dataclass(frozen=True)
class Frame:
    """One vehicle's measures in centimetres, as Style names them; screen to window are shares of the length.

    front, back: y of the axles; gap: radius of the wells over that of the wheels; foot, top: half widths of
    the cabin at the shoulder and under the roof; brow: height of the roof's ends.
    """

    style: str
    screen: float
    roof_front: float
    roof_back: float
    window: float
    length: float
    half: float
    radius: float
    broad: float
    gap: float
    clearance: float
    front: float
    back: float
    edge: float
    roof: float
    brow: float
    shoulder: float
    bonnet: float
    boot: float
    nose: float
    foot: float
    top: float
    snout: float
    rump: float

    def along(self, share: float) -> float:
        """y of a share of the length."""
        return (share - 0.5) * self.length

    @property
    def deck(self) -> float:
        """Height of a bed's or a lorry's floor, above the wells."""
        return self.radius * (1 + self.gap) + 3


def draw_frame(rng: np.random.Generator) -> Frame:
    """The measures of a vehicle of some style."""
    shares = np.array([style.share for style in STYLES])
    style = STYLES[rng.choice(len(STYLES), p=shares / shares.sum())]
    length, half = rng.uniform(*style.length), rng.uniform(*style.width) / 2
    radius, roof = rng.uniform(*style.radius), rng.uniform(*style.roof)
    clearance = radius * rng.uniform(*style.clearance)
    shoulder = clearance + (roof - clearance) * rng.uniform(*style.belt)
    gap = rng.uniform(1.08, 1.2)
    screen, roof_front, roof_back, window = _places(rng, style)
    bonnet = shoulder * rng.uniform(*style.bonnet)
    nose = bonnet * rng.uniform(*style.nose)
    edge = rng.uniform(*style.edge)
    over = nose + 0.4 * (bonnet - nose) - 0.5 * edge - 2  # the wings above the front wheels
    radius = min(radius, over / (1 + gap))
    reach = gap * radius + 20  # from an axle to the end of the body: room for the well and a bumper
    lorry = style.name == "lorry"
    front = -min(length * (rng.uniform(0.34, 0.4) if lorry else rng.uniform(0.28, 0.34)), length / 2 - reach)
    back = min(length * (rng.uniform(0.18, 0.28) if lorry else rng.uniform(0.22, 0.33)), length / 2 - reach)
    return Frame(
        style.name,
        *(screen, roof_front, roof_back, window),
        *(length, half, radius, rng.uniform(*style.broad), gap, clearance, front, back),
        edge=edge,
        roof=roof,
        brow=roof - rng.uniform(1, 6),
        shoulder=shoulder,
        bonnet=bonnet,
        boot=shoulder * rng.uniform(*style.boot),
        nose=nose,
        foot=half * (rng.uniform(0.97, 1.0) if min(style.top) > 0.87 else 0.96),
        top=half * rng.uniform(*style.top),
        snout=half * rng.uniform(*style.snout),
        rump=half * rng.uniform(*style.rump),
    )


def _places(rng: np.random.Generator, style: Style) -> list[float]:
    """From the foot of the screen to the foot of the rear window, as shares of the length; both ends of the
    cabin keep a slope, and what ends with the body does so still."""
    screen, roof_front, roof_back, window = (
        place if place in (0.015, 1.0) else place + rng.uniform(-_VARIED, _VARIED)
        for place in (style.screen, style.roof_front, style.roof_back, style.window)
    )
    steepest = 0.03
    return [screen, max(roof_front, screen + steepest), min(roof_back, window), min(window, 1.0)]


def body(rng: np.random.Generator, frame: Frame) -> Manifold:
    """Without wells and openings."""
    if frame.style == "lorry":
        return _lorry(rng, frame)
    half, nose, boot = frame.half, frame.nose, frame.boot
    flanks = [(0.1, half, 0), (0.9, half, 0)]
    chin, heel = (frame.clearance + 0.2 * (top - frame.clearance) for top in (nose, boot))
    screen, window = (frame.screen, half, frame.bonnet), (frame.window, half, frame.shoulder)
    front = [
        (0, frame.snout, chin),
        (0, frame.snout, nose * 0.85),
        (0.05, max(half * 0.95, frame.snout), nose),
        (0.1, half, nose * 1.01),
    ]
    back = [
        (1, frame.rump, heel),
        (1, frame.rump, boot * 0.92),
        (0.95, max(half * 0.97, frame.rump), boot),
        (0.86, half, boot),
    ]
    solid = (
        _slab(frame, *front, *flanks, screen) + _slab(frame, *back, *flanks, screen, window) + cabin(frame)
    )
    if frame.style in BEDS and frame.deck < min(boot, frame.shoulder) - 8:
        start, end = frame.along(frame.window) + 8, frame.length / 2 - 9
        bed = bar(2 * min(frame.rump, half) - 18, end - start, 400)
        solid = solid - bed.translate((0, (start + end) / 2, frame.deck + 200))
    if frame.style in (*BEDS, "offroad") and rng.random() < 0.5:
        solid = solid + _arches(rng, frame)
    return solid


def cabin(frame: Frame) -> Manifold:
    """From the shoulder up to the roof; its foot lies in the body."""
    middle = (frame.roof_front + frame.roof_back) / 2
    return _slab(
        frame,
        (frame.screen, frame.foot, frame.bonnet),
        (frame.roof_front, frame.top, frame.brow),
        (middle, frame.top, frame.roof),
        (frame.roof_back, frame.top, frame.brow),
        (frame.window, frame.foot, frame.shoulder),
    )


def _lorry(rng: np.random.Generator, frame: Frame) -> Manifold:
    """A cab over the engine, a low frame, and behind the cab a box, or a deck, perhaps with boards."""
    half, end = frame.half, frame.window
    low = _slab(
        frame,
        (0, frame.snout, 0),
        (0, frame.snout, frame.nose),
        (frame.screen, half, frame.bonnet),
        (0.06, half, 0),
        (end, half, 0),
        (end, half, frame.shoulder),
    )
    start, stop = frame.along(end) - 12, frame.length / 2
    deep = rng.uniform(8, 16)
    sill = bar(2 * half * 0.96, stop - start, frame.deck + deep - frame.clearance)
    solid = (
        low
        + cabin(frame)
        + sill.translate((0, (start + stop) / 2, (frame.deck + deep + frame.clearance) / 2))
    )
    start = frame.along(end) + rng.uniform(3, 30)
    wide, high = 2 * half * rng.uniform(0.97, 1.04), frame.roof * rng.uniform(0.95, 1.3) - frame.deck
    kind = rng.choice(["box", "deck", "boards"], p=[0.7, 0.12, 0.18])
    if kind != "box":
        high = deep + (8 if kind == "deck" else rng.uniform(35, 60))
    load = plate(wide, stop - start, high, rng.uniform(1, 6))
    if kind == "boards":
        load = load - bar(wide - 14, stop - start - 14, 400).translate((0, 0, 200 + deep + 4))
    return solid + load.translate((0, (start + stop) / 2, frame.deck))


def _arches(rng: np.random.Generator, frame: Frame) -> Manifold:
    """Over the wheels, out of the flanks."""
    radius = frame.radius * frame.gap + rng.uniform(5, 10)
    out = rng.uniform(2, 8)
    arch = rod(2 * (frame.half + out), radius, radius).translate((0, 0, -frame.half - out)).rotate((0, 90, 0))
    arch = arch.trim_by_plane((0, 0, 1), 0)
    return arch.translate((0, frame.front, frame.radius)) + arch.translate((0, frame.back, frame.radius))


def _slab(frame: Frame, *points: tuple[float, float, float]) -> Manifold:
    return slab(frame.length, frame.edge, frame.clearance, points)
