"""Method 2: CSG trees of quadrics (CAPRI-Net)."""

from __future__ import annotations

from partwright.capri.fitting import Fitted, Progress, fit
from partwright.capri.settings import Settings

__all__ = ["Fitted", "Progress", "Settings", "fit"]
