"""What makes assemblies, and shapes by them, better after the fit."""

from __future__ import annotations

from partwright.cleaning.relations import Relation
from partwright.cleaning.segmentation import segment
from partwright.cleaning.tidying import Cleaned, checked_tolerance, clean

__all__ = ["Cleaned", "Relation", "checked_tolerance", "clean", "segment"]
