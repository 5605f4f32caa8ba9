"""Where a mesh's vertices can move with its surface: along one normal, or, on edges and corners, several.

A vertex on a smooth place moves with its surface along the normal. A vertex on a sharp edge lies on two
surfaces (on a corner, three or more), and stays on all of them: its velocity v solves n_k . v = s_k for the
normal speeds s_k of the sheets around it, in the least-squares sense and with the least norm. Transposed,
that shares a sensitivity out to the sheets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from partwright.rows import units
from partwright.shapes.topology import area_vectors

_SMOOTH = 0.97  # cosine between a vertex normal and the face normals around it
_INWARDS = 0.25  # of the way to a face's centre: where a sheet is looked at
_RANK = 0.03  # of the largest eigenvalue: normals that spread less than this are those of one bent surface


@dataclass(frozen=True)
class Sheets:
    """Places (S, 3) at which the surface is looked at, its normals there (S, 3) by the mesh, the vertex (S,)
    that each is of, and weights (S,)."""

    points: np.ndarray
    normals: np.ndarray
    vertex: np.ndarray
    area: np.ndarray

    def shares(self, normals: np.ndarray, sensitivity: np.ndarray) -> np.ndarray:
        """(S,) by how much a loss changes where a sheet moves along its normal by 1.

        normals: (S, 3) unit normals there. sensitivity: (V, 3) change of the loss a vertex and length.
        """
        moment = np.zeros((len(sensitivity), 3, 3))
        outer = self.area[:, None, None] * normals[:, :, None] * normals[:, None, :]
        order = np.argsort(self.vertex, kind="stable")
        vertex, first = np.unique(self.vertex[order], return_index=True)
        moment[vertex] = np.add.reduceat(outer[order], first, axis=0)
        values, vectors = np.linalg.eigh(moment)
        kept = values > _RANK * values[:, 2:]
        inverse = np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)
        pulled = np.einsum("vij,vj->vi", np.swapaxes(vectors, 1, 2), sensitivity) * inverse
        pulled = np.einsum("vij,vj->vi", vectors, pulled)
        return np.asarray(self.area * (normals * pulled[self.vertex]).sum(axis=1))


def sheets(vertices: np.ndarray, faces: np.ndarray) -> Sheets:
    """Of a mesh of vertices (V, 3) and faces (F, 3): smooth vertices themselves, sharp ones face by face."""
    corners = vertices[faces]
    cross = area_vectors(corners)
    area = np.linalg.norm(cross, axis=1) / 2
    unit = cross / np.maximum(2 * area, np.finfo(float).tiny)[:, None]
    mean = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(mean, faces[:, k], cross)
    mean = units(mean)
    least = np.ones(len(vertices))
    around = (mean[faces] * unit[:, None]).sum(axis=2)
    large = area > 1e-4 * area.mean()  # slivers have no normal to speak of
    np.minimum.at(least, faces[large].ravel(), around[large].ravel())

    smooth = np.unique(faces[least[faces] > _SMOOTH])
    face, corner = np.nonzero((least[faces] <= _SMOOTH) & large[:, None])
    sharp = faces[face, corner]
    inside = vertices[sharp] + _INWARDS * (corners[face].mean(axis=1) - vertices[sharp])
    return Sheets(
        np.concatenate([vertices[smooth], inside]),
        np.concatenate([mean[smooth], unit[face]]),
        np.concatenate([smooth, sharp]),
        np.concatenate([np.ones(len(smooth)), area[face]]),
    )
