"""Agreement of two surfaces as they look: silhouettes and normals from eight sides."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from partwright.metrics.iou import occupancy_iou
from partwright.render.camera import View
from partwright.render.raycast import Scene

SIDE = 256  # pixels
_CORNER = 2.0  # the eyes are the corners of [-2, 2]^3
_HALF = 0.55  # of the picture at distance 1: it just holds a ball of radius 1.65, and so the unit frame


def image_consistency(first: Scene, second: Scene, side: int = SIDE) -> float:
    """`image_consistency`: mean over eight views of the silhouettes' IoU times the mean cosine of the normals
    (Guillard et al. 2022; PartSDF, eq. 14).

    The eyes are the corners of [-2, 2]^3 and look at the origin, unit frame; 256 x 256 pixels. Normals are
    the triangles' own; their cosine is averaged over the pixels where both surfaces are seen, 0 where there
    are none.
    """
    scores = []
    for view in views():
        rays = view.rays(side, side)
        (one, normal), (other, other_normal) = _seen(first, view, rays), _seen(second, view, rays)
        both = one & other
        cosine = np.einsum("nd,nd->n", normal[both], other_normal[both])
        scores.append(occupancy_iou(one, other) * float(cosine.mean()) if both.any() else 0.0)
    return float(np.mean(scores))


def views() -> list[View]:
    """The eight cameras."""
    result = []
    for corner in product((-1.0, 1.0), repeat=3):
        back = np.array(corner) / np.sqrt(3)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        result.append(View(_CORNER * np.array(corner), right, np.cross(back, right), back, (_HALF, _HALF)))
    return result


def _seen(
    scene: Scene, view: View, rays: NDArray[np.float32]
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Whether each ray meets the surface (N,), and the normal (N, 3) of the triangle that it meets first."""
    face, _, _ = scene.first_hit(np.broadcast_to(view.eye, rays.shape), rays)
    return face >= 0, scene.face_normals[face]
