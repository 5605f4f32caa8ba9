"""Method 1: assemblies of SuperFrusta by Residual Primitive Fitting."""

from __future__ import annotations

from partwright.methods import Progress
from partwright.superfrusta.outcome import CurvePoint, Fitted
from partwright.superfrusta.resfit import fit
from partwright.superfrusta.settings import Settings

__all__ = ["CurvePoint", "Fitted", "Progress", "Settings", "fit"]
