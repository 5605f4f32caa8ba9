"""`fit`: a shape in, an assembly with its scores, report and files out."""

from __future__ import annotations

from partwright.fitting.options import Clean, Start, Tolerance
from partwright.fitting.result import FILES, Result
from partwright.fitting.workflow import fit, fit_nodes

__all__ = ["FILES", "Clean", "Result", "Start", "Tolerance", "fit", "fit_nodes"]
