"""Drag by a network that has learned from simulated bodies, and when not to believe it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from partwright.atomic_io import replacing
from partwright.errors import ModelError
from partwright.goals.flow.air import Air
from partwright.goals.flow.network import POINTS, DragNetwork

_FORMAT = "partwright-drag-1"
_LARGEST = 64 << 20  # bytes of a file


@dataclass(frozen=True)
class Surrogate:
    """Predicts drag areas (m2) of bodies in one air.

    length: metres, the mean of the training's longest sides. embeddings: (S, W) of the training. spread: the
    largest distance of one of them from the nearest other.
    """

    network: DragNetwork
    air: Air
    length: float
    embeddings: Tensor
    spread: float

    def drag(self, points: Tensor, normals: Tensor, area: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Drag areas (B,), pressure coefficients (B, N), embeddings (B, W).

        points: (B, N, 3) spread evenly over the surfaces, metres, as `placed` leaves them, with their normals
        (B, N, 3). area: (B,) of the surfaces, m2.
        """
        pressure, rest, whole = self.network(points / self.length, normals)
        return drag_area(pressure, rest, normals, area, self.air), pressure, whole

    def outside(self, embedding: Tensor) -> float:
        """How far a body is from the nearest of the training, over the largest such distance within that:
        above 1 it is unlike all that was learned from."""
        nearest = torch.cdist(embedding.reshape(1, -1), self.embeddings).min()
        return float(nearest) / max(self.spread, 1e-12)

    def save(self, path: str | Path) -> None:
        """Write a safetensors file. Raises OutputError where it cannot be written."""
        from safetensors.torch import save_file

        tensors = {f"network.{name}": value.contiguous() for name, value in self.network.state_dict().items()}
        about = {
            "format": _FORMAT,
            "air": self.air.to_dict(),
            "length": self.length,
            "spread": self.spread,
            "width": self.network.width,
            "layers": self.network.layers,
        }
        with replacing(path) as staging:
            save_file(tensors | {"embeddings": self.embeddings}, staging, {"about": json.dumps(about)})

    @classmethod
    def load(cls, path: str | Path) -> Surrogate:
        """Raises ModelError for a file that is none, cut short, or too large."""
        from safetensors import SafetensorError, safe_open

        path = Path(path)
        try:
            if path.stat().st_size > _LARGEST:
                raise ValueError("it is larger than any such model")
            with safe_open(path, framework="pt") as file:
                about = json.loads((file.metadata() or {})["about"])
                tensors = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
            if about["format"] != _FORMAT:
                raise ValueError(f"its format is {about['format']!r:.40}")
            width, layers = int(about["width"]), int(about["layers"])
            if not (1 <= width <= 1024 and 1 <= layers <= 16):
                raise ValueError("its network is of no size that is made here")
            network = DragNetwork(width, layers)
            embeddings = tensors.pop("embeddings")
            network.load_state_dict({name.removeprefix("network."): value for name, value in tensors.items()})
            if not all(bool(torch.isfinite(value).all()) for value in [embeddings, *tensors.values()]):
                raise ValueError("it holds numbers that are not finite")
            if embeddings.ndim != 2 or embeddings.shape[1] != width:
                raise ValueError("its embeddings are of another network")
            air, length, spread = Air(**about["air"]), float(about["length"]), float(about["spread"])
        except (OSError, SafetensorError, ValueError, KeyError, TypeError, RuntimeError) as error:
            raise ModelError(
                f"{path}: expected a drag model (parts train-surrogate): {str(error)[:200]}"
            ) from error
        return cls(network.eval(), air, length, embeddings, spread)


def drag_area(pressure: Tensor, rest: Tensor, normals: Tensor, area: Tensor, air: Air) -> Tensor:
    """(B,) m2: of the pressures (B, N) against the flow, and a rest (B,) of the area that faces it."""
    against = -(normals @ torch.tensor(air.direction, dtype=normals.dtype))
    front = against.clamp_min(0).mean(dim=1) * area
    return (pressure * against).mean(dim=1) * area + rest * front


@dataclass(frozen=True)
class Spread:
    """Where points are on a triangle mesh: faces (N,) and barycentric coordinates (N, 3)."""

    face: Tensor
    share: Tensor

    @classmethod
    def over(cls, areas: np.ndarray, seed: int, count: int = POINTS) -> Spread:
        """As many points on a face as its share of the surface asks for, areas (F,)."""
        rng = np.random.default_rng(seed)
        # Strata along the faces: more even than free draws, so that sums over the points swing less.
        at = (np.arange(count) + rng.random(count)) / count
        face = np.searchsorted(np.cumsum(areas) / areas.sum(), at).clip(max=len(areas) - 1)
        u, v = rng.random((2, count))
        over = u + v > 1
        u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
        share = np.stack([1 - u - v, u, v], axis=1)
        return cls(torch.tensor(face), torch.tensor(share, dtype=torch.float32))

    def on(self, vertices: Tensor, faces: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Points (N, 3) and normals (N, 3), which follow the vertices (V, 3), and the surface's area ()."""
        corners = vertices[faces]
        cross = torch.linalg.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice = torch.linalg.norm(cross, dim=1)
        normals = cross[self.face] / twice[self.face].clamp_min(1e-30)[:, None]
        points = (self.share[:, :, None].to(vertices.dtype) * corners[self.face]).sum(dim=1)
        return points, normals, twice.sum() / 2


def placed(points: Tensor, air: Air, vertices: Tensor) -> Tensor:
    """Points from the middle of the body's box, and from its lower end where there is a ground."""
    low, high = vertices.amin(dim=0), vertices.amax(dim=0)
    origin = (low + high) / 2
    if air.ground:
        sign = -1.0 if air.ground.startswith("-") else 1.0
        i = "xyz".index(air.ground[-1])
        origin = torch.cat([origin[:i], (low if sign > 0 else high)[i : i + 1], origin[i + 1 :]])
    return points - origin


def rank_correlation(a: Sequence[float], b: Sequence[float]) -> float:
    """Spearman's."""
    from scipy.stats import spearmanr

    return float(spearmanr(a, b).statistic)


def same_air(a: Air, b: Air) -> bool:
    """Whether two differ in their time limit at most."""
    return asdict(a) | {"time_limit": 0} == asdict(b) | {"time_limit": 0}
