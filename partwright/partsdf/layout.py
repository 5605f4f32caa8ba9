"""How parts lie to one another: whether a shape's poses, taken together, are such as its family has."""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import PartVectors, covariance


@torch.no_grad()
def layout_oddness(shape: NeuralShape) -> float:
    """The Mahalanobis distance of the poses of all parts that are there, as one vector, from the mean of the
    training shapes', as a multiple of what these come to, each by the spread of the others (root mean
    square); 0 where there are fewer than two of these.

    Single parts of a stranger may look and lie as some training shape's do, all together they do not: a car
    that chairs' parts are laid around has a back as low as a bench's below arms as high as an armchair's.
    """
    model = shape.model
    count = len(model.latents)
    if count < 2:
        return 0.0
    vectors = PartVectors.of(model)
    known = together(vectors.of_poses(model.poses), model.present)
    factor = torch.linalg.cholesky(covariance(known))

    def squared(rows: Tensor) -> Tensor:
        return torch.linalg.solve_triangular(factor, rows.T, upper=False).square().sum(dim=0)

    own = squared(known)
    # By the spread without the row itself (Sherman and Morrison).
    usual = (own / (1 - own / count).clamp(min=1.0 / count)).mean()
    found = squared(together(vectors.of_poses(shape.poses)[None], shape.present[None]))
    return float((found[0] / usual.clamp(min=1e-12)).sqrt())


def together(poses: Tensor, present: Tensor) -> Tensor:
    """(S, P 12) of poses' numbers (S, P, 12); a part that is not there lies as is usual."""
    return torch.where(present[..., None], poses, 0.0).flatten(1).double()
