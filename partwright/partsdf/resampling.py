"""New shapes that hang together: what a generator makes, and makes anew where parts came apart; those that
came through others are drawn back, and those that stand out of others put back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from partwright.methods import check_count
from partwright.partsdf.generator import Draw, Generator
from partwright.partsdf.insets import put_back
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.piercing import drawn_back
from partwright.partsdf.soundness import Judge, Soundness

TRIES = 8  # with half of the shapes unsound, one of 256 stays so
_DRAWN_BACK = 6  # times at most, each of one part
_PUT_BACK = 3  # times at most, all parts that lie in others
_CHANGES = (0.6, 0.7, 0.8, 0.9)  # of the first one, in the tries after it; then nothing of it is left
ShareDone = Callable[[float], None]  # told how much is done, from 0 to 1, at most


@dataclass(frozen=True)
class Sample:
    """shape: the first of its tries that is sound, else the least bad one; tries: how many were made."""

    shape: NeuralShape
    soundness: Soundness
    tries: int


def sound_samples(
    generator: Generator,
    count: int,
    seed: int = 0,
    source: NeuralShape | None = None,
    keep: Sequence[str] = (),
    keep_layout: bool = False,
    change: float = 0.0,
    tries: int = TRIES,
    told: ShareDone | None = None,
) -> list[Sample]:
    """As `Generator.generate`, each made anew until it is sound, up to `tries` times in all.

    What is sound at once is what `generate` makes; 1 try takes all as they come. Parts that stand out of
    others are put back, and one that comes through another is drawn back, unless it is to stay. What is
    broken else is made anew: new noise takes over more of it with each try, then all. Replaced by anything,
    shapes that often come apart, as benches, would be rare. What a layout that is kept has wrong itself is no
    reason for another try: all would have it.

    Raises:
        SettingError: no try is allowed; else as `Generator.generate`.
    """
    check_count("tries", tries, low=1)
    whole = Judge(generator.model)
    given = whole(source) if keep_layout and source is not None else None

    def judge(shape: NeuralShape) -> Soundness:
        return whole(shape) if given is None else whole(shape).of_forms(given)

    first = generator.generate(count, seed, source, keep, keep_layout, change)

    def made(number: int, attempt: int) -> NeuralShape:
        draw = [Draw(number, attempt)]
        if source is None and attempt <= len(_CHANGES):
            like, much = first[number], _CHANGES[attempt - 1]
            return generator.generate(draw, seed, like, change=much)[0]
        return generator.generate(draw, seed, source, keep, keep_layout, change)[0]

    def judged(shape: NeuralShape) -> Sample:
        sample = Sample(shape, judge(shape), 1)
        return _mended(sample, judge, keep, keep_layout) if tries > 1 else sample

    best: list[Sample] = []
    for number, shape in enumerate(first):
        sample = judged(shape)
        while sample.soundness.breaks() and sample.tries < tries:
            new = judged(made(number, sample.tries))
            least = min(sample, new, key=lambda one: one.soundness.rank)
            sample = replace(least, tries=sample.tries + 1)
        best.append(sample)
        if told is not None:
            told(len(best) / count)
    return best


def _mended(
    sample: Sample, judge: Callable[[NeuralShape], Soundness], keep: Sequence[str], keep_layout: bool
) -> Sample:
    """The sample with parts that stand out of others put back, all together, and those that came through
    others drawn back, one by one; one for which that does not help stays, and the others have their turn."""
    kept = set(keep)
    for _ in range(_PUT_BACK):
        if not set(sample.soundness.standing_out) - kept:
            break
        shape = put_back(sample.shape, sample.soundness.insets, kept, move_pose=not keep_layout)
        new = replace(sample, shape=shape, soundness=judge(shape))
        if new.soundness.rank >= sample.soundness.rank:
            break
        sample = new
    for _ in range(_DRAWN_BACK):
        free = [tip for tip in sample.soundness.through if tip.part not in kept]
        if not free:
            break
        shape = drawn_back(sample.shape, free[0], move_pose=not keep_layout)
        new = replace(sample, shape=shape, soundness=judge(shape))
        if new.soundness.rank < sample.soundness.rank:
            sample = new
        else:
            kept.add(free[0].part)
    return sample
