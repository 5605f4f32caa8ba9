"""From shapes made of named parts to a prepared family: poses that agree, and samples, on disk.

Each shape is a file of its own, kept as soon as it is done, so that a run that was stopped goes on where it
was. Poses are agreed on when all shapes are there; the manifest is written last.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.atomic_io import check_folder
from partwright.datasets.agreement import agreed
from partwright.datasets.families.recipes import FAMILIES
from partwright.datasets.inputs import MadeShape, PartedSource, find_shapes, unread_files
from partwright.datasets.labelling import label_surface, sample
from partwright.datasets.poses import Poses, average_poses
from partwright.datasets.prepared import (
    MANIFEST,
    MOST_PARTS,
    SHAPES,
    SPLITS,
    UP,
    Entry,
    PreparedFamily,
    PreparedShape,
    read_about,
    read_shape,
    write_manifest,
    write_shape,
)
from partwright.datasets.primitives import PrimitiveFit, fit_primitives
from partwright.errors import FamilyError, OutputError, PartwrightError, SettingError
from partwright.processes import end_with_parent, one_a_processor
from partwright.shapes.units import canonical_up

VALIDATION, TEST = 0.2, 0.2  # shares of the shapes; the rest trains (PartSDF, B.4)
FEWEST_SAMPLES = 1000
_REVISION = 2  # of what a shape's file holds: another number prepares it again


@dataclass(frozen=True)
class Refused:
    """A shape that was left out, and why; or some files, by their names in one line."""

    name: str
    reason: str


@dataclass(frozen=True)
class PreparationProgress:
    """shape: what has just been done, or refused; done of total."""

    shape: str
    done: int
    total: int


@dataclass(frozen=True)
class Preparation:
    """A prepared family, and the shapes that it was prepared without."""

    family: PreparedFamily
    refused: tuple[Refused, ...]


@dataclass(frozen=True)
class _Job:
    """All that a process needs to prepare one shape."""

    source: PartedSource
    parts: tuple[str, ...]
    samples: int
    seed: int
    path: Path


def prepare(
    source: str | Path,
    output: str | Path,
    *,
    count: int = 300,
    samples: int = 100_000,
    parts: Sequence[str] = (),
    held_out: Sequence[str] = (),
    seed: int = 0,
    workers: int | None = None,
    up: str | None = None,
    progress: Callable[[PreparationProgress], None] | None = None,
) -> Preparation:
    """Prepare a folder of shapes, or `count` shapes of one of FAMILIES, for PartSDF.

    samples: points a shape (the paper's program has 525,000). parts: the family's parts in order; all that
    the shapes have if empty. held_out: the shapes to test on; if empty, 60 % train, 20 % validate and 20 %
    test, drawn by seed. workers: processes; one a processor if None. up: the axis that points up in all
    shapes; if None, as most files say (GLB: y), else z. Shapes that cannot be used are left out and said why.
    Ctrl-C loses only the shapes that are being worked on: the same call goes on from there.

    Raises SettingError, OutputError, and FamilyError where fewer than two shapes can be used, a part of
    `parts` is missing everywhere, or a held-out shape is not there.
    """
    if samples < FEWEST_SAMPLES:
        raise SettingError(f"{samples} samples a shape were asked for; expected {FEWEST_SAMPLES} or more")
    stated = None if up is None else canonical_up(up)
    output = Path(output)
    name, sources, refused = _sources(source, count, seed)
    sources, names = _with_parts(sources, tuple(parts), refused)
    _check_enough(name, sources, refused)
    unknown = sorted(set(held_out) - {s.name for s in sources})
    if unknown:
        raise FamilyError(f"{name}: no usable shape is called {', '.join(unknown)}; hold out others")
    _start(output)
    jobs = [_Job(s, names, samples, seed, output / SHAPES / f"{s.name}.safetensors") for s in sources]
    for number, (job, reason) in enumerate(_run(jobs, one_a_processor(workers)), 1):
        if reason:
            refused.append(Refused(job.source.name, reason))
        if progress is not None:
            progress(PreparationProgress(job.source.name, number, len(jobs)))
    left_out = {shape.name for shape in refused}
    jobs = [job for job in jobs if job.source.name not in left_out]
    _check_enough(name, [job.source for job in jobs], refused)
    split = splits([job.source.name for job in jobs], held_out, seed)
    family = _finish(output, name, jobs, split, stated)
    return Preparation(family, tuple(sorted(refused, key=lambda r: r.name)))


def reasons_of(refused: Sequence[Refused]) -> str:
    """To end a message with: why each shape was left out, or ""."""
    return "".join(f"; {shape.name} was refused: {shape.reason}" for shape in refused)


def splits(names: Sequence[str], held_out: Sequence[str], seed: int) -> dict[str, str]:
    """The split of each name; without `held_out` by the order of their hashes, however they come."""
    if held_out:
        return {name: "test" if name in held_out else "train" for name in names}
    ranked = sorted(names, key=lambda name: hashlib.sha256(f"{seed}:{name}".encode()).digest())
    validation, test = round(VALIDATION * len(names)), max(round(TEST * len(names)), 1)
    numbers = np.repeat(np.arange(3), [len(names) - validation - test, validation, test])
    return {name: SPLITS[number] for name, number in zip(ranked, numbers, strict=True)}


def _sources(source: str | Path, count: int, seed: int) -> tuple[str, list[PartedSource], list[Refused]]:
    """A family's name and shapes, and files that are none that is read."""
    if str(source) in FAMILIES:
        if count < 1:
            raise SettingError(f"{count} shapes of {source} were asked for; expected 2 or more")
        return str(source), [MadeShape(str(source), seed, number) for number in range(count)], []
    folder = Path(source)
    if not folder.is_dir():
        raise FamilyError(
            f"{source}: neither a folder nor one of {', '.join(FAMILIES)}; give a folder of shapes, or a name"
        )
    found = find_shapes(folder)
    unread = [Refused(*told) for told in unread_files(folder, {shape.name for shape in found})]
    return folder.absolute().name, found, unread


def _with_parts(
    sources: Sequence[PartedSource], parts: tuple[str, ...], refused: list[Refused]
) -> tuple[list[PartedSource], tuple[str, ...]]:
    """The shapes whose parts can be named, and the family's parts: those given, or all in order of coming."""
    kept, told = [], dict[str, tuple[str, ...]]()
    for source in sources:
        try:
            told[source.name] = source.part_names()
            kept.append(source)
        except PartwrightError as error:
            refused.append(Refused(source.name, str(error)))
    if any(len(names) > 1 for names in told.values()):
        for name in _unnamed(told):
            del told[name]
            why = "is one piece without a name; name its nodes, or put FILE.labels.json beside it"
            refused.append(Refused(name, why))
        kept = [source for source in kept if source.name in told]
    seen = dict.fromkeys(name for names in told.values() for name in names)
    missing = [part for part in parts if part not in seen]
    if missing:
        raise FamilyError(
            f"no shape has {', '.join(missing)}; the shapes' parts are {', '.join(seen) or 'unknown'}. "
            "Name the parts as the shapes do"
        )
    names = parts or tuple(seen)
    _check_names(told, names)
    if len(names) > MOST_PARTS:
        raise FamilyError(f"{len(names)} different part names; at most {MOST_PARTS} can be told apart")
    return kept, names


def _unnamed(told: Mapping[str, tuple[str, ...]]) -> set[str]:
    """Shapes of one piece that a reader called after its file, for want of a name: no other shape has such a
    part. told: the names of each shape's parts."""
    holders = Counter(name for names in told.values() for name in set(names))
    return {shape for shape, names in told.items() if names == (shape,) and holders[shape] == 1}


def _check_names(told: Mapping[str, tuple[str, ...]], names: tuple[str, ...]) -> None:
    """Raise FamilyError where part names tell nothing: spelled in two ways, or none in two shapes.

    told: the names of each shape's parts.
    """
    holders = {name: [shape for shape, own in told.items() if name in own] for name in names}
    plain: dict[str, str] = {}
    pairs = []
    for name in names:
        other = plain.setdefault("".join(c for c in name.casefold() if c.isalnum()) or name, name)
        if other != name and not set(holders[other]) & set(holders[name]):
            pairs.append(f"{other!r} (as in {holders[other][0]}) and {name!r} (as in {holders[name][0]})")
    if pairs:
        raise FamilyError(f"part names that differ in spelling alone; name them alike: {'; '.join(pairs)}")
    if len(told) > 1 and all(len(having) < 2 for having in holders.values()):
        some = "; ".join(f"{shape} has {', '.join(told[shape])}" for shape in list(told)[:2])
        raise FamilyError(
            f"no part name is in two shapes: {some}. Name the nodes of each file after its parts, alike in "
            "all, or put FILE.labels.json beside it"
        )


def _check_enough(name: str, sources: Sequence[PartedSource], refused: Sequence[Refused]) -> None:
    if len(sources) < 2:
        usable = "1 usable shape" if len(sources) == 1 else f"{len(sources)} usable shapes"
        raise FamilyError(f"{name}: {usable}; a family needs at least two{reasons_of(refused)}")


def _start(output: Path) -> None:
    """Make the folders. A manifest that is there says that the folder is complete, which it no longer is."""
    check_folder(output)
    try:
        (output / SHAPES).mkdir(parents=True, exist_ok=True)
        (output / MANIFEST).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write into {output}: {error.strerror}; choose another place") from error


def _run(jobs: Sequence[_Job], workers: int) -> Iterator[tuple[_Job, str]]:
    """Each job as it is done, with the reason why its shape was refused, or ""."""
    if min(workers, len(jobs)) == 1:
        yield from ((job, _prepare_shape(job)) for job in jobs)
        return
    with ProcessPoolExecutor(min(workers, len(jobs)), get_context("spawn"), end_with_parent) as pool:
        waiting = {pool.submit(_prepare_shape, job): job for job in jobs}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _prepare_shape(job: _Job) -> str:
    """Write the shape's file unless it is there already; returns why that cannot be, or ""."""
    try:
        key = _key(job)
        if _is_done(job.path, key):
            return ""
        shape, about = _sampled(job)
        write_shape(job.path, shape, {"key": key, **about})
    except OutputError:
        raise
    except PartwrightError as error:
        return str(error)
    return ""


def _key(job: _Job) -> str:
    """Of all that the file depends on."""
    about = (_REVISION, job.source.fingerprint(), job.parts, job.samples, job.seed)
    return hashlib.sha256(repr(about).encode()).hexdigest()


def _is_done(path: Path, key: str) -> bool:
    if not path.exists():
        return False
    try:
        return read_about(path).get("key") == key
    except PartwrightError:  # cut short or of another program: it is written anew
        return False


def _sampled(job: _Job) -> tuple[PreparedShape, dict[str, Any]]:
    """The shape with poses that are still to be agreed on, all `fits` of each part, what the surface's
    `repairs` were, what of its files is `unread`, and the axis that is `up` by them."""
    read = job.source.read()
    labelled = label_surface(read, job.parts)
    points, sdf, part = sample(labelled, job.samples, _seed_of(job))
    fits = {number: fit_primitives(v, job.seed) for number, v in labelled.vertices.items()}
    present = np.array([number in fits for number in range(len(job.parts))], dtype=np.uint8)
    shape = labelled.shape
    prepared = PreparedShape(
        job.source.name,
        points,
        sdf,
        part,
        Poses.identity(len(job.parts)),
        present,
        shape.frame.to_unit(shape.vertices).astype(np.float32),
        shape.faces.astype(np.int32),
        labelled.label,
        shape.frame,
    )
    rows = {job.parts[number]: [fit.to_row() for fit in found] for number, found in fits.items()}
    return prepared, {
        "fits": rows,
        "repairs": list(shape.repairs),
        "unread": list(read.unread),
        "up": read.up,
    }


def _seed_of(job: _Job) -> int:
    """Another stream for each shape, whatever the others are."""
    return int.from_bytes(hashlib.sha256(f"{job.seed}:{job.source.name}".encode()).digest()[:4], "big")


def _finish(
    output: Path, name: str, jobs: Sequence[_Job], split: dict[str, str], up: str | None
) -> PreparedFamily:
    """Agree on poses, write them into the shapes' files, and write the manifest."""
    parts = jobs[0].parts
    about = [read_about(job.path) for job in jobs]
    present = np.array([[part in a["fits"] for part in parts] for a in about])
    absent = [part for number, part in enumerate(parts) if not present[:, number].any()]
    if absent:
        raise FamilyError(f"{name}: no usable shape has {', '.join(absent)}; leave the name out of the parts")
    poses = _agreed_poses(parts, about, present)
    average = average_poses(present, poses)
    entries = []
    for job, has, own, said in zip(jobs, present, poses, about, strict=True):
        shape = read_shape(job.path, job.source.name)
        shape = replace(shape, poses=_filled(own, average, has))
        kept = ("key", "fits", "repairs", "unread", "up")
        extra: dict[str, Any] = {key: said[key] for key in kept if key in said}
        digest = write_shape(job.path, shape, extra)
        entries.append(Entry(shape.name, f"{SHAPES}/{job.path.name}", split[shape.name], digest))
    up = up or _usual(one.get("up") for one in about)
    write_manifest(output, name, parts, entries, jobs[0].samples, average, jobs[0].seed, up or UP)
    return PreparedFamily(output)


def _usual(ups: Iterable[str | None]) -> str | None:
    """The axis that most shapes say points up; None where none says any."""
    told = Counter(up for up in ups if up is not None)
    return told.most_common(1)[0][0] if told else None


def _agreed_poses(
    parts: Sequence[str], about: Sequence[dict[str, Any]], present: NDArray[np.bool_]
) -> list[Poses]:
    """Poses of P rows for each shape; those of missing parts are still the identity."""
    rows = [[Poses.identity(1)] * len(parts) for _ in about]
    for number, part in enumerate(parts):
        having = np.flatnonzero(present[:, number]).tolist()
        fits = [[PrimitiveFit.from_row(row) for row in about[i]["fits"][part]] for i in having]
        for i, fit in zip(having, agreed(fits), strict=True):
            rows[i][number] = fit.pose()
    return [Poses.joined(row) for row in rows]


def _filled(poses: Poses, average: Poses, present: NDArray[np.bool_]) -> Poses:
    """A missing part has the average pose (PartSDF, section 3.3)."""
    has = present[:, None]
    return Poses(
        np.where(has, poses.translation, average.translation),
        np.where(has, poses.rotation, average.rotation),
        np.where(has, poses.scale, average.scale),
    )
