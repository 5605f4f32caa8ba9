"""`keep_out@x0,y0,z0,x1,y1,z1`: volume of the solid within boxes (several with ";") that are to stay free."""

from __future__ import annotations

import numpy as np
import trimesh

from partwright.errors import SettingError
from partwright.goals.objective import Measure, Objective, Start
from partwright.meshing.thin_parts import as_manifold
from partwright.shapes.topology import area_vectors


def _boxes(argument: str) -> np.ndarray:
    """(B, 2, 3) lower and upper corners."""
    try:
        boxes = np.array([[float(v) for v in one.split(",")] for one in argument.split(";")])
    except ValueError:
        boxes = np.zeros((0, 0))
    if boxes.shape[1:] != (6,) or not np.isfinite(boxes).all() or not (boxes[:, 3:] > boxes[:, :3]).all():
        raise SettingError(
            f"keep_out: expected boxes as x0,y0,z0,x1,y1,z1 (lower corner, upper corner; several with ';') "
            f"after '@', got {argument!r:.60}"
        )
    return boxes.reshape(-1, 2, 3)


def _keep_out(argument: str, start: Start) -> Measure:
    from manifold3d import Manifold

    boxes = _boxes(argument)
    solids = [Manifold.cube(tuple(high - low)).translate(tuple(low)) for low, high in boxes]

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        solid = as_manifold(trimesh.Trimesh(vertices, faces, process=False))
        corners = vertices[faces]
        third = area_vectors(corners) / 6
        area = np.zeros_like(vertices)
        for k in range(3):
            np.add.at(area, faces[:, k], third)
        value, sensitivity = 0.0, np.zeros_like(vertices)
        for (low, high), box in zip(boxes, solids, strict=True):
            value += (solid ^ box).volume()
            within = ((vertices >= low) & (vertices <= high)).all(axis=1)
            sensitivity[within] += area[within]
        return value, sensitivity

    return measure


KEEP_OUT = Objective(_keep_out, power=3, labelled=False)
