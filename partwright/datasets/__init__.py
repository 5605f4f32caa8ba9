"""Shapes that the project makes itself, and folders of yours, prepared for training."""

from __future__ import annotations

from partwright.datasets.families import FAMILIES, FamilyShape, family
from partwright.datasets.prepared import PreparedFamily
from partwright.datasets.preparing import Preparation, prepare

__all__ = ["FAMILIES", "FamilyShape", "Preparation", "PreparedFamily", "family", "prepare"]
