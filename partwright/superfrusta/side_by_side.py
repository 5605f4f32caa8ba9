"""Several growths of one shape at a time, as many as there are cores, and one report of how far they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from queue import SimpleQueue
from typing import Generic, TypeVar

from partwright.at_once import thread_count
from partwright.methods import Cancellation, Checkpoint, Progress
from partwright.superfrusta.samples import FitSamples

Result = TypeVar("Result")
Told = Callable[[Progress], None]
Growth = Callable[[int, FitSamples, Checkpoint, Told], Result]


@dataclass
class SideBySide(Generic[Result]):
    """Runs growths, each on its own variant of the samples, with its own checkpoint.

    A growth that knows nothing of the others comes out the same whichever of them run at a time. told: of
    the steps of all, in the thread that waits for them, and with the mean of how far they are.
    """

    samples: FitSamples
    checkpoint: Checkpoint | None = None
    told: Told | None = None
    halt: Cancellation = field(default_factory=Cancellation)

    def __call__(self, growth: Growth[Result], count: int) -> list[Result]:
        """What `growth(number, samples, checkpoint, told)` returns, by number."""
        threads = thread_count(self.samples.threads)
        # An accelerator has work enough for all of its cores with one.
        workers = 1 if self.samples.device == "cuda" else min(count, threads)
        steps: SimpleQueue[tuple[int, Progress] | None] = SimpleQueue()
        with ThreadPoolExecutor(workers) as pool:
            futures: list[Future[Result]] = []
            try:
                for number in range(count):
                    future = pool.submit(self._one, growth, number, max(1, threads // workers), steps)
                    future.add_done_callback(lambda _: steps.put(None))
                    futures.append(future)
                self._tell(steps, futures)
            except BaseException:
                self.halt.request()
                pool.shutdown(wait=False, cancel_futures=True)
                raise
            return [future.result() for future in futures]

    def _one(
        self,
        growth: Growth[Result],
        number: int,
        threads: int,
        steps: SimpleQueue[tuple[int, Progress] | None],
    ) -> Result:
        checkpoint = (self.checkpoint or Checkpoint()).another(self.halt)
        samples = self.samples.variant(number, checkpoint, threads)
        return growth(number, samples, checkpoint, lambda step: steps.put((number, step)))

    def _tell(
        self, steps: SimpleQueue[tuple[int, Progress] | None], futures: Sequence[Future[Result]]
    ) -> None:
        """Until all have ended, or one has failed."""
        reached = [0.0] * len(futures)
        ended = 0
        while ended < len(futures):
            told = steps.get()
            if told is None:
                ended += 1
                for future in futures:
                    if future.done():
                        future.result()
            elif self.told is not None:
                number, step = told
                reached[number] = step.fraction
                self.told(replace(step, fraction=sum(reached) / len(reached)))
