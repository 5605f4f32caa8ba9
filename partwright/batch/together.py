"""Many shapes at once from Python: by the worker processes of a batch, or on one accelerator."""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from partwright.batch.manifest import DONE
from partwright.batch.on_device import fit_on_device
from partwright.batch.pool import Answer, Limits, Pool
from partwright.batch.worker import MADE
from partwright.errors import CancelledError, PartwrightError, SettingError, WorkerError
from partwright.fitting import Result
from partwright.methods import Cancellation, Progress, interruptible
from partwright.shapes import Shape


def fit_many(
    shapes: Sequence[Shape | str | Path],
    at_once: int = 0,
    progress: Callable[[int, Progress], None] | None = None,
    cancel: Cancellation | None = None,
    limits: Limits | None = None,
    **options: Any,
) -> list[Result | PartwrightError | None]:
    """Fit every shape as `fit` does, `at_once` of them at a time (0: one a core, 4 on an accelerator).

    Each is fitted by a worker process with its share of the cores: one that crashes, hangs or takes too much
    costs its own shape. With `device="cuda"` all are fitted in this process instead, each with a stream of
    its own, so that the small kernels of several fits run side by side; there are no limits then. The
    assemblies are those that `fit` gives one by one.

    Args:
        shapes: loaded, or files for `load_shape`, which the workers read.
        progress: called with the shape's index and the method's progress, from several threads. Of a worker
            it has the numbers, and no assembly.
        cancel: ends the running fits with their best so far. If not given, Ctrl-C does; a second one ends
            the workers at once.
        limits: of one shape; a quarter of an hour and 8 GB if not given.
        options: of `fit`, for all shapes, the method among them.

    Returns:
        In the order of the shapes: its result, or the error that kept it from one, `WorkerError` where its
        worker died. Where it was cancelled, shapes that were not begun, or had nothing to keep, give None.

    Raises:
        SettingError: `at_once` is no count, or an option has a value that cannot be used.
    """
    if isinstance(at_once, bool) or not isinstance(at_once, int) or at_once < 0:
        raise SettingError(f"at_once: expected a number of shapes, or 0 for one a core, got {at_once!r}")
    stop = cancel or Cancellation()
    with interruptible(stop) if cancel is None else nullcontext():
        if options.get("device") == "cuda":
            return fit_on_device(shapes, at_once, progress, stop, options)
        at_once = at_once or os.cpu_count() or 1
        options = {"threads": max(1, (os.cpu_count() or 1) // at_once), **options}
        with tempfile.TemporaryDirectory(prefix="partwright-") as folder:
            work = _Work(shapes, options, Path(folder), progress)
            pool = Pool[int](max(1, min(at_once, len(shapes))), limits or Limits(), stop, gently=True)
            pool.run(work.jobs(), work.done, work.told)
    return work.results


class _Work:
    """The shapes as jobs, and the results that came of them: pickled, in a file a shape."""

    def __init__(
        self,
        shapes: Sequence[Shape | str | Path],
        options: dict[str, Any],
        folder: Path,
        progress: Callable[[int, Progress], None] | None,
    ) -> None:
        self._shapes, self._options, self._folder, self._progress = shapes, options, folder, progress
        self.results: list[Result | PartwrightError | None] = [None] * len(shapes)

    def jobs(self) -> Iterator[tuple[int, dict[str, Any]]]:
        for index, shape in enumerate(self._shapes):
            try:
                self._file(index).write_bytes(pickle.dumps((shape, self._options)))
            except (pickle.PicklingError, TypeError, AttributeError) as error:
                raise SettingError(f"an option cannot be sent to a worker process: {error}") from error
            yield index, {"pickled": str(self._file(index)), "progress": self._progress is not None}

    def done(self, index: int, answer: Answer) -> None:
        shape, path = self._shapes[index], self._file(index)
        if answer.status != DONE:
            named = shape.name if isinstance(shape, Shape) else shape
            self.results[index] = WorkerError(f"{named}: {answer.reason}")
            return
        made = pickle.loads(path.with_suffix(MADE).read_bytes())
        path.unlink()
        path.with_suffix(MADE).unlink()
        if isinstance(made, SettingError):
            raise made
        if isinstance(made, Result) and isinstance(shape, Shape):
            made = replace(made, shape=shape)
        self.results[index] = None if isinstance(made, CancelledError) else made

    def told(self, index: int, step: dict[str, Any]) -> None:
        assert self._progress is not None
        self._progress(index, Progress(**step))

    def _file(self, index: int) -> Path:
        return self._folder / f"{index}.pickle"
