"""What makes assemblies, and shapes by them, better after the fit."""

from __future__ import annotations

from partwright.cleaning.segmentation import segment

__all__ = ["segment"]
