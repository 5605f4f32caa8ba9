"""Small CAD parts with known trees."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.transformations import rotation_matrix


def drilled_plate() -> trimesh.Trimesh:
    """A plate of 2 x 1.4 x 0.3 with two holes of radius 0.2: ten quadrics, genus 2."""
    plate = trimesh.creation.box((2.0, 1.4, 0.3))
    holes = [
        trimesh.creation.cylinder(0.2, 1.0, sections=64, transform=_at((x, 0.1, 0))) for x in (-0.5, 0.5)
    ]
    return trimesh.boolean.difference([plate, *holes])


def bracket() -> trimesh.Trimesh:
    """An L of two slabs, with a hole."""
    parts = [
        trimesh.creation.box((2.0, 0.8, 0.3)),
        trimesh.creation.box((0.3, 0.8, 1.2), transform=_at((-0.85, 0, 0.45))),
    ]
    hole = trimesh.creation.cylinder(0.2, 1.0, sections=64, transform=_at((0.5, 0, 0)))
    return trimesh.boolean.difference([trimesh.boolean.union(parts), hole])


def tilted_rod() -> trimesh.Trimesh:
    """A cylinder along no coordinate axis."""
    return trimesh.creation.cylinder(0.4, 2.0, sections=96, transform=rotation_matrix(0.7, (1, 0.5, 0.2)))


def _at(place: tuple[float, float, float]) -> np.ndarray:
    return np.asarray(trimesh.transformations.translation_matrix(place))
