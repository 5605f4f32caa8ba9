"""From a loss on a surface's vertices to all parameters, by the implicit function theorem.

A point of the surface f(x; p) = 0 moves along its normal n by dn/dp = -(df/dp) / |grad f| (PartSDF, section
4.4, after Remelli et al. 2020, MeshSDF). How the surface was meshed does not matter, so that it can be meshed
anew, with another topology, at each step.
"""

from __future__ import annotations

import numpy as np
import torch

from partwright.errors import ParameterError
from partwright.goals.composite import Composite
from partwright.goals.parameters import Parameters
from partwright.goals.sheets import sheets

_BELOW = 1e-6  # of the longest side, inwards: on the surface itself a distance from outside has no slope
_FLAT = 1e-6  # a slope of the field below this has no direction


def parameter_gradient(
    parameters: Parameters, vertices: np.ndarray, faces: np.ndarray, sensitivity: np.ndarray
) -> np.ndarray:
    """(D,) derivative of a loss by the parameters, in their own units; (L, D) of L losses.

    vertices (V, 3), faces (F, 3): the assembly's surface, as `mesh_assembly` makes it. sensitivity: (V, 3)
    derivative of the loss by each vertex, or (L, V, 3).

    Raises:
        ParameterError: the sensitivity has another shape, or is not finite.
    """
    vertices, sensitivity = np.asarray(vertices, np.float64), np.asarray(sensitivity, np.float64)
    if sensitivity.shape[-2:] != vertices.shape or sensitivity.ndim > 3 or not np.isfinite(sensitivity).all():
        raise ParameterError(
            f"sensitivity: expected finite numbers of shape {vertices.shape}, got {sensitivity.shape}"
        )
    felt = sheets(vertices, np.asarray(faces))
    below = felt.points - _BELOW * parameters.longest * felt.normals
    points = torch.tensor(below, requires_grad=True)
    theta = torch.tensor(parameters.values, requires_grad=True)
    value = Composite(parameters).distance(points, theta)
    (slope,) = torch.autograd.grad(value.sum(), points, retain_graph=True)
    steepness = np.linalg.norm(slope.numpy(), axis=1)
    normals = slope.numpy() / np.maximum(steepness, _FLAT)[:, None]
    rows = []
    for one in sensitivity.reshape(-1, *vertices.shape):
        shares = felt.shares(normals, one)
        weight = np.where(steepness > _FLAT, -shares / np.maximum(steepness, _FLAT), 0.0)
        (gradient,) = torch.autograd.grad(value @ torch.tensor(weight), theta, retain_graph=True)
        rows.append(gradient.numpy())
    return np.array(rows).reshape(*sensitivity.shape[:-2], len(parameters))
