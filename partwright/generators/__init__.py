"""Pictures to shapes, by a generator of somebody else's: a command, or an HTTP service."""

from __future__ import annotations

from partwright.generators.generating import GENERATED, TIME_LIMIT, shape_from_image

__all__ = ["GENERATED", "TIME_LIMIT", "shape_from_image"]
