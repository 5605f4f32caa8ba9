"""Small meshes whose volume, distance and defects are known by hand."""

from __future__ import annotations

import numpy as np
import trimesh


def box(extents=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation(centre)
    return mesh


def sphere(radius=1.0, subdivisions=4) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def inverted(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def together(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    offsets = np.cumsum([0] + [len(m.vertices) for m in meshes])
    return trimesh.Trimesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=False)]),
        process=False,
    )


def without(mesh: trimesh.Trimesh, dropped: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[~dropped], process=False)


def box_distance(points: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Exact signed distance of a box centred at the origin."""
    q = np.abs(points) - half
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


SIDES = np.array([1.8, 1.2, 0.9])  # unit lengths


def blinds(gap: float, pitch: float = 0.05, sides: np.ndarray = SIDES) -> trimesh.Trimesh:
    """A box of slats, `gap` of each `pitch` along x or y left out of every side, its own edges too."""
    slats = []
    for axis in range(3):
        across, along = (1, 2) if axis == 0 else (0, 3 - axis)
        starts = np.arange(-sides[across] / 2, sides[across] / 2 - 1e-9, pitch)
        for end in (-1, 1):
            for start in starts + gap / 2:
                corners = np.zeros((4, 3))
                corners[:, axis] = end * sides[axis] / 2
                corners[:, across] = start + (pitch - gap) * np.array([0, 1, 1, 0])
                corners[:, along] = (sides[along] - gap) / 2 * np.array([-1, -1, 1, 1])
                slats.append(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False))
    return trimesh.util.concatenate(slats)
