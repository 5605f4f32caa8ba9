"""CAD parts that the project makes itself, as many as asked, each with the tree that it was made by.

`python -m partwright.datasets.cad_parts FOLDER --count 1000` writes them.
"""

from __future__ import annotations

from partwright.datasets.cad_parts.drawing import KINDS, CadPart, cad_part, cad_parts, write_cad_parts

__all__ = ["KINDS", "CadPart", "cad_part", "cad_parts", "write_cad_parts"]
