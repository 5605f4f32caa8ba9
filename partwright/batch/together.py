"""Many shapes at once on one machine: what one fit leaves idle, another uses."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

from partwright.errors import CancelledError, PartwrightError, SettingError
from partwright.fitting import Result, fit
from partwright.methods import Cancellation, Progress, interruptible
from partwright.shapes import Shape

_ON_A_DEVICE = 4


def fit_many(
    shapes: Sequence[Shape],
    at_once: int = 0,
    progress: Callable[[int, Progress], None] | None = None,
    cancel: Cancellation | None = None,
    **options: Any,
) -> list[Result | PartwrightError | None]:
    """Fit every shape as `fit` does, `at_once` of them at a time (0: one a core, 4 on an accelerator).

    On a CPU each fit keeps to its share of the cores, on an accelerator each has a stream of its own, so that
    the small kernels of several fits run side by side. The assemblies are those that `fit` gives one by one.

    Args:
        progress: called with the shape's index and the method's progress, from several threads.
        cancel: ends the running fits with their best so far. If not given, Ctrl-C does.
        options: of `fit`, for all shapes.

    Returns:
        In the order of the shapes: its result, or the error that kept it from one. Where it was cancelled,
        shapes that were not begun, or had nothing to keep, give None.

    Raises:
        SettingError: `at_once` is no count, or an option has a value that cannot be used.
    """
    if isinstance(at_once, bool) or not isinstance(at_once, int) or at_once < 0:
        raise SettingError(f"at_once: expected a number of shapes, or 0 for one a core, got {at_once!r}")
    cores = os.cpu_count() or 1
    at_once = at_once or (_ON_A_DEVICE if options.get("device") == "cuda" else cores)
    options = {"threads": max(1, cores // at_once), **options}
    stop = cancel or Cancellation()

    def one(index: int) -> Result | PartwrightError | None:
        if stop.requested:
            return None
        told = partial(progress, index) if progress else None
        try:
            with _stream(options.get("device", "auto")):
                return fit(shapes[index], progress=told, cancel=stop, **options)
        except SettingError:
            raise
        except CancelledError:
            return None
        except PartwrightError as error:
            return error

    with interruptible(stop) if cancel is None else nullcontext(), ThreadPoolExecutor(at_once) as pool:
        return list(pool.map(one, range(len(shapes))))


def _stream(device: str) -> AbstractContextManager[Any]:
    if device != "cuda":
        return nullcontext()
    import torch

    if not torch.cuda.is_available():
        return nullcontext()  # the fit itself says what is missing
    stream: AbstractContextManager[Any] = torch.cuda.stream(torch.cuda.Stream())
    return stream
