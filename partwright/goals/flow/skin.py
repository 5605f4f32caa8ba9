"""What a flow leaves on a body's surface: numbers a face of the simulation's own mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from partwright.errors import SimulationError

_NEAREST = 4  # faces of the simulation that a face of ours takes its number from


@dataclass(frozen=True)
class Skin:
    """A body as the simulation meshed it: vertices (V, 3) in metres, faces (F, 3), fields (F,) by name."""

    vertices: np.ndarray
    faces: np.ndarray
    fields: dict[str, np.ndarray]

    def at(self, name: str, points: np.ndarray) -> np.ndarray:
        """(N,) of a field at points (N, 3), in metres: of the nearest faces, the nearer the more."""
        from scipy.spatial import cKDTree

        centres = self.vertices[self.faces].mean(axis=1)
        distance, index = cKDTree(centres).query(points, k=min(_NEAREST, len(centres)))
        distance, index = distance.reshape(len(points), -1), index.reshape(len(points), -1)
        weight = 1 / np.maximum(distance, 1e-9) ** 2
        return np.asarray((weight * self.fields[name][index]).sum(axis=1) / weight.sum(axis=1))


def read_vtk(path: Path) -> Skin:
    """Of a triangulated surface in a legacy VTK file, ASCII, with numbers a face.

    Raises:
        SimulationError: it is something else, or a number is not finite.
    """
    words = path.read_text(encoding="utf-8").split()
    try:
        start = words.index("POINTS")
        count = int(words[start + 1])
        vertices = np.array(words[start + 3 : start + 3 + 3 * count], dtype=np.float64).reshape(-1, 3)
        start = words.index("POLYGONS")
        count = int(words[start + 1])
        faces = np.array(words[start + 3 : start + 3 + 4 * count], dtype=np.int64).reshape(-1, 4)[:, 1:]
        start = words.index("FIELD", words.index("CELL_DATA"))
        fields, place = {}, start + 3
        for _ in range(int(words[start + 2])):
            name, width = words[place], int(words[place + 1])
            end = place + 4 + width * count
            if width == 1:
                fields[name] = np.array(words[place + 4 : end], dtype=np.float64)
            place = end
    except (ValueError, IndexError) as error:
        raise SimulationError(
            f"{path}: expected a triangulated surface with numbers a face: {error}"
        ) from error
    if not all(np.isfinite(values).all() for values in (vertices, *fields.values())):
        raise SimulationError(f"{path}: the flow on the body is not finite: it diverged")
    return Skin(vertices, faces, fields)
