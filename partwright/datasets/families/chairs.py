"""Chairs: a seat, mostly four legs and a back, and sometimes arms; from stools and benches to sofas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families.couches import couch
from partwright.datasets.making import AROUND, bar, limb, pebble, plate, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

LEGS = ("leg_front_left", "leg_front_right", "leg_back_left", "leg_back_right")
PARTS = ("seat", "back", *LEGS, "arm_left", "arm_right")
_NO_BACK, _NO_ARMS = 0.1, 0.3  # shares of stools, and of seats that could carry arms and do not
_ARMED = ("board", "cushion")  # seats wide enough at the back to carry arms
_KINDS = {"usual": 0.42, "block": 0.14, "slender": 0.09, "bench": 0.08, "lounge": 0.08, "couch": 0.19}


@dataclass(frozen=True)
class _Frame:
    """What the parts go by: the kind of chair, the seat's style, width (x), depth (y), thickness and height
    of its top, how far the back leans from the seat and the seat itself from level, in degrees; stout: how
    thick what carries is, 1 in most chairs."""

    kind: str
    seat: str
    width: float
    depth: float
    thick: float
    top: float
    lean: float
    tilt: float
    stout: float

    def tilted(self, solid: Manifold) -> Manifold:
        """Turned as the seat is."""
        return solid.translate((0, 0, -self.top)).rotate((-self.tilt, 0, 0)).translate((0, 0, self.top))

    def under(self, solid: Manifold, depth: float) -> Manifold:
        """What lies lower than `depth` under the seat's top."""
        turn = np.radians(self.tilt)
        normal = np.array((0, np.sin(turn), np.cos(turn)))
        return solid.trim_by_plane(tuple(-normal), depth - self.top * np.cos(turn))


def make(rng: np.random.Generator) -> dict[str, Manifold]:
    """A chair that stands on z = 0 and looks along -y, in centimetres."""
    kind = str(rng.choice(list(_KINDS), p=list(_KINDS.values())))
    if kind == "couch":
        return couch(rng)
    frame = _frame(rng, kind)
    parts = {"seat": frame.tilted(_seat(rng, frame))}
    if rng.random() >= (0.5 if kind == "bench" else _NO_BACK) or kind == "lounge":
        inset = 0.07 * frame.depth if frame.seat == "round" else 2 * frame.stout
        back = _back(rng, frame).rotate((-frame.lean, 0, 0))
        back = back.translate((0, frame.depth / 2 - inset, frame.top))
        parts["back"] = frame.tilted(back.trim_by_plane((0, 0, 1), frame.top - frame.thick * 0.6))
        if frame.seat in _ARMED and rng.random() >= _NO_ARMS:
            arm = frame.tilted(_arm(rng, frame))
            parts["arm_left"] = arm
            parts["arm_right"] = arm.mirror((1, 0, 0))
    leg = _leg_style(rng, frame)
    for name in LEGS:
        solid = leg if "front" in name else leg.mirror((0, 1, 0))
        solid = solid.mirror((1, 0, 0)) if "right" in name else solid
        parts[name] = frame.under(solid.trim_by_plane((0, 0, 1), 0), frame.thick * 0.4)
    return parts


def _frame(rng: np.random.Generator, kind: str) -> _Frame:
    ranges = {
        "usual": ((40, 56), (38, 52), (40, 52), (2, 16), (1, 1)),
        "block": ((38, 62), (38, 60), (26, 48), (0, 14), (1.7, 3)),
        "slender": ((40, 58), (38, 54), (40, 52), (4, 20), (0.65, 0.9)),
        "bench": ((85, 180), (32, 55), (38, 50), (2, 16), (1, 2)),
        "lounge": ((52, 78), (50, 72), (26, 40), (12, 35), (0.8, 1.4)),
    }
    width, depth, top, lean, stout = (rng.uniform(*each) for each in ranges[kind])
    styles = ["board", "cushion", "round", "tapered"]
    odds = [0.5, 0.5, 0, 0] if kind in ("bench", "lounge", "block") else [0.3, 0.35, 0.15, 0.2]
    seat = str(rng.choice(styles, p=odds))
    thick = rng.choice([rng.uniform(2.5, 5), rng.uniform(6, 12)])
    if kind == "slender":
        thick = rng.uniform(1.8, 3.5)
    if kind in ("block", "lounge"):
        thick = rng.uniform(7, 14)
    tilt = rng.uniform(3, 14) if kind == "lounge" else 0.0
    return _Frame(kind, seat, width, depth, thick, top, lean, tilt, stout)


