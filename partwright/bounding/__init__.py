"""Assemblies that keep a promise about a shape: contain it, stay inside it, or come near it everywhere."""

from __future__ import annotations

from partwright.bounding.check import Checked, check
from partwright.bounding.keeping import Bounded, bound
from partwright.bounding.limits import Bounds
from partwright.bounding.promise import bounds_report, bounds_warnings, check_alone, promise
from partwright.bounding.thinning import fewest

__all__ = [
    "Bounded",
    "Bounds",
    "Checked",
    "bound",
    "bounds_report",
    "bounds_warnings",
    "check",
    "check_alone",
    "fewest",
    "promise",
]
