"""`wall_thickness`: about how thin the solid is where it is thinnest; more is better, so bound it from below.

From the centre of each face a ray goes straight inwards to the surface on the other side. The number is the
mean length over that twentieth of the surface where it is shortest, so that a sliver of the mesh is no wall.
"""

from __future__ import annotations

import numpy as np
import torch

from partwright.errors import ObjectiveError, SettingError
from partwright.goals.objective import Measure, Objective, Start, by_torch
from partwright.render.raycast import Scene

_THINNEST = 0.05  # of the surface
_OPPOSED = -0.5  # cosine between the two sides of what counts as a wall: not the tip of a wedge
_INWARDS = 1e-4  # of the longest side: where rays begin


def _wall_thickness(argument: str, start: Start) -> Measure:
    if argument:
        raise SettingError(f"wall_thickness takes no argument, got {argument!r:.40}")

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        cross = _cross(torch.tensor(vertices), torch.tensor(faces)).numpy()
        area = np.linalg.norm(cross, axis=1) / 2
        inwards = -cross / np.maximum(2 * area, np.finfo(float).tiny)[:, None]
        scene = Scene(vertices, faces)
        begin = vertices[faces].mean(axis=1) + _INWARDS * scene.size * inwards
        face, length, _ = scene.first_hit(begin, inwards)
        hit = np.flatnonzero(face >= 0)
        hit = hit[(inwards[hit] * inwards[face[hit]]).sum(axis=1) < _OPPOSED]
        if not len(hit):
            raise ObjectiveError(
                "objective wall_thickness: no two sides of the solid lie opposite each other"
            )
        order = np.argsort(length[hit], kind="stable")
        before = np.cumsum(area[hit][order]) - area[hit][order]
        thin = hit[order[before < _THINNEST * area[hit].sum()]]
        limit = float(length[thin[-1]]) + _INWARDS * scene.size
        near, far, seen = (torch.tensor(faces[some]) for some in (thin, face[thin], hit))

        def mean(x: torch.Tensor, *_: torch.Tensor) -> torch.Tensor:
            """Of the thinnest, with the derivative by their share of the area, too (Rockafellar 2000)."""
            across = _cross(x, near)
            size = across.norm(dim=1)
            to_plane = _cross(x, far)
            gap = ((x[far[:, 0]] - x[near].mean(dim=1)) * to_plane).sum(dim=1)
            wall = -gap * size / (across * to_plane).sum(dim=1)
            share = size / _cross(x, seen).norm(dim=1).sum()
            return limit + (share * (wall - limit)).sum() / _THINNEST

        result: tuple[float, np.ndarray] = by_torch(mean)(vertices, faces, labels)
        return result

    return measure


def _cross(x: torch.Tensor, faces: torch.Tensor) -> torch.Tensor:
    """(F, 3) normals as long as twice the area."""
    a, b, c = x[faces].unbind(1)
    return torch.linalg.cross(b - a, c - a)


WALL_THICKNESS = Objective(_wall_thickness, power=1, labelled=False)
