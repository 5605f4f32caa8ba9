"""What every method returns: parts, assemblies of them, edits, and the file they are kept in."""

from __future__ import annotations

from partwright.assembly.files import load_assembly
from partwright.assembly.mirroring import mirrored
from partwright.assembly.repeated_groups import copies_of, line, ring
from partwright.assembly.similarity import Similarity
from partwright.assembly.tree import Assembly, Node, Part

__all__ = ["Assembly", "Node", "Part", "Similarity", "copies_of", "line", "load_assembly", "mirrored", "ring"]
