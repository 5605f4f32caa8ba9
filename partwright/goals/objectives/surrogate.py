"""`surrogate_drag@FILE`: drag area by a network that has learned from simulations (`parts train-surrogate`).

It is a prediction: `--simulate` says what a gain is worth, and `outside` whether the body is like those that
were learned from.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
import trimesh
from torch import Tensor

from partwright.errors import SettingError
from partwright.goals.flow.surrogate import Spread, Surrogate, placed
from partwright.goals.objective import Measure, Objective, Start
from partwright.shapes import METRES
from partwright.shapes.topology import doubled_areas

_DRAWS = 4  # of points, of which the mean is taken


def predicted(
    model: Surrogate, vertices: Tensor, faces: np.ndarray, metres: float, spreads: Sequence[Spread] = ()
) -> tuple[Tensor, float]:
    """Drag area () in the square of the vertices' unit, which has this many metres; and how far the body is
    outside of what the model has learned from, see `Surrogate.outside`.

    spreads: of the points at which the network looks; else draws that follow the area of the faces.
    """
    x = (metres * vertices).float()
    index = torch.tensor(faces)
    rows = [spread.on(x, index) for spread in spreads or drawn(vertices.detach().numpy(), faces)]
    points, normals, area = (torch.stack(one) for one in zip(*rows, strict=True))
    drag, _, whole = model.drag(placed(points, model.air, x), normals, area)
    return drag.mean() / metres**2, model.outside(whole.detach().mean(dim=0))


def drawn(vertices: np.ndarray, faces: np.ndarray) -> list[Spread]:
    """Draws of points over a surface."""
    areas = doubled_areas(vertices, faces)
    return [Spread.over(areas, seed) for seed in range(_DRAWS)]


def outside(model: Surrogate, surface: trimesh.Trimesh, metres: float) -> float:
    """How far a body is outside of what the model has learned from; above 1, do not believe it."""
    with torch.no_grad():
        return predicted(model, torch.tensor(np.array(surface.vertices)), np.array(surface.faces), metres)[1]


def _surrogate(argument: str, start: Start) -> Measure:
    if not argument:
        raise SettingError("surrogate_drag: expected a model's file, as in surrogate_drag@cars.safetensors")
    model = Surrogate.load(argument)
    metres = METRES.get(start.assembly.unit or "m", 1.0)

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        x = torch.tensor(vertices, dtype=torch.float64, requires_grad=True)
        drag, _ = predicted(model, x, faces, metres)
        (slope,) = torch.autograd.grad(drag, x)
        return float(drag.detach()), slope.numpy()

    return measure


SURROGATE_DRAG = Objective(_surrogate, power=2, labelled=False)
