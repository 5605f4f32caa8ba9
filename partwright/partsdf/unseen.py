"""Parts that points do not show because a piece of the shape was not scanned, but that its family has.

A part without points is missing from the shape or from the scan. Which of the two is judged by the sets of
parts that training shapes have (Bayes): each with the same seen parts is the less likely, the more of its
others would lie beside those stretches of the seen parts' surface that do have points. A part that is likely
is put where it is most likely to be, given the poses of the seen ones: of made chairs' legs, cars' wheels and
mixers' attach points that explains 93 to 98 % of the variance, of chairs' backs 79. Its form is that of the
training shape whose seen parts are most alike: of one another's latents parts tell next to nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import PartVectors, covariance
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import Frame

LIKELY = 0.8  # that a part is there, at least
_SHOWS = 3.0  # logarithm of how much less likely a part is that would lie beside points alone, and has none
_BARE = 0.02  # of the seen parts' surface that has no points, where a piece is missing, at least
_PLACES = 4000  # in and around each part's cuboid
_ON = 0.02  # unit lengths from the surface, that places on it are at most
_NOISE = 3.0  # mean distances of points from the parts' surface
_PLANE = 0.95  # of either kind's places on their side of a plane, on average, for the scan to end there
_COVERED = 2.0  # sides of the square that a point stands for: of random ones 3 in a million are farther apart


@torch.no_grad()
def with_unseen(shape: NeuralShape, target: Target) -> NeuralShape:
    """A shape as found in points, and with it the parts that these do not show, but that it is likely to
    have; the same where a surface was known, or points cover the parts that were found."""
    model, seen = shape.model, shape.present
    sets = model.present[model.present[:, seen].all(dim=1)]
    wanted = ~seen & sets.any(dim=0)
    if target.low is None or not bool(seen.any()) or not bool(wanted.any()):
        return shape
    placed = _placed(shape, wanted)
    beside = _beside_points(placed, seen, wanted, target)
    if beside is None:
        return shape
    others = torch.zeros(len(model.parts))
    others[wanted] = beside
    # Beside what was trained on, what was found may be all that there is.
    sets = torch.cat([sets, seen[None]])
    weight = torch.exp(-_SHOWS * (sets.float() @ others))
    likely = (weight @ sets.float()) / weight.sum() >= LIKELY
    return _joined(shape, placed, likely & wanted)


def _placed(shape: NeuralShape, parts: Tensor) -> NeuralShape:
    """With the `parts` (P,), of which some training shape with the same others has each, where they are most
    likely, given the poses of those that are there."""
    model, seen = shape.model, shape.present
    vectors = PartVectors.of(model)
    own = PartVectors(*(t[seen] for t in vars(vectors).values()))
    frame = Frame.of(own, shape.poses.map(lambda t: t[seen]))
    poses, forms = vectors.of_poses(frame.to_family(shape.poses)), vectors.of_latents(shape.latents)
    trained = vectors.of_poses(model.poses)
    alike = torch.cat([trained - poses, vectors.of_latents(model.latents) - forms], dim=2)[:, seen]
    distance = alike.flatten(1).norm(dim=1)
    latents = shape.latents.clone()
    for part in parts.nonzero().squeeze(1).tolist():
        rows = model.present[:, seen].all(dim=1) & model.present[:, part]
        known = trained[rows]
        poses[part] = _told_by(known[:, seen].flatten(1), known[:, part], poses[seen].flatten())
        latents[part] = model.latents[distance.masked_fill(~rows, torch.inf).argmin(), part]
    other = replace(shape, latents=latents, poses=frame.from_family(vectors.poses(poses)))
    return _joined(shape, other, parts)


def _told_by(given: Tensor, wanted: Tensor, seen: Tensor) -> Tensor:
    """The conditional mean (K,) of normal numbers, given others `seen` (D,), by samples of these (S, D) and
    of the wanted ones (S, K)."""
    given, wanted, seen = given.double(), wanted.double(), seen.double()
    middle, mean = given.mean(dim=0), wanted.mean(dim=0)
    off = given - middle
    weights = torch.linalg.solve(covariance(off), off.T @ (wanted - mean) / len(off))
    return (mean + (seen - middle) @ weights).float()


def _beside_points(shape: NeuralShape, seen: Tensor, parts: Tensor, target: Target) -> Tensor | None:
    """(Q,) share of the surface of each of the Q `parts` to which the surface of the `seen` ones is nearest
    where it has points, and which is not on the far side of where these end; None where it has them
    everywhere."""
    points = np.unique(target.points[target.sdf <= 0].numpy(), axis=0)
    names = np.array(shape.model.parts)
    visible = replace(shape, present=seen)
    places = np.concatenate([visible.places(name, _PLACES) for name in names[seen.numpy()]])
    places = places[np.abs(visible.distances(places)) < _ON]
    if len(points) < 2 or not len(places):
        return None
    cloud, surface = cKDTree(points), cKDTree(places)
    side = 2 * float(cloud.query(points, k=2)[0][:, 1].mean())  # twice the mean distance of random ones
    noise = float(np.abs(visible.distances(points.astype(np.float32))).mean())
    covered = cloud.query(places)[0] <= _COVERED * side + _ON + _NOISE * noise
    if covered.mean() > 1 - _BARE:
        return None
    shares, on_that_side = [], _side(places, covered)
    for part in parts.nonzero().squeeze(1).tolist():
        alone = replace(shape, present=torch.arange(len(names)) == part)
        own = alone.places(names[part], _PLACES)
        own = own[alone.distances(own) < _ON]
        scanned = covered[surface.query(own)[1]]
        shares.append(float((scanned & (on_that_side(own) > 0)).mean()) if len(own) else 1.0)
    return torch.tensor(shares)


def _side(places: np.ndarray, covered: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Where a scan ends at a plane: of places (M, 3), above 0 on the scan's side, below 0 beyond (M,); else
    1 everywhere.

    The plane is that which best tells which of the `places` (N, 3) on the seen parts' surface are `covered`
    (N,) by points, by least squares with as much weight for either kind. A leg that stands out of a scanned
    seat into what was not scanned is nearest to the seat, and yet no point shows that it is not there.
    """
    ones = np.ones((len(places), 1))
    weight = np.where(covered, 0.5 / max(covered.sum(), 1), 0.5 / max((~covered).sum(), 1))
    rows, wanted = np.hstack([places, ones]), np.where(covered, 1.0, -1.0)
    plane = np.linalg.lstsq(rows * np.sqrt(weight)[:, None], wanted * np.sqrt(weight), rcond=None)[0]
    right = float(weight[(rows @ plane > 0) == covered].sum())
    if right < _PLANE:
        return lambda other: np.ones(len(other))
    return lambda other: np.asarray(other @ plane[:3] + plane[3])


def _joined(shape: NeuralShape, other: NeuralShape, parts: Tensor) -> NeuralShape:
    """With the `parts` (P,) of another shape."""
    poses = PoseTensors(
        *(torch.where(parts[:, None], b, a) for a, b in zip(shape.poses, other.poses, strict=True))
    )
    latents = torch.where(parts[:, None], other.latents, shape.latents)
    return replace(shape, latents=latents, poses=poses, present=shape.present | parts)
