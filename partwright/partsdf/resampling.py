"""New shapes that hang together: what a generator makes. Parts that came through others are drawn back, and
those that stand out of others or are covered by them put back; what came apart, or is out of place still, is
made anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from partwright.methods import check_count
from partwright.partsdf.generator import Draw, Generator
from partwright.partsdf.insets import put_back
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.piercing import Tip, drawn_back
from partwright.partsdf.soundness import Judge, Soundness, largest_offset, least_rank

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
) -> Iterator[Sample]:
    """As `Generator.generate`, one by one, each made anew until it is sound, up to `tries` times in all.

    What is sound at once is what `generate` makes; 1 try takes all as they come. Parts that stand out of
    others or are covered by them are put back, and one that comes through another is drawn back, unless it is
    to stay. What is still at fault is made anew: new noise takes over more of it with each try, then all.
    Replaced by anything, shapes that often come apart, as benches, would be rare. What a layout that is kept
    has wrong itself is no reason for another try: all would have it.

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

    def faulty(said: Soundness) -> bool:
        return bool(said.breaks() or said.misplaced - set(keep))

    for number, shape in enumerate(first):
        sample = judged(shape)
        while faulty(sample.soundness) and sample.tries < tries:
            new = judged(made(number, sample.tries))
            least = min(sample, new, key=lambda one: one.soundness.rank)
            sample = replace(least, tries=sample.tries + 1)
        yield sample
        if told is not None:
            told((number + 1) / count)


def _mended(
    sample: Sample, judge: Callable[[NeuralShape], Soundness], keep: Sequence[str], keep_layout: bool
) -> Sample:
    """The sample with parts that stand out of others or are covered put back, all together, and those that
    came through others drawn back, one by one; one for which that does not help stays, and the others have
    their turn."""
    kept = set(keep)

    def better(shape: NeuralShape) -> Sample | None:
        """Of the changed shape, where it ranks before the sample."""
        if not keep_layout and least_rank(largest_offset(shape)[0]) >= sample.soundness.rank:
            return None  # whatever its meshes, which take the longest
        new = replace(sample, shape=shape, soundness=judge(shape))
        return new if new.soundness.rank < sample.soundness.rank else None

    for _ in range(_PUT_BACK):
        if not set(sample.soundness.standing_out + sample.soundness.covered) - kept:
            break
        new = better(put_back(sample.shape, sample.soundness.insets, kept, move_pose=not keep_layout))
        if new is None:
            break
        sample = new

    def next_tip() -> Tip | None:
        """Of a part that may move, unless it is hopeless: where two other parts that lie oddly are the worst
        of it, no tip is what mends that."""
        said = sample.soundness
        odd = not keep_layout and least_rank(said.offset) >= said.rank
        free = (tip for tip in said.through if tip.part not in kept)
        return next((tip for tip in free if not odd or tip.part in said.offset_between), None)

    for _ in range(_DRAWN_BACK):
        tip = next_tip()
        if tip is None:
            break
        new = better(drawn_back(sample.shape, tip, move_pose=not keep_layout))
        if new is None:
            kept.add(tip.part)
        else:
            sample = new
    return sample
