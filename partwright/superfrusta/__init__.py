"""Method 1: assemblies of SuperFrusta by Residual Primitive Fitting."""

from __future__ import annotations

from partwright.superfrusta.method import METHOD
from partwright.superfrusta.settings import Settings

__all__ = ["METHOD", "Settings"]
