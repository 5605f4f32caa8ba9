"""Where the arithmetic runs: the compiled kernel, or the same functions in PyTorch on an accelerator."""

from __future__ import annotations

from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.errors import MissingDependencyError, SettingError
from partwright.fields import kernel
from partwright.methods import DEVICES, Checkpoint

NO_PENALTIES = kernel.Penalties()


class Kernel(Protocol):
    """What a fit asks of `partwright.fields.kernel`; `TorchKernel` answers it on a device."""

    def evaluate(self, parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> NDArray[np.float32]: ...

    def evaluate_parts(
        self, parameters: ArrayLike, points: ArrayLike, threads: int = 0
    ) -> NDArray[np.float32]: ...

    def covered(self, parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> NDArray[np.bool_]: ...

    def normal_equations(
        self,
        parameters: ArrayLike,
        target: kernel.Target,
        beta: float,
        penalties: kernel.Penalties = NO_PENALTIES,
        threads: int = 0,
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]: ...

    def loss(
        self,
        parameters: ArrayLike,
        target: kernel.Target,
        beta: float,
        penalties: kernel.Penalties = NO_PENALTIES,
        threads: int = 0,
    ) -> float: ...

    def levenberg_marquardt(
        self,
        parameters: ArrayLike,
        target: kernel.Target,
        stages: ArrayLike,
        limits: kernel.Limits,
        *,
        free: NDArray[np.bool_] | None = None,
        tied: NDArray[np.bool_] | None = None,
        penalties: kernel.Penalties = NO_PENALTIES,
        threads: int = 0,
    ) -> tuple[NDArray[np.float32], float, int]: ...

    def fit_starts(
        self,
        starts: ArrayLike,
        ranges: NDArray[np.int64],
        target: kernel.Target,
        stages: ArrayLike,
        limits: kernel.Limits,
        *,
        free: NDArray[np.bool_] | None = None,
        tied: NDArray[np.bool_] | None = None,
        penalties: kernel.Penalties = NO_PENALTIES,
        threads: int = 0,
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]: ...

    def decompose(
        self,
        field: ArrayLike,
        spacing: float,
        regions: int,
        fraction: float,
        least_depth: float,
        least_voxels: float,
    ) -> tuple[NDArray[np.int32], list[float]]: ...

    def removal_counts(
        self,
        parameters: ArrayLike,
        points: ArrayLike,
        inside: NDArray[np.bool_],
        weight: ArrayLike,
        threads: int = 0,
    ) -> NDArray[np.float64]: ...


class _Watched:
    """A kernel that passes a checkpoint before each of its functions."""

    def __init__(self, watched: Any, checkpoint: Checkpoint) -> None:
        self._watched, self._checkpoint = watched, checkpoint

    def __getattr__(self, name: str) -> Any:
        self._checkpoint()
        return getattr(self._watched, name)


def watched(kernel: Kernel, checkpoint: Checkpoint) -> Kernel:
    """The kernel with this checkpoint passed before every call, in place of any other."""
    plain = kernel._watched if isinstance(kernel, _Watched) else kernel
    return cast(Kernel, _Watched(plain, checkpoint))


def backend(device: str, checkpoint: Checkpoint | None = None) -> Kernel:
    """The kernel for "cpu" or "cuda"; "auto" is the compiled kernel, which needs no other package.

    A fit spends its time in here, so the checkpoint, passed before every call, ends it soon.

    Raises:
        SettingError: the device is unknown, or there is no such accelerator.
        MissingDependencyError: PyTorch is not installed.
    """
    if checkpoint is not None:
        return watched(backend(device), checkpoint)
    if device not in DEVICES:
        raise SettingError(f"device: expected one of {', '.join(DEVICES)}, got {device!r}")
    if device != "cuda":
        return cast(Kernel, kernel)
    try:
        import torch
    except ImportError as error:
        message = 'device "cuda" needs PyTorch: pip install "partwright[torch]"'
        raise MissingDependencyError(message) from error
    if not torch.cuda.is_available():
        raise SettingError('device "cuda": PyTorch finds no CUDA device here; use --device cpu')
    from partwright.superfrusta.torch_kernel import TorchKernel

    return TorchKernel("cuda")
