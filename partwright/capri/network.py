"""The network (figure 2): a voxel encoder, the primitive MLP, the selection matrix T and the weights W."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from partwright.capri.quadric_rows import CROSS
from partwright.errors import UnreadableFileError
from partwright.input_files import check_file

VOXELS = 64
UNIT_TO_PAPER = 0.5  # the paper's coordinates, in which a shape is at most 1 long, from the unit frame's
_LEAKY_SLOPE = 0.01
_INITIAL_SPREAD = 0.02  # of T and W at the start
_INITIAL_WEIGHT = 1e-5  # W at the start: small, so that eq. 4 does not saturate


@dataclass(frozen=True)
class NetworkSizes:
    """How large the network is (section 4.1)."""

    primitives: int = 1024
    """p: quadrics that the MLP predicts."""
    convexes: int = 64
    """c: columns of T; half of the convexes are subtracted."""
    code: int = 256
    """Numbers of a shape's code."""
    hidden: int = 512
    """Width of the MLP's middle layer."""
    channels: int = 32
    """Of the encoder's first layer, doubled twice (IM-Net)."""


SMALL = NetworkSizes(primitives=256, convexes=32, code=128, hidden=256, channels=4)  # a few megabytes
SIZES = {"small": SMALL, "paper": NetworkSizes()}


class Encoder(nn.Module):
    """64^3 voxels (B, 1, 64, 64, 64) to a code (B, code), as in IM-Net: four halvings, then to a point."""

    def __init__(self, sizes: NetworkSizes) -> None:
        super().__init__()
        c = sizes.channels
        widths = (1, c, 2 * c, 4 * c, 8 * c)
        blocks: list[nn.Module] = []
        for first, second in pairwise(widths):
            blocks += [
                nn.Conv3d(first, second, 4, stride=2, padding=1, bias=False),
                nn.InstanceNorm3d(second, affine=True),
                nn.LeakyReLU(0.02),
            ]
        blocks += [nn.Conv3d(8 * c, sizes.code, 4), nn.Flatten(), nn.Sigmoid()]
        self.layers = nn.Sequential(*blocks)

    def forward(self, voxels: Tensor) -> Tensor:
        return cast(Tensor, self.layers(voxels))


class CapriNet(nn.Module):
    """Code to primitives P (B, p, 7), beside T (p, c) and W (c,), which all shapes share in pre-training."""

    def __init__(self, sizes: NetworkSizes | None = None) -> None:
        super().__init__()
        self.sizes = sizes or NetworkSizes()
        s = self.sizes
        self.encoder = Encoder(s)
        self.primitives = nn.Sequential(
            nn.Linear(s.code, s.hidden), nn.LeakyReLU(_LEAKY_SLOPE), nn.Linear(s.hidden, 7 * s.primitives)
        )
        self.selection = nn.Parameter(_INITIAL_SPREAD * torch.randn(s.primitives, s.convexes))
        self.weights = nn.Parameter(_INITIAL_WEIGHT + _INITIAL_SPREAD * torch.randn(s.convexes))

    def coefficients(self, code: Tensor) -> Tensor:
        """P (B, p, 7) of codes (B, code): eq. 1, with a, b, c >= 0."""
        p = self.primitives(code).unflatten(-1, (self.sizes.primitives, 7))
        return torch.cat([p[..., :3].abs(), p[..., 3:]], dim=-1)

    def seed(self, rows: NDArray[np.float64], code: Tensor) -> None:
        """The first primitives become these `expressible` rows (K, 10) for this code (1, code)."""
        last = cast(nn.Linear, self.primitives[2])
        with torch.no_grad():
            wanted = torch.from_numpy(coefficients_of(rows)).to(last.bias).flatten()
            last.bias[: len(wanted)] += wanted - self.primitives(code)[0, : len(wanted)]


def distances(coefficients: Tensor, points: Tensor) -> Tensor:
    """D (B, n, p) = Q P^T of points (B, n, 3) in the paper's coordinates (section 3.1)."""
    q = torch.cat([points**2, points, torch.ones_like(points[..., :1])], dim=-1)
    return q @ coefficients.transpose(-1, -2)


def rows_of(coefficients: Tensor) -> NDArray[np.float64]:
    """P (p, 7) as rows (p, 10) of the unit frame."""
    seven = coefficients.detach().cpu().double().numpy() * _scale()
    return np.concatenate([seven, np.zeros((len(seven), 3))], axis=1)


def coefficients_of(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows (K, 10) of the unit frame, without cross terms, as P (K, 7)."""
    return np.asarray(rows[:, : CROSS.start] / _scale())


def _scale() -> NDArray[np.float64]:
    """f(UNIT_TO_PAPER * p) by coefficients of p."""
    return np.array([UNIT_TO_PAPER**2] * 3 + [UNIT_TO_PAPER] * 3 + [1.0])


def save_network(network: CapriNet, path: Path, half: bool = True) -> None:
    """As safetensors, in half precision, with the sizes beside."""
    import json

    from safetensors.torch import save

    from partwright.atomic_io import replacing, write_bytes

    state = {k: (v.half() if half else v).contiguous().cpu() for k, v in network.state_dict().items()}
    with replacing(path) as staging:
        write_bytes(staging, save(state, {"sizes": json.dumps(asdict(network.sizes))}))


def load_network(path: Path) -> CapriNet:
    """The network of `save_network`, in single precision.

    Raises UnreadableFileError for anything else.
    """
    import json

    from safetensors import SafetensorError, safe_open

    check_file(path)
    try:
        with safe_open(path, "pt") as file:
            sizes = NetworkSizes(**json.loads((file.metadata() or {})["sizes"]))
            state = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
        network = CapriNet(sizes)
        network.load_state_dict(state)
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise UnreadableFileError(
            f"{path}: is no CAPRI network ({error}); give the file of a training"
        ) from error
    return network
