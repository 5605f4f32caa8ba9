"""What an objective is: a number of a surface, and by how much each vertex changes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import torch
import trimesh
from torch import Tensor

from partwright.assembly import Assembly
from partwright.errors import ObjectiveError

Measure: TypeAlias = Callable[[np.ndarray, np.ndarray, np.ndarray], Any]
"""From vertices (V, 3), faces (F, 3) and labels (F,), which part's surface each face is, to a number, or to a
number and its derivative by the vertices (V, 3)."""


@dataclass(frozen=True)
class Start:
    """What an objective may want to know before the first step. Lengths are in the assembly's own units."""

    assembly: Assembly
    surface: trimesh.Trimesh
    longest: float


@dataclass(frozen=True)
class Objective:
    """An objective by name, as tables list it.

    prepare: from its argument (what follows "@"; "" where nothing does) and the start to the measure. Raises
    SettingError for an argument that it cannot use. power: of length, in which it is measured (a volume: 3).
    labelled: whether it asks which part a face is of. Labels are all 0 where no objective does.
    """

    prepare: Callable[[str, Start], Measure]
    power: int
    labelled: bool = True


@dataclass(frozen=True)
class Measured:
    """A number and its derivative by the vertices (V, 3)."""

    value: float
    sensitivity: np.ndarray


def by_torch(function: Callable[[Tensor, Tensor, Tensor], Tensor]) -> Measure:
    """A measure of a function of tensors (vertices in float64, faces, labels) that gives a number."""

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        x = torch.tensor(vertices, dtype=torch.float64, requires_grad=True)
        value = function(x, torch.tensor(faces), torch.tensor(labels))
        if not (isinstance(value, Tensor) and value.requires_grad):
            raise ObjectiveError("a function of tensors gave a number that does not depend on the vertices")
        (slope,) = torch.autograd.grad(value, x)
        return float(value.detach()), slope.numpy()

    return measure


def measured(name: str, measure: Measure, surface: trimesh.Trimesh, labels: np.ndarray) -> Measured:
    """What a measure says of a surface, checked.

    Raises:
        ObjectiveError: it fails, its number is not finite, or it has no derivative, or one of another shape.
    """
    vertices, faces = np.array(surface.vertices), np.array(surface.faces)
    try:
        answer = measure(vertices, faces, labels)
        value, slope = answer if isinstance(answer, tuple) else (answer, None)
        number = float(value)
        slope = None if slope is None else np.asarray(slope, dtype=np.float64)
    except Exception as error:
        if isinstance(error, ObjectiveError):
            raise
        raise ObjectiveError(f"objective {name}: it failed: {type(error).__name__}: {error}") from error
    if not np.isfinite(number):
        raise ObjectiveError(f"objective {name}: its number is {number}; expected a finite one")
    if slope is None:
        raise ObjectiveError(
            f"objective {name}: it gives no gradient; return a number and its derivative by the vertices "
            "(V, 3), or wrap a function of tensors by partwright.goals.by_torch"
        )
    if slope.shape != vertices.shape:
        raise ObjectiveError(
            f"objective {name}: its derivative is of shape {slope.shape}; expected that of the vertices, "
            f"{vertices.shape}"
        )
    if not np.isfinite(slope).all():
        count = int((~np.isfinite(slope).all(axis=1)).sum())
        raise ObjectiveError(
            f"objective {name}: its derivative is not finite at {count} of {len(vertices)} vertices"
        )
    return Measured(number, slope)
