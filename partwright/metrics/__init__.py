"""How good an assembly is: one measure a file, and one report."""

from __future__ import annotations

from partwright.metrics.report import Scores, evaluate

__all__ = ["Scores", "evaluate"]
