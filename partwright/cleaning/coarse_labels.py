"""Coarse labels that a file brings along: a property of its faces, or one colour a label."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partwright.errors import LabelError
from partwright.shapes import Shape
from partwright.shapes.loading import load_scene
from partwright.textures.colours import load_colours

MOST_COLOURS = 256
_INWARDS = np.array([[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]])  # barycentric places on a face
_SAME = 2  # steps of 255 by which a face's colours may differ


def property_labels(path: str | Path, name: str, faces: int) -> NDArray[np.int64]:
    """Labels (F,) that a PLY file has as an integer property of its faces.

    Raises:
        LabelError: it is no PLY, has no such property, or one of other numbers; or some of its faces were not
            read as one triangle each.
    """
    path = Path(path)
    if path.suffix.lower() != ".ply":
        raise LabelError(f"{path.name}: only PLY has properties of faces; give a file of labels instead")
    (mesh,) = load_scene(path, ".ply").geometry.values()
    rows = mesh.metadata.get("_ply_raw", {}).get("face", {}).get("data", {})
    known = list(rows.dtype.names or ()) if isinstance(rows, np.ndarray) else list(rows)
    if name not in known:
        raise LabelError(
            f"{path.name}: its faces have no property {name!r}; they have {', '.join(known) or 'none'}"
        )
    values = np.asarray(rows[name]).reshape(-1)
    if values.dtype.kind not in "iu":
        raise LabelError(f"{path.name}: the property {name!r} holds {values.dtype}, expected integers")
    if len(values) != faces:
        raise LabelError(
            f"{path.name}: {len(values)} faces have the property {name!r}, and {faces} triangles were "
            "read of them"
        )
    return values.astype(np.int64)


def colour_labels(path: str | Path, shape: Shape) -> NDArray[np.str_]:
    """Labels (F,) of `shape.input_faces`, as "#4e79a7": the colour that a face has all over. A face that runs
    from one colour into another takes that of most of its corners, or the first.

    Raises:
        NoColoursError: the file has no colours.
        LabelError: it has more than `MOST_COLOURS`, as pictures and photographs do.
    """
    colours = load_colours(path)
    corners = shape.input_vertices[shape.input_faces]
    points = np.einsum("sk,fkx->fsx", _INWARDS, corners)
    seen = colours.at(points.reshape(-1, 3)).reshape(-1, 3, 3)
    plain = np.ptp(seen, axis=1).max(axis=1) <= _SAME
    middle = np.where(plain[:, None], seen.mean(axis=1), seen[:, 0])
    rounded = np.round(middle).astype(np.int64)
    table, counts = np.unique(rounded[plain], axis=0, return_counts=True)
    if not len(table) or len(table) > MOST_COLOURS:
        many = f"{len(table):,} colours" if len(table) else "no face of one colour"
        raise LabelError(
            f"{Path(path).name}: has {many}; expected one colour a label, at most {MOST_COLOURS} of them"
        )
    table = table[np.argsort(-counts, kind="stable")]
    off = np.abs(seen[:, :, None] - table[None, None]).sum(axis=3).argmin(axis=2)
    most = np.where((off[:, 1] == off[:, 2]), off[:, 1], off[:, 0])
    names = np.array([f"#{r:02x}{g:02x}{b:02x}" for r, g, b in table])
    return names[most]
