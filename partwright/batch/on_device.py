"""Many shapes at once on one accelerator: in threads of this process, each with a stream of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from partwright.errors import CancelledError, PartwrightError, SettingError
from partwright.fitting import Result, fit
from partwright.methods import Cancellation, Progress
from partwright.shapes import Shape, load_shape

_AT_ONCE = 4


def fit_on_device(
    shapes: Sequence[Shape | str | Path],
    at_once: int,
    progress: Callable[[int, Progress], None] | None,
    stop: Cancellation,
    options: dict[str, Any],
) -> list[Result | PartwrightError | None]:
    """What `fit_many` does with `device="cuda"`; arguments, results and errors are its."""

    at_once = at_once or _AT_ONCE
    options = {"threads": max(1, (os.cpu_count() or 1) // at_once), **options}

    def one(index: int) -> Result | PartwrightError | None:
        if stop.requested:
            return None
        shape = shapes[index]
        try:
            shape = shape if isinstance(shape, Shape) else load_shape(shape)
            with _stream():
                told = partial(progress, index) if progress else None
                return fit(shape, progress=told, cancel=stop, **options)
        except SettingError:
            raise
        except CancelledError:
            return None
        except PartwrightError as error:
            return error

    with ThreadPoolExecutor(at_once) as pool:
        return list(pool.map(one, range(len(shapes))))


def _stream() -> AbstractContextManager[Any]:
    try:
        import torch
    except ImportError:
        return nullcontext()  # the fit itself says what is missing
    if not torch.cuda.is_available():
        return nullcontext()
    stream: AbstractContextManager[Any] = torch.cuda.stream(torch.cuda.Stream())
    return stream
