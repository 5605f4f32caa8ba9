"""Whole robots: their collision meshes become few simple shapes, and all else stays as it was."""

from __future__ import annotations

from partwright.robots.collide import Collided, CollideOptions, collide, save
from partwright.robots.opening import open_robot

__all__ = ["CollideOptions", "Collided", "collide", "open_robot", "save"]
