"""Families: shapes of one kind, made of the same named parts, as many and as varied as asked."""

from __future__ import annotations

from partwright.datasets.families.recipes import FAMILIES, FamilyShape, family

__all__ = ["FAMILIES", "FamilyShape", "family"]
