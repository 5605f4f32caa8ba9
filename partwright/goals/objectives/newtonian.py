"""`newtonian_drag@AXIS`: drag area of Newtonian flow along an axis. This is no CFD.

The pressure coefficient is 2 cos^2 of the angle between the flow and the inward normal on faces that the flow
meets and reaches unhindered, and 0 elsewhere (Anderson, Hypersonic and High-Temperature Gas Dynamics, section
3.2). It knows neither wakes nor friction nor suction: below hypersonic speed it ranks bluff fronts, and that
is all. Its number is C_d times the area, a force over the dynamic pressure.
"""

from __future__ import annotations

import numpy as np
import torch

from partwright.goals.objective import Measure, Objective, Start, by_torch
from partwright.goals.objectives.axes import axis
from partwright.render.raycast import Scene
from partwright.shapes.topology import area_vectors

_OFF = 1e-4  # of the longest side: where rays against the flow begin


def pressure(vertices: np.ndarray, faces: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """(F,) pressure coefficient of each face, 0 to 2. flow: (3,) unit vector along which the air moves."""
    corners = vertices[faces]
    cross = area_vectors(corners)
    length = np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), np.finfo(float).tiny)
    facing = -(cross / length) @ flow
    scene = Scene(vertices, faces)
    begin = corners.mean(axis=1) + _OFF * scene.size * (cross / length)
    shaded = scene.occluded(begin, np.broadcast_to(-flow, begin.shape))
    return np.where((facing > 0) & ~shaded, 2 * facing**2, 0.0)


def _newtonian(argument: str, start: Start) -> Measure:
    flow = axis(argument, "x", "newtonian_drag")
    along = torch.tensor(flow)

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        met = torch.tensor(faces[pressure(vertices, faces, flow) > 0])

        def drag(x: torch.Tensor, *_: torch.Tensor) -> torch.Tensor:
            a, b, c = x[met].unbind(1)
            cross = torch.linalg.cross(b - a, c - a) / 2
            towards = -(cross @ along)
            return (2 * towards**3 / cross.square().sum(dim=1)).sum()

        result: tuple[float, np.ndarray] = by_torch(drag)(vertices, faces, labels)
        return result

    return measure


NEWTONIAN_DRAG = Objective(_newtonian, power=2, labelled=False)
