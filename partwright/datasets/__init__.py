"""Shapes that the project makes itself, and folders of yours, prepared for training."""

from __future__ import annotations

from partwright.datasets.families import FAMILIES, FamilyShape, family

__all__ = ["FAMILIES", "FamilyShape", "family"]
