"""How good an assembly is: one measure a file, and one report."""

from __future__ import annotations

from partwright.metrics.purity import Purity, owners, purity
from partwright.metrics.report import Scores, evaluate
from partwright.metrics.stability import Stability, stability

__all__ = ["Purity", "Scores", "Stability", "evaluate", "owners", "purity", "stability"]
