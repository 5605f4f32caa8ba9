"""Parts improved for a goal: gradients through the surface, objectives, bounds, and the search."""

from __future__ import annotations

from partwright.errors import MissingDependencyError

try:
    import torch  # noqa: F401
except ImportError as error:
    raise MissingDependencyError('goals need PyTorch: pip install "partwright[torch]"') from error

from partwright.goals.gradient import parameter_gradient
from partwright.goals.objective import Objective, Start, by_torch
from partwright.goals.optimising import Optimised, optimise
from partwright.goals.parameters import Parameters
from partwright.goals.problem import Options
from partwright.goals.search import Step
from partwright.goals.table import OBJECTIVES
from partwright.goals.wanted import Bound, Wanted

__all__ = [
    "OBJECTIVES",
    "Bound",
    "Objective",
    "Optimised",
    "Options",
    "Parameters",
    "Start",
    "Step",
    "Wanted",
    "by_torch",
    "optimise",
    "parameter_gradient",
]
