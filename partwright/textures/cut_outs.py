"""What of a surface is cut out by the alpha of its material: it hides nothing, and has no colour."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from partwright.render.raycast import Scene
    from partwright.textures.colours import Colours

Floats = NDArray[np.float64]

_CLEAR = 1 / 512  # opacity: less than half a byte's step is not there
_CUTOFF = 0.5  # glTF's, where a material says none
_LAYERS = 16  # that a ray passes through
_STEP = 1e-5  # of the size, by which it goes on


def cut_out(mesh: Any) -> tuple[float, Floats]:
    """Of a mesh of a glTF: how opaque it must be to be shown, 0 where all of it is, and how opaque its faces'
    corners (F, 3), or all of them (3,), are without their picture."""
    material = getattr(mesh.visual, "material", None)
    mode = getattr(material, "alphaMode", None)
    if mode not in ("MASK", "BLEND"):
        return 0.0, np.ones(3)
    said = getattr(material, "alphaCutoff", None)
    least = _CLEAR if mode == "BLEND" else _CUTOFF if said is None else float(said)
    opacity = np.ones(3)
    factor = getattr(material, "baseColorFactor", None)
    if factor is not None and len(factor) == 4:
        opacity = opacity * _share(factor)[3]
    each = mesh.visual.vertex_attributes.get("color")
    if each is not None and np.shape(each)[-1] == 4:
        opacity = opacity * _share(each)[np.asarray(mesh.faces), 3]
    return least, opacity


def first_shown(
    scene: Scene, colours: Colours, origins: Floats, rays: Floats
) -> tuple[NDArray[np.int64], Floats, Floats]:
    """As `Scene.first_hit`, of a scene of these colours' surface, without what is cut out; weights (N, 3)."""
    found, distance, uv = scene.first_hit(origins, rays)
    face, weights = found.astype(np.int64), all_three(uv)
    left = np.flatnonzero(face >= 0)
    length = np.linalg.norm(rays, axis=1)
    for _ in range(_LAYERS):
        left = left[~colours.shown(face[left], weights[left])]
        if not len(left):
            return face, distance, weights
        passed = distance[left] + _STEP * scene.size / length[left]
        found, further, uv = scene.first_hit(origins[left] + passed[:, None] * rays[left], rays[left])
        hit = np.isfinite(further)
        face[left] = np.where(hit, found.astype(np.int64), -1)
        distance[left], weights[left] = passed + further, all_three(uv)
        left = left[hit]
    face[left], distance[left] = -1, np.inf
    return face, distance, weights


def all_three(uv: NDArray[np.floating]) -> Floats:
    """Barycentric weights (N, 3) by the last two."""
    return np.column_stack([1 - uv.sum(axis=1), uv]).astype(np.float64)


def _share(values: Any) -> Floats:
    """Bytes, or shares already, as shares."""
    array = np.asarray(values)
    return array / 255 if array.dtype.kind in "iu" else array.astype(np.float64)
