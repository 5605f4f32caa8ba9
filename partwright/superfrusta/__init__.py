"""Method 1: assemblies of SuperFrusta by Residual Primitive Fitting."""

from __future__ import annotations

from partwright.superfrusta.resfit import CurvePoint, Fitted, Progress, fit
from partwright.superfrusta.settings import Settings

__all__ = ["CurvePoint", "Fitted", "Progress", "Settings", "fit"]
