"""Colours of a shape as maps of its parts: each in its part's own coordinates, so that it survives edits.

SuperFrusta, section 5, has a spherical map for each primitive. Here a map is octahedral: a square that the
directions from a part's middle are folded onto, measured in shares of the part's own size, along its bent
axis. What moves, stretches, tapers or bends a part takes its map along. A hollow part has two: the second is
of its inner side.
"""

from __future__ import annotations

from partwright.textures.baking import bake, bake_both
from partwright.textures.colours import Colours, load_colours
from partwright.textures.maps import PartMap, part_map

__all__ = ["Colours", "PartMap", "bake", "bake_both", "load_colours", "part_map"]
