"""Chairs: a seat, four legs, mostly a back, and sometimes arms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.making import AROUND, bar, limb, pebble, plate, rod

if TYPE_CHECKING:
    from manifold3d import Manifold

LEGS = ("leg_front_left", "leg_front_right", "leg_back_left", "leg_back_right")
PARTS = ("seat", "back", *LEGS, "arm_left", "arm_right")
_NO_BACK, _NO_ARMS = 0.1, 0.3  # shares of stools, and of seats that could carry arms and do not
_ARMED = ("board", "cushion")  # seats wide enough at the back to carry arms


@dataclass(frozen=True)
class _Frame:
    """What the parts go by: the seat's style, width (x), depth (y), thickness and height of its top, and how
    far the back leans, in degrees."""

    seat: str
    width: float
    depth: float
    thick: float
    top: float
    lean: float


def make(rng: np.random.Generator) -> dict[str, Manifold]:
    """A chair that stands on z = 0 and looks along -y, in centimetres."""
    frame = _Frame(
        seat=rng.choice(["board", "cushion", "round", "tapered"], p=[0.3, 0.35, 0.15, 0.2]),
        width=rng.uniform(40, 56),
        depth=rng.uniform(38, 52),
        thick=rng.choice([rng.uniform(2.5, 5), rng.uniform(6, 12)]),
        top=rng.uniform(40, 52),
        lean=rng.uniform(2, 16),
    )
    seat = _seat(rng, frame)
    parts = {"seat": seat}
    if rng.random() >= _NO_BACK:
        inset = 0.07 * frame.depth if frame.seat == "round" else 2
        back = _back(rng, frame).rotate((-frame.lean, 0, 0))
        back = back.translate((0, frame.depth / 2 - inset, frame.top))
        parts["back"] = back.trim_by_plane((0, 0, 1), frame.top - frame.thick * 0.6)
        if frame.seat in _ARMED and rng.random() >= _NO_ARMS:
            arm = _arm(rng, frame)
            parts["arm_right"] = arm
            parts["arm_left"] = arm.mirror((1, 0, 0))
    leg = _leg_style(rng, frame)
    within = frame.top - frame.thick * 0.4
    for name in LEGS:
        solid = leg if "front" in name else leg.mirror((0, 1, 0))
        solid = solid.mirror((1, 0, 0)) if "left" in name else solid
        parts[name] = solid.trim_by_plane((0, 0, 1), 0).trim_by_plane((0, 0, -1), -within)
    return parts


def _seat(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """Its top at frame.top: a board, a cushion, a round or a tapered one."""
    from manifold3d import Manifold

    w, d, t = frame.width, frame.depth, frame.thick
    if frame.seat == "cushion":
        return pebble(w, d, t, t * rng.uniform(0.3, 0.49)).translate((0, 0, frame.top - t / 2))
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
    h = rng.uniform(34, 58)
    t = rng.uniform(2, 3.5)
    style = rng.choice(["panel", "cushion", "frame", "ladder", "spindles", "curved"])
    foot = bar(w * 0.8, t, 10).translate((0, 0, -4))
    if style == "panel":
        board = plate(w, h, t, rng.uniform(1.5, 8)).rotate((90, 0, 0)).translate((0, t / 2, h / 2))
        return board + foot
    if style == "cushion":
        thick = rng.uniform(4, 9)
        return pebble(w, thick, h, thick * 0.45).translate((0, 0, h / 2 + 1)) + foot
    if style == "curved":
        bend = w * rng.uniform(0.9, 1.6)
        shell = rod(h, bend) - rod(h + 2, bend - t).translate((0, 0, -1))
        cut = bar(w, 2 * bend, h).translate((0, -bend + 0.0, h / 2)).translate((0, 2 * bend, 0))
        return (shell ^ cut).translate((0, -bend + t / 2, 0)) + foot
    post = rod(h + 6, t * 0.75, t * 0.6).translate((w / 2 - t, 0, -6))
    posts = post + post.mirror((1, 0, 0))
    rail = pebble(w, t, rng.uniform(4, 9), t * 0.45)
    high = rail.translate((0, 0, h - 2))
    if style == "ladder":
        count = int(rng.integers(2, 5))
        slat = bar(w - 2 * t, t * 0.6, rng.uniform(2.5, 4.5))
        for z in np.linspace(0.25, 0.8, count) * h:
            posts = posts + slat.translate((0, 0, z))
        return posts + high
    if style == "spindles":
        count = int(rng.integers(3, 7))
        for x in np.linspace(-1, 1, count + 2)[1:-1] * (w / 2 - t):
            posts = posts + rod(h + 6, t * 0.35).translate((x, 0, -6))
        return posts + high
    middle = bar(w * rng.uniform(0.25, 0.5), t * 0.7, h).translate((0, 0, h / 2 - 3))
    return posts + high + middle


def _arm(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """The right one: a rest on two posts, a closed panel, or a bent rod."""
    rise = rng.uniform(16, 24)
    out = frame.width / 2
    z = frame.top + rise
    front = -frame.depth * rng.uniform(0.2, 0.4)
    behind = frame.depth / 2 + rise * np.tan(np.radians(frame.lean))
    style = rng.choice(["rest", "panel", "rod"])
    if style == "panel":
        thick = rng.uniform(2.5, 6)
        low = frame.top - frame.thick
        board = bar(thick, behind - front, z - low).translate((0, (front + behind) / 2, (low + z) / 2))
        return board.translate((out + thick / 2 - 0.8, 0, 0))
    x = out - rng.uniform(1.5, 3)
    if style == "rod":
        r = rng.uniform(1.2, 1.9)
        low = frame.top - 1.5
        before, rear = (x, front, z), (x, frame.depth / 2 - 3, z)
        posts = limb((x, front, low), before, r) + limb((x, frame.depth / 2 - 5, low), rear, r)
        return limb(before, rear, r) + posts
    wide = rng.uniform(4, 7)
    rest = pebble(wide, behind - front, 2.6, 1.1).translate((x, (front + behind) / 2, z))
    post = rod(rise + 2, 1.7, 1.4).translate((x, 0, frame.top - 1.5))
    return rest + post.translate((0, front + 4, 0)) + post.translate((0, frame.depth / 2 - 6, 0))


def _leg_style(rng: np.random.Generator, frame: _Frame) -> Manifold:
    """The front right leg, from below z = 0 up into the seat: round or square, tapered and splayed or not."""
    from manifold3d import Manifold

    long = frame.top + 4
    thick = rng.uniform(1.4, 2.6)
    taper = rng.uniform(0.55, 1.0)
    style = rng.choice(["round", "square", "turned"], p=[0.45, 0.4, 0.15])
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
    splay = rng.choice([0.0, rng.uniform(3, 12)])
    inset = thick + rng.uniform(1, 4) + frame.width * {"round": 0.13, "tapered": 0.1}.get(frame.seat, 0.03)
    x, y = frame.width / 2 - inset, -frame.depth / 2 + inset
    return leg.translate((0, 0, -long)).rotate((-splay, -splay, 0)).translate((x, y, frame.top + 1))
