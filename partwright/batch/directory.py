"""Every shape of a folder fitted, each into a folder of its own: begun, resumed, tried again.

OUT/batch.json            what is done to which folder; the same on every run
OUT/manifest*.jsonl       one line an item: what became of it (`manifest`)
OUT/items/ab/abcd.../     the files of a fit, all or none
OUT/index.html, .csv      written at the end of each run (`index`)
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from partwright.atomic_io import write_bytes
from partwright.batch.items import Item, items_of
from partwright.batch.manifest import DONE, Entry, Manifest, appending, latest
from partwright.batch.on_ray import Cluster
from partwright.batch.pool import Answer, Limits, Pool
from partwright.errors import OutputError, SettingError
from partwright.methods import METHODS, Cancellation

_PLAN = "batch.json"


@dataclass(frozen=True)
class Plan:
    """What a batch does: the folder of shapes, and how each is fitted."""

    source: Path
    method: str = "superfrusta"
    options: dict[str, Any] = field(default_factory=dict)
    """Of `partwright.fit`, as JSON can hold them."""
    unit: str | None = None
    up: str | None = None
    thickness: str | None = None

    def save(self, output: Path) -> None:
        """Into the output folder, which is made; what is there already must be the same batch.

        Raises:
            SettingError: another batch lies there.
            OutputError: it cannot be written.
        """
        text = (
            json.dumps(asdict(self) | {"source": str(self.source.resolve())}, indent=2, sort_keys=True) + "\n"
        )
        path = output / _PLAN
        if path.exists():
            before = Plan.load(output)
            ours = asdict(self) | {"source": self.source.resolve()}
            other = [name for name, value in asdict(before).items() if value != ours[name]]
            if other:
                raise SettingError(
                    f"{output} holds a batch that was begun with {other[0]} {asdict(before)[other[0]]}; "
                    "give the same now, or another folder with -o"
                )
            return
        try:
            output.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot write into {output}: {error.strerror or error}") from error
        write_bytes(path, text.encode())

    @classmethod
    def load(cls, output: Path) -> Plan:
        """Raises SettingError where no batch lies in the folder."""
        try:
            found = json.loads((output / _PLAN).read_bytes())
            return cls(**(found | {"source": Path(found["source"])}))
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise SettingError(f"{output}: expected the output folder of a batch ({error})") from error


@dataclass(frozen=True)
class Share:
    """Which items a run does: shard `index` (from 1) of `count`, and at most `limit` of them."""

    index: int = 1
    count: int = 1
    limit: int | None = None
    again: bool = False
    """Those that failed before, too."""
    only_failed: bool = False
    """Nothing that was not begun yet."""

    def __post_init__(self) -> None:
        if not 1 <= self.index <= self.count:
            raise SettingError(f"--shard {self.index}/{self.count}: expected I/N with I from 1 to N")
        if self.limit is not None and self.limit < 1:
            raise SettingError(f"--limit {self.limit}: expected a number of shapes from 1 on")

    @property
    def manifest(self) -> str:
        """Its file: shards may run at once, on one disk."""
        return f"manifest-{self.index}-of-{self.count}.jsonl" if self.count > 1 else "manifest.jsonl"

    def has(self, item: Item) -> bool:
        return int(item.name, 16) % self.count == self.index - 1


def fit_folder(
    plan: Plan,
    output: Path,
    share: Share | None = None,
    at_once: int = 0,
    limits: Limits | None = None,
    told: Callable[[Entry, int], None] | None = None,
    cancel: Cancellation | None = None,
    ray: str | None = None,
) -> bool:
    """Fits what has no result yet; says whether it came to the end of its share.

    Interrupted at any moment, by whatever means, the same call goes on: what is finished stays, what was in
    flight is done again, nothing is done twice.

    Args:
        share: all if not given.
        limits: a quarter of an hour and 8 GB if not given.
        at_once: worker processes; 0: one a core. Each has its share of the cores.
        told: of each item that has ended, and how many items were found so far.
        cancel: ends the workers; what they were at is lost.
        ray: address of a Ray cluster ("auto": the one that this machine is part of), whose nodes share the
            disk; `at_once` is then over all of them, one thread each.

    Raises:
        SettingError: an unknown method, another batch in the folder, the folder with the shapes itself, or a
            value that cannot be used.
        OutputError: the folder cannot be written, another process is at work there, or no cluster answers.
        MissingDependencyError: Ray is not installed.
    """
    if plan.method not in METHODS:
        raise SettingError(f"method: expected one of {', '.join(METHODS)}, got {plan.method!r}")
    if at_once < 0:
        raise SettingError(f"--at-once {at_once}: expected a number of processes, or 0 for one a core")
    share, limits = share or Share(), limits or Limits()
    if output.resolve() == plan.source.resolve():
        raise SettingError(f"{output}: the folder with the shapes; give another to write into with -o")
    cancel = cancel or Cancellation()
    with Cluster(ray) if ray else nullcontext() as cluster:
        plan.save(output)
        cores = cluster.cores if cluster else os.cpu_count() or 1
        at_once = at_once or cores
        threads = 1 if cluster else max(1, cores // at_once)
        with appending(output / share.manifest) as manifest:
            work = _Work(plan, output, share, manifest, threads, told)
            Pool[Item](at_once, limits, cancel, cluster=cluster).run(work.jobs(), work.done)
            shutil.rmtree(work.staging, ignore_errors=True)
    return not cancel.requested


class _Work:
    """One run: the jobs that are left, and what becomes of their answers."""

    def __init__(
        self,
        plan: Plan,
        output: Path,
        share: Share,
        manifest: Manifest,
        threads: int,
        told: Callable[[Entry, int], None] | None,
    ) -> None:
        self._plan, self._output, self._share, self._manifest = plan, output, share, manifest
        self._options = {"threads": threads, **plan.options}
        self._told = told or (lambda entry, found: None)
        self._found = 0
        self.staging = output / f".staging-{share.manifest}"
        shutil.rmtree(self.staging, ignore_errors=True)

    def jobs(self) -> Iterator[tuple[Item, dict[str, Any]]]:
        """Of items without a result; finished folders that no manifest knows yet are entered on the way."""
        known = latest(self._output)
        begun: set[str] = set()
        for item in items_of(self._plan.source, self._output):
            if not self._share.has(item):
                continue
            self._found += 1
            entry = known.get(item.name)
            finished = item_folder(self._output, item.name)
            if entry is not None and (entry.status == DONE or not self._share.again):
                continue
            if item.name in begun or (entry is None and self._share.only_failed):
                continue
            if finished.is_dir():
                self._enter(Entry(item.name, item.file, DONE, result=_reported(finished)))
                continue
            if item.trouble:
                self._enter(Entry(item.name, item.file, "failed", item.trouble))
                continue
            if self._share.limit is not None and len(begun) >= self._share.limit:
                return
            begun.add(item.name)
            yield (
                item,
                {
                    "path": str((self._plan.source / item.file).absolute()),
                    "folder": str((self.staging / item.name).absolute()),
                    "method": self._plan.method,
                    "options": self._options,
                    "unit": self._plan.unit,
                    "up": self._plan.up,
                    "thickness": self._plan.thickness,
                },
            )

    def done(self, item: Item, answer: Answer) -> None:
        """The folder in its place by one rename, and then the line."""
        staged, final = self.staging / item.name, item_folder(self._output, item.name)
        if answer.status == DONE:
            final.parent.mkdir(parents=True, exist_ok=True)
            with suppress(OSError):  # another shard, or a run without locks, was first
                os.rename(staged, final)
        shutil.rmtree(staged, ignore_errors=True)
        self._enter(
            Entry(
                item.name,
                item.file,
                answer.status,
                answer.reason,
                round(answer.seconds, 2),
                answer.peak_memory,
                answer.result,
            )
        )

    def _enter(self, entry: Entry) -> None:
        self._manifest.append(entry)
        self._told(entry, self._found)


def item_folder(output: Path, name: str) -> Path:
    """Where an item's files lie: not all in one folder, which file systems dislike."""
    return output / "items" / name[:2] / name


def _reported(folder: Path) -> dict[str, Any]:
    report = json.loads((folder / "report.json").read_bytes())
    return {name: report[name] for name in ("outcome", "parts", "scores", "warnings")}
