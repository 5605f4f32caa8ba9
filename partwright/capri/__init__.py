"""Method 2: CSG trees of quadrics (CAPRI-Net)."""

from __future__ import annotations

from partwright.capri.fitting import Fitted, fit
from partwright.capri.settings import Settings
from partwright.methods import Progress

__all__ = ["Fitted", "Progress", "Settings", "fit"]
