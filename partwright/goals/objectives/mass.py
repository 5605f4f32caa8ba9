"""`volume`, `mass@DENSITY`, `centre@AXIS`, `inertia@AXIS`: moments of the solid, exact over its mesh."""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.errors import SettingError
from partwright.goals.objective import Measure, Objective, Start, by_torch
from partwright.goals.objectives.axes import axis
from partwright.shapes import METRES


def moments(x: Tensor, faces: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Volume, centre (3,) and inertia (3, 3) about it, of density 1: sums over tetrahedra (Tonon 2004)."""
    middle = x.detach().mean(dim=0)
    a, b, c = (x - middle)[faces].unbind(1)
    six = (a * torch.linalg.cross(b, c)).sum(dim=1)
    volume, total = six.sum() / 6, a + b + c
    centre = six @ total / 24 / volume
    products = torch.stack([(p.T * six) @ p for p in (a, b, c, total)]).sum(dim=0) / 120
    products = products - volume * torch.outer(centre, centre)
    eye = torch.eye(3, dtype=x.dtype)
    return volume, centre + middle, products.trace() * eye - products


def _volume(argument: str, start: Start) -> Measure:
    if argument:
        raise SettingError(f"volume takes no argument, got {argument!r:.40}")
    return by_torch(lambda x, faces, labels: moments(x, faces)[0])


def _mass(argument: str, start: Start) -> Measure:
    """In kilograms where the unit is known: the density is in kg/m3."""
    try:
        density = float(argument or 1000.0)
    except ValueError:
        density = 0.0
    if not 0 < density < 1e12:
        raise SettingError(
            f"mass: expected a density (kg/m3) after '@', got {argument!r:.40}; steel has 7850"
        )
    factor = density * METRES[start.assembly.unit] ** 3 if start.assembly.unit in METRES else density
    return by_torch(lambda x, faces, labels: factor * moments(x, faces)[0])


def _centre(argument: str, start: Start) -> Measure:
    along = torch.tensor(axis(argument, "z", "centre"))
    return by_torch(lambda x, faces, labels: moments(x, faces)[1] @ along)


def _inertia(argument: str, start: Start) -> Measure:
    along = torch.tensor(axis(argument, "z", "inertia"))
    return by_torch(lambda x, faces, labels: along @ moments(x, faces)[2] @ along)


VOLUME, MASS = Objective(_volume, power=3, labelled=False), Objective(_mass, power=3, labelled=False)
CENTRE, INERTIA = Objective(_centre, power=1, labelled=False), Objective(_inertia, power=5, labelled=False)
