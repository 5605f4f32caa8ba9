"""Names of screw threads: ISO metric, coarse and fine, and unified, coarse and fine."""

from __future__ import annotations

from dataclasses import dataclass

from partwright.shapes import METRES

_MM, _INCH = METRES["mm"], METRES["in"]
# ISO 262: pitches of a diameter, the coarse one first; mm
_ISO = {
    1.6: (0.35,), 2: (0.4,), 2.5: (0.45,), 3: (0.5,), 3.5: (0.6,), 4: (0.7,), 5: (0.8,), 6: (1.0,), 7: (1.0,),
    8: (1.25, 1.0), 10: (1.5, 1.25, 1.0), 12: (1.75, 1.5, 1.25), 14: (2.0, 1.5), 16: (2.0, 1.5),
    18: (2.5, 2.0, 1.5), 20: (2.5, 2.0, 1.5), 22: (2.5, 2.0, 1.5), 24: (3.0, 2.0), 27: (3.0, 2.0),
    30: (3.5, 2.0), 33: (3.5, 2.0), 36: (4.0, 3.0), 39: (4.0, 3.0), 42: (4.5, 3.0), 48: (5.0, 3.0),
    52: (5.0, 4.0), 56: (5.5, 4.0), 64: (6.0, 4.0),
}  # fmt: skip
# ASME B1.1: inches, turns an inch, coarse and fine
_UNIFIED = {
    "#2": (0.086, 56, 64), "#4": (0.112, 40, 48), "#5": (0.125, 40, 44), "#6": (0.138, 32, 40),
    "#8": (0.164, 32, 36), "#10": (0.19, 24, 32), "1/4": (0.25, 20, 28), "5/16": (0.3125, 18, 24),
    "3/8": (0.375, 16, 24), "7/16": (0.4375, 14, 20), "1/2": (0.5, 13, 20), "9/16": (0.5625, 12, 18),
    "5/8": (0.625, 11, 18), "3/4": (0.75, 10, 16), "7/8": (0.875, 9, 14), "1": (1.0, 8, 12),
}  # fmt: skip
_PITCH = 0.02  # of the pitch, that a measured one may be off
_WIDE = 0.25  # of the pitch, that the outer diameter may be off: crests are cut, and printed ones have room


@dataclass(frozen=True)
class _Standard:
    """diameter, pitch: metres."""

    name: str
    diameter: float
    pitch: float


def _standards() -> list[_Standard]:
    metric = [
        _Standard(f"M{diameter:g}" + (f"x{pitch:g}" if i else ""), diameter * _MM, pitch * _MM)
        for diameter, pitches in _ISO.items()
        for i, pitch in enumerate(pitches)
    ]
    unified = [
        _Standard(f"{size}-{turns} {series}", diameter * _INCH, _INCH / turns)
        for size, (diameter, *both) in _UNIFIED.items()
        for series, turns in zip(("UNC", "UNF"), both, strict=True)
    ]
    return metric + unified


_STANDARDS = _standards()


def standard_thread(diameter: float, pitch: float, unit: str | None) -> str | None:
    """Name of the thread of an outer diameter and a pitch, in the unit; None where it is none, or the unit is
    not known."""
    if unit is None or unit not in METRES:
        return None
    wide, climb = diameter * METRES[unit], pitch * METRES[unit]
    near = [
        one
        for one in _STANDARDS
        if abs(one.pitch - climb) <= _PITCH * one.pitch and abs(one.diameter - wide) <= _WIDE * one.pitch
    ]
    best = min(near, key=lambda one: abs(one.diameter - wide) + abs(one.pitch - climb), default=None)
    return best.name if best is not None else None
