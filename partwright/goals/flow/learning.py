"""A drag network's training on simulated bodies, and how well it ranks those that it has not seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from partwright.errors import SettingError
from partwright.goals.flow.air import Air
from partwright.goals.flow.dataset import Sample
from partwright.goals.flow.network import POINTS, DragNetwork, neighbours
from partwright.goals.flow.simulation import PRESSURE
from partwright.goals.flow.surrogate import Spread, Surrogate, drag_area, placed, rank_correlation
from partwright.methods import Cancellation
from partwright.shapes.topology import doubled_areas

_VIEWS = 4  # draws of points that are kept of each body
_BATCH = 4
_FEWEST = 4  # bodies to learn from
_DRAG_WEIGHT = 2.0  # of the squared error of drag, over its variance, beside that of pressure


@dataclass(frozen=True)
class Told:
    """One round over all bodies. loss: of it."""

    number: int
    of: int
    loss: float


@dataclass(frozen=True)
class Scores:
    """On bodies that were not learned from. r2: 1 - squared error over that of the training's mean. error:
    mean of the absolute error, and floor: of that mean, as shares. rank: Spearman's correlation."""

    bodies: int
    r2: float
    error: float
    floor: float
    rank: float


@dataclass(frozen=True)
class _Views:
    points: Tensor
    normals: Tensor
    near: Tensor
    pressure: Tensor
    area: Tensor
    drag: Tensor


def train(
    samples: Sequence[Sample],
    *,
    rounds: int = 120,
    width: int = 32,
    points: int = POINTS // 2,
    seed: int = 0,
    mirror: str = "",
    told: Callable[[Told], None] | None = None,
    cancel: Cancellation | None = None,
) -> Surrogate:
    """A surrogate of simulated bodies of one air; after a cancellation, as far as it has come.

    points: that a body is looked at by while learning.
    mirror: an axis across which bodies may be mirrored, so that each counts twice; "" for none.

    Raises:
        SettingError: there are too few.
    """
    if len(samples) < _FEWEST:
        raise SettingError(
            f"{len(samples)} simulated bodies are too few to learn from; expected {_FEWEST} or more"
        )
    air, cancel = samples[0].air, cancel or Cancellation()
    length = float(np.mean([np.ptp(one.vertices, axis=0).max() for one in samples]))
    torch.manual_seed(seed)
    network = DragNetwork(width).train()
    views = _views(samples, range(_VIEWS), air, points)
    deviation = views.pressure.std()
    drag_deviation = views.drag.std().clamp_min(1e-3 * views.drag.mean().abs())
    optimiser = torch.optim.AdamW(network.parameters(), lr=2e-3, weight_decay=0.1)
    steps = rounds * -(-len(samples) // _BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 4e-3, total_steps=steps, pct_start=0.1)
    draw = np.random.default_rng(seed)
    for number in range(1, rounds + 1):
        total = 0.0
        for chosen in np.array_split(draw.permutation(len(samples)), -(-len(samples) // _BATCH)):
            rows = torch.tensor(chosen * _VIEWS + draw.integers(0, _VIEWS, len(chosen)))
            places, normals = views.points[rows], views.normals[rows]
            if mirror and draw.random() < 0.5:
                flip = torch.ones(3)
                flip["xyz".index(mirror)] = -1
                places, normals = places * flip, normals * flip
            pressure, rest, _ = network(places / length, normals, views.near[rows])
            drag = drag_area(pressure, rest, normals, views.area[rows], air)
            loss = ((pressure - views.pressure[rows]) / deviation).square().mean()
            loss = loss + _DRAG_WEIGHT * ((drag - views.drag[rows]) / drag_deviation).square().mean()
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            total += loss.item() * len(chosen)
        if told is not None:
            told(Told(number, rounds, total / len(samples)))
        if cancel.requested:
            break
    return _finished(network.eval(), samples, air, length)


def scores(surrogate: Surrogate, samples: Sequence[Sample], mean: float) -> Scores:
    """On bodies with a known drag. mean: drag area of the training, the guess to beat."""
    with torch.no_grad():
        views = _views(samples, [1000], surrogate.air)
        found = surrogate.drag(views.points, views.normals, views.area)[0].numpy()
    true = np.array([one.drag_area for one in samples])
    r2 = 1 - float(np.square(found - true).sum() / np.square(true - mean).sum())
    error, floor = (
        float((np.abs(guess - true) / true).mean()) for guess in (found, np.full_like(true, mean))
    )
    return Scores(len(samples), r2, error, floor, rank_correlation(found.tolist(), true.tolist()))


def _finished(network: DragNetwork, samples: Sequence[Sample], air: Air, length: float) -> Surrogate:
    with torch.no_grad():
        views = _views(samples, [0], air)
        embeddings = network(views.points / length, views.normals, views.near)[2]
    apart = torch.cdist(embeddings, embeddings) + torch.diag(torch.full((len(embeddings),), torch.inf))
    return Surrogate(network, air, length, embeddings, float(apart.min(dim=1).values.max()))


def _views(samples: Sequence[Sample], seeds: Sequence[int] | range, air: Air, count: int = POINTS) -> _Views:
    """Draws of points of each body, all of a body together, with the pressure on the nearest of its skin.

    Of the body as it was given, for so it will be asked for: a coarse simulation sees it blunted.
    """
    rows = []
    for sample in samples:
        vertices = torch.tensor(sample.vertices, dtype=torch.float32)
        faces = torch.tensor(sample.faces)
        areas = doubled_areas(sample.vertices, sample.faces)
        drag = torch.tensor(sample.drag_area)
        for seed in seeds:
            spread = Spread.over(areas, seed, count)
            points, normals, area = spread.on(vertices, faces)
            pressure = torch.tensor(sample.skin.at(PRESSURE, points.numpy()), dtype=torch.float32)
            points = placed(points, air, vertices)
            rows.append((points, normals, neighbours(points[None])[0], pressure, area, drag))
    return _Views(*(torch.stack(column) for column in zip(*rows, strict=True)))
