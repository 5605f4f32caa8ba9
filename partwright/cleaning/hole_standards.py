"""Diameters of holes that drawings ask for: for metric and unified screws, to pass or to be tapped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.shapes import METRES

_MM, _INCH = METRES["mm"], METRES["in"]
_IMPERIAL = "in", "ft"
_OFF = 1e-4  # of the longest of a part's lengths, by which one may be off a number that was typed
_FEW, _SURE = 2, 2  # lengths that may be so by chance, and times as many as may be otherwise
# ISO 273, medium; ISO 2306 for coarse threads (ISO 262)
_ISO_CLEARANCE = {
    "M2": 2.4, "M2.5": 2.9, "M3": 3.4, "M4": 4.5, "M5": 5.5, "M6": 6.6, "M8": 9.0, "M10": 11.0, "M12": 13.5,
    "M14": 15.5, "M16": 17.5, "M20": 22.0, "M24": 26.0, "M30": 33.0,
}  # fmt: skip
_ISO_TAPPED = {
    "M2": 1.6, "M2.5": 2.05, "M3": 2.5, "M4": 3.3, "M5": 4.2, "M6": 5.0, "M8": 6.8, "M10": 8.5, "M12": 10.2,
    "M14": 12.0, "M16": 14.0, "M20": 17.5, "M24": 21.0, "M30": 26.5,
}  # fmt: skip
# ASME B18.2.8, close and normal; drills for UNC threads at 75 %
_UNC_CLEARANCE = {
    "#4": 0.1285, "#6": 0.1695, "#8": 0.196, "#10": 0.221, "1/4": 0.28125, "5/16": 0.34375, "3/8": 0.40625,
    "7/16": 0.46875, "1/2": 0.5625, "5/8": 0.6875, "3/4": 0.8125,
}  # fmt: skip
_UNC_CLOSE = {
    "1/4": 0.266, "5/16": 0.328, "3/8": 0.391, "7/16": 0.453, "1/2": 0.531, "5/8": 0.656, "3/4": 0.781,
}  # fmt: skip
_UNC_TAPPED = {
    "#4-40": 0.089, "#6-32": 0.1065, "#8-32": 0.136, "#10-24": 0.1495, "1/4-20": 0.201, "5/16-18": 0.257,
    "3/8-16": 0.3125, "7/16-14": 0.368, "1/2-13": 0.4219, "5/8-11": 0.5312, "3/4-10": 0.6562,
}  # fmt: skip


@dataclass(frozen=True)
class HoleSize:
    """A standard hole. diameter: in metres."""

    name: str
    diameter: float


def _sizes() -> list[HoleSize]:
    tables = (
        (_ISO_CLEARANCE, _MM, "{} clearance, ISO 273 medium"),
        (_ISO_TAPPED, _MM, "{} tapping, ISO 2306"),
        (_UNC_CLEARANCE, _INCH, "{} clearance, ASME B18.2.8 normal"),
        (_UNC_CLOSE, _INCH, "{} clearance, ASME B18.2.8 close"),
        (_UNC_TAPPED, _INCH, "{} UNC tapping"),
    )
    return [
        HoleSize(text.format(name), value * unit)
        for table, unit, text in tables
        for name, value in table.items()
    ]


_SIZES = _sizes()


def standard_hole(
    diameter: float, tolerance: float, unit: str | None, inches: bool = False
) -> tuple[str, float] | None:
    """Name and diameter of the nearest standard hole at most `tolerance` away, all in the unit; None where
    there is none, or the unit is not known. inches: whether the part was drawn in inches, as one in inches or
    feet was: its holes are for unified screws."""
    if unit is None or unit not in METRES:
        return None
    metres = METRES[unit]
    imperial = inches or unit in _IMPERIAL
    ours = [size for size in _SIZES if ("ISO" in size.name) != imperial]
    best = min(ours, key=lambda size: abs(size.diameter / metres - diameter))
    nominal = float(f"{best.diameter / metres:.9g}")
    return (best.name, nominal) if abs(nominal - diameter) <= tolerance else None


def is_drawn_in_inches(assembly: Assembly) -> bool:
    """Whether its parts are as long as sixteenths of an inch, and few are as long as half millimetres."""
    if assembly.unit not in METRES or assembly.unit in _IMPERIAL:
        return assembly.unit in _IMPERIAL
    extents = [np.ptp(np.array(part.field.bounds()), axis=0) for part in assembly.parts]
    lengths = np.unique(np.concatenate(extents).round(6)) * METRES[assembly.unit]
    lengths = lengths[np.isfinite(lengths)]
    near = _OFF * float(lengths.max(initial=0.0))

    def fit(step: float) -> NDArray[np.bool_]:
        return np.asarray(np.abs(lengths - (lengths / step).round() * step) < near) & (lengths > step)

    imperial, metric = fit(_INCH / 16), fit(_MM / 2)
    return int((imperial & ~metric).sum()) > max(_FEW, _SURE * int((metric & ~imperial).sum()))