def _seat(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """Its top at frame.top: a board, a cushion, a round or a tapered one."""
    from manifold3d import Manifold

    w, d, t = frame.width, frame.depth, frame.thick
    if frame.seat == "cushion":
        return pebble(w, d, t, t * rng.uniform(0.2, 0.49)).translate((0, 0, frame.top - t / 2))
    if frame.seat == "round":
        return rod(t, 0.5).scale((w, d, 1)).translate((0, 0, frame.top - t))
    if frame.seat == "tapered":
        narrow = rng.uniform(0.72, 0.9)
        corner = rng.uniform(2, 5)
        disc = rod(t, corner)
        x, y = w / 2 - corner, d / 2 - corner
        places = [(x, -y), (-x, -y), (narrow * x, y), (-narrow * x, y)]
        return Manifold.batch_hull([disc.translate((*p, frame.top - t)) for p in places])
    return plate(w, d, t, rng.uniform(1, 7)).translate((0, 0, frame.top - t))


def _back(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """Upright, from a little below z = 0: a panel, a cushion, a frame, a ladder, spindles or a shell."""
    w = frame.width * rng.uniform(0.8, 0.98) * {"round": 0.55, "tapered": 0.78}.get(frame.seat, 1.0)
    h = rng.uniform(34, 62)
    t = rng.uniform(2, 3.5) * frame.stout
    styles = ["panel", "cushion", "frame", "ladder", "spindles", "curved"]
    odds = {"block": [0.2, 0.15, 0.15, 0.4, 0.1, 0], "lounge": [0.2, 0.8, 0, 0, 0, 0]}
    odds["bench"] = [0.25, 0.15, 0.1, 0.25, 0.25, 0]
    style = rng.choice(styles, p=odds.get(frame.kind))
    foot = bar(w * 0.8, t, 12).translate((0, 0, -3))
    if style == "panel":
        board = plate(w, h, t, rng.uniform(1.5, 8)).rotate((90, 0, 0)).translate((0, t / 2, h / 2))
        return board + foot
    if style == "cushion":
        thick = rng.uniform(4, 9) if frame.kind != "lounge" else rng.uniform(8, 15)
        return pebble(w, thick, h, thick * 0.45).translate((0, 0, h / 2 + 1)) + foot
    if style == "curved":
        bend = w * rng.uniform(0.9, 1.6)
        shell = rod(h, bend) - rod(h + 2, bend - t).translate((0, 0, -1))
        cut = bar(w, 2 * bend, h).translate((0, -bend + 0.0, h / 2)).translate((0, 2 * bend, 0))
        return (shell ^ cut).translate((0, -bend + t / 2, 0)) + foot
    post = rod(h + 6, t * 0.75, t * 0.6).translate((w / 2 - t, 0, -6))
    if frame.kind == "block" or rng.random() < 0.2:
        post = pebble(t * rng.uniform(1.5, 2.2), t * 1.3, h + 6, t * 0.2).translate((w / 2 - t, 0, h / 2 - 3))
    posts = post + post.mirror((1, 0, 0))
    rail = pebble(w, t, min(rng.uniform(4, 9) * max(frame.stout, 1), h / 4), t * 0.45)
    if frame.kind == "block":
        rail = rail.scale((1 - 2 * t / w, 1, 1))
    high = rail.translate((0, 0, h - 2 - (h * rng.uniform(0.05, 0.15) if frame.kind == "block" else 0)))
    if style == "ladder":
        count = int(rng.integers(1, 4) if frame.kind == "block" else rng.integers(2, 5))
        slat = bar(w - 2 * t, t * 0.6, rng.uniform(2.5, 4.5) * max(1, 0.8 * frame.stout))
        for z in np.linspace(0.25, 0.8 if count > 1 else 0.4, count) * h:
            posts = posts + slat.translate((0, 0, z * (0.8 if frame.kind == "block" else 1)))
        return posts + high
    if style == "spindles":
        count = int(rng.integers(3, 7) * max(1, frame.width / 60))
        for x in np.linspace(-1, 1, count + 2)[1:-1] * (w / 2 - t):
            posts = posts + rod(h + (0 if frame.kind == "block" else 6), t * 0.35).translate((x, 0, -6))
        return posts + high
    middle = bar(w * rng.uniform(0.25, 0.5), t * 0.7, h).translate((0, 0, h / 2 - 3))
    return posts + high + middle


def _arm(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """The left one: a rest on two posts, a closed panel, or a bent rod."""
    rise = rng.uniform(16, 24)
    out = frame.width / 2
    z = frame.top + rise
    front = -frame.depth * rng.uniform(0.2, 0.4)
    behind = frame.depth / 2 + rise * np.tan(np.radians(frame.lean))
    style = rng.choice(["rest", "panel", "rod"])
    if style == "panel":
        thick = rng.uniform(2.5, 6) * np.clip(frame.stout, 0.8, 1.7)
        low = frame.top - frame.thick
        board = bar(thick, behind - front, z - low).translate((0, (front + behind) / 2, (low + z) / 2))
        return board.translate((out + thick / 2 - 0.8, 0, 0))
    x = out - rng.uniform(1.5, 3) * frame.stout
    if style == "rod":
        r = rng.uniform(1.2, 1.9) * frame.stout
        low = frame.top - 1.5
        before, rear = (x, front, z), (x, frame.depth / 2 - 3, z)
        posts = limb((x, front, low), before, r) + limb((x, frame.depth / 2 - 5, low), rear, r)
        return limb(before, rear, r) + posts
    wide = rng.uniform(4, 7) * max(frame.stout, 0.8)
    rest = pebble(wide, behind - front, 2.6 * frame.stout, 1.1 * min(frame.stout, 1.5))
    rest = rest.translate((x, (front + behind) / 2, z))
    post = rod(rise + 2, 1.7 * frame.stout, 1.4 * frame.stout).translate((x, 0, frame.top - 1.5))
    return rest + post.translate((0, front + 4, 0)) + post.translate((0, frame.depth / 2 - 6, 0))


def _leg_style(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """The front left leg, from below z = 0 up into the seat: round or square, tapered and splayed or not,
    or a sled, whose runner meets that of the leg behind it."""
    from manifold3d import Manifold

    over = 1 + np.sin(np.radians(frame.tilt)) * frame.depth / 2
    long = frame.top + 3 + over
    thick = rng.uniform(1.4, 2.6) * frame.stout
    taper = rng.uniform(0.55, 1.0) if frame.kind != "block" else rng.uniform(0.85, 1.0)
    odds = {"block": [0.1, 0.9, 0, 0], "lounge": [0.2, 0.2, 0, 0.6], "slender": [0.5, 0.3, 0, 0.2]}
    style = rng.choice(
        ["round", "square", "turned", "sled"], p=odds.get(frame.kind, [0.43, 0.38, 0.14, 0.05])
    )
    inset = thick + rng.uniform(0.3, 4) + frame.width * {"round": 0.13, "tapered": 0.1}.get(frame.seat, 0.0)
    x, y = frame.width / 2 - inset, -frame.depth / 2 + inset
    if style == "sled":
        side = max(0.7 * thick, 1.1)
        runner = bar(2 * side, -y, 2 * side).translate((x, y / 2, side))
        upright = bar(2 * side, 2 * side, long).translate((x, y, long / 2))
        return (upright + runner).trim_by_plane((0, -1, 0), 0)
    if style == "square":
        side = 2 * thick
        leg = Manifold.batch_hull(
            [bar(side, side, 0.1).translate((0, 0, long)), bar(side * taper, side * taper, 0.1)]
        )
    else:
        leg = rod(long, thick * taper, thick)
    if style == "turned":
        bead = Manifold.sphere(thick * 1.5, AROUND // 2)
        for z in rng.uniform(0.2, 0.7, 2) * frame.top:
            leg = leg + bead.translate((0, 0, z))
    splay = rng.choice([0.0, rng.uniform(3, 12)]) if frame.kind != "block" else 0.0
    return leg.translate((0, 0, -long)).rotate((-splay, -splay, 0)).translate((x, y, frame.top + over))
