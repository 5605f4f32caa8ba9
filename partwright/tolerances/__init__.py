"""Assemblies held to distances from a shape: contain it, stay inside it, or come near it everywhere."""

from __future__ import annotations

from partwright.tolerances.check import Checked, check
from partwright.tolerances.distance_bounds import DistanceBounds
from partwright.tolerances.enforcing import bounds_report, bounds_warnings, check_alone, enforce
from partwright.tolerances.minimising import minimise_parts
from partwright.tolerances.satisfying import Bounded, satisfy

__all__ = [
    "Bounded",
    "Checked",
    "DistanceBounds",
    "bounds_report",
    "bounds_warnings",
    "check",
    "check_alone",
    "enforce",
    "minimise_parts",
    "satisfy",
]
