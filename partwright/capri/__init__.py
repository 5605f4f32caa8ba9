"""Method 2: CSG trees of quadrics (CAPRI-Net)."""

from __future__ import annotations

from partwright.capri.method import METHOD
from partwright.capri.settings import Settings

__all__ = ["METHOD", "Settings"]
