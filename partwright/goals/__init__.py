"""Parts improved for a goal: gradients through the surface, objectives, bounds, and the search."""

from __future__ import annotations

from partwright.errors import MissingDependencyError

try:
    import torch  # noqa: F401
except ImportError as error:
    raise MissingDependencyError('goals need PyTorch: pip install "partwright[torch]"') from error

from partwright.goals.gradient import parameter_gradient
from partwright.goals.parameters import Parameters

__all__ = [
    "Parameters",
    "parameter_gradient",
]
