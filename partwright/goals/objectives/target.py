"""`distance@FILE`: root mean square distance between the surface and that of a file, both ways."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

from partwright.errors import SettingError
from partwright.goals.objective import Measure, Objective, Start, by_torch
from partwright.shapes import MeshDistance, load_shape

_SAMPLES = 4000  # of the target's surface


def _distance(argument: str, start: Start) -> Measure:
    if not argument:
        raise SettingError("distance: expected a file after '@', as in distance@goal.stl")
    shape = load_shape(argument, unit=start.assembly.unit, up=start.assembly.up)
    return to_mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def to_mesh(target: np.ndarray, triangles: np.ndarray) -> Measure:
    """The measure of a target's vertices (V, 3) and faces (F, 3)."""
    goal = MeshDistance(target, triangles, triangles, closed=True)
    mesh = trimesh.Trimesh(target, triangles, process=False)
    samples = np.asarray(trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)[0])

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        near = torch.tensor(goal.closest(vertices), dtype=torch.float64)
        face, _ = MeshDistance(vertices, faces, faces, closed=True).nearest(samples)
        share = trimesh.triangles.points_to_barycentric(vertices[faces[face]], samples)
        share = np.clip(share, 0, 1)
        share = torch.tensor(share / share.sum(axis=1, keepdims=True))[:, :, None]
        points = torch.tensor(samples)

        def rms(x: torch.Tensor, index: torch.Tensor, _: torch.Tensor) -> torch.Tensor:
            a, b, c = x[index].unbind(1)
            area = torch.linalg.cross(b - a, c - a).norm(dim=1)
            there = (x - near).square().sum(dim=1)[index].mean(dim=1)
            back = (points - (share * x[index[torch.tensor(face)]]).sum(dim=1)).square().sum(dim=1)
            square = (area @ there / area.sum() + back.mean()) / 2
            return torch.sqrt(square + 1e-24)

        result: tuple[float, np.ndarray] = by_torch(rms)(vertices, faces, labels)
        return result

    return measure


DISTANCE = Objective(_distance, power=1, labelled=False)
