"""What makes assemblies, and shapes by them, better after the fit."""

from __future__ import annotations

from partwright.cleaning.pipeline import Cleaned, checked_tolerance, clean
from partwright.cleaning.relations import Relation
from partwright.cleaning.segmentation import segment

__all__ = ["Cleaned", "Relation", "checked_tolerance", "clean", "segment"]
