"""How good an assembly is: one measure a file, and one report."""

from __future__ import annotations

from partwright.metrics.cad import CadScores, cad_scores
from partwright.metrics.comparison import Comparison
from partwright.metrics.metric import Metric
from partwright.metrics.purity import Purity, owners, purity
from partwright.metrics.reconstruction import ReconstructionScores, mean_scores, reconstruction_scores
from partwright.metrics.report import Scores, evaluate
from partwright.metrics.stability import Stability, stability
from partwright.metrics.table import METRICS

__all__ = [
    "METRICS",
    "CadScores",
    "Comparison",
    "Metric",
    "Purity",
    "ReconstructionScores",
    "Scores",
    "Stability",
    "cad_scores",
    "evaluate",
    "mean_scores",
    "owners",
    "purity",
    "reconstruction_scores",
    "stability",
]
