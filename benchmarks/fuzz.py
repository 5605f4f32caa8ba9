"""Broken files and odd commands: every one ends well, or with one named line and nothing half written.

    python benchmarks/fuzz.py [--files 500] [--commands 500] [--seed 0]

Files are made from small shapes of our own, one of every format that is read, and broken: cut, bits flipped,
numbers swapped for impossible ones, counts raised, pieces repeated or nested. Commands mix subcommands,
options and values, valid and not, on tiny inputs. Each case runs in a fork of a process that has everything
imported; it is killed after --limit seconds of computing, so that a busy machine makes no hangs, or after ten
times as many on the clock; its peak memory is measured. The table goes to benchmarks/results/fuzz.md. Exits
with 1 unless every case is fine or a named error under 2 GB.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import os
import random
import resource
import shlex
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from fuzz_cases import Files, broken_file, odd_files, random_command, whole_files

from partwright.atomic_io import write_bytes
from partwright.cli.main import main as partwright
from partwright.errors import PartwrightError
from partwright.shapes import load_shape

TARGET = Path(__file__).parent / "results" / "fuzz.md"
MEMORY = 2 << 30  # bytes
LONGEST_LINE = 1500  # characters of an error
WAYS = ("fine", "named error", "traceback", "crash", "hang", "over memory", "left output", "long line")
PRELOADED = (
    "trimesh", "scipy.spatial", "scipy.sparse.csgraph", "igl", "fcpw", "lxml.etree", "manifold3d",
    "partwright.fitting", "partwright.superfrusta.solids", "partwright.capri", "partwright.cleaning",
    "partwright.export", "partwright.render", "partwright.metrics",
)  # fmt: skip


@dataclass(frozen=True)
class Ended:
    """One case: how it ended, its CPU seconds, its peak memory in bytes, and the last line that it said."""

    way: str
    seconds: float
    memory: int
    said: str


@dataclass(frozen=True)
class Case:
    """A name, the arguments of `partwright` (or `load FILE`), and files beside the whole ones."""

    name: str
    command: list[str]
    files: Files


@dataclass(frozen=True)
class Tried:
    case: Case
    ended: Ended


def file_cases(files: Files, count: int, seed: int) -> Iterator[Case]:
    """Shapes are loaded and asked for their inside, assemblies described, or exported by their surface."""
    for number in range(count):
        rng = random.Random(f"{seed} file {number}")
        name, data, way = broken_file(files, rng)
        command = ["load", name]
        if name.endswith(".json"):
            command = rng.choice(
                (["export", name, "-o", "out.ply", "--resolution", "16"], ["describe", name])
            )
        yield Case(f"{name} {way}", command, {name: data})


def command_cases(count: int, seed: int) -> Iterator[Case]:
    for number in range(count):
        command = random_command(random.Random(f"{seed} command {number}"))
        yield Case(command[0] if command else "", command, {})


def load(path: str) -> int:
    """What every command does with a shape, and no more: `partwright` with these arguments takes seconds."""
    try:
        shape = load_shape(path)
        shape.unit_occupancy(16)
        print(shape.volume)
    except PartwrightError as error:
        print(f"error: {error}")
        return error.exit_code
    return 0


def run_case(command: list[str], folder: Path, limit: int) -> Ended:
    """`partwright` with these arguments in a copy of `folder`, in a forked process."""
    before = sorted(folder.rglob("*"))
    log = folder.parent / "log"
    child = os.fork()
    if child == 0:
        _in_child(command, folder, log, limit)
    _, status, used = os.wait4(child, 0)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # what it may have started
    seconds, text = used.ru_utime + used.ru_stime, log.read_text("utf-8", "replace")
    left = sorted(set(folder.rglob("*")) - set(before))
    lines = [line for line in text.splitlines() if line.strip()] or [""]
    way = _way(status, text, lines, used.ru_maxrss * 1024, bool(left))
    return Ended(way, seconds, used.ru_maxrss * 1024, lines[-1][:300])


def _in_child(command: list[str], folder: Path, log: Path, limit: int) -> None:
    """Never returns: exit code 70 stands for an exception that was not caught."""
    os.setsid()
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(10 * limit)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (3 * MEMORY, 3 * MEMORY))  # the machine outlives a bomb
    output = os.open(log, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(output, stream)
    faulthandler.enable()
    os.chdir(folder)
    code = 70
    try:
        code = load(command[1]) if command[:1] == ["load"] else partwright(command)
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:
        traceback.print_exc()
    with contextlib.suppress(BaseException):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _way(status: int, text: str, lines: list[str], memory: int, left: bool) -> str:
    if os.WIFSIGNALED(status):
        return "hang" if os.WTERMSIG(status) in (signal.SIGALRM, signal.SIGXCPU) else "crash"
    code = os.WEXITSTATUS(status)
    if "Traceback (most recent call last)" in text or code not in (0, 2):
        return "traceback"
    if memory > MEMORY:
        return "over memory"
    if code == 0:
        return "fine"
    if "error: " not in lines[-1]:
        return "traceback"
    return "left output" if left else "long line" if len(lines[-1]) > LONGEST_LINE else "named error"


def run_all(cases: Iterator[Case], files: Files, limit: int, show: Callable[[str], None]) -> list[Tried]:
    results: list[Tried] = []
    with tempfile.TemporaryDirectory() as scratch:
        template = Path(scratch) / "template"
        template.mkdir()
        for name, data in files.items():
            (template / name).write_bytes(data)
        for case in cases:
            folder = Path(scratch) / "case"
            shutil.copytree(template, folder)
            if not case.files:
                odd_files(folder)
            for path, data in case.files.items():
                (folder / path).write_bytes(data)
            ended = run_case(case.command, folder, limit)
            if ended.way not in ("fine", "named error"):
                show(f"{ended.way}: {case.name}: {shlex.join(case.command)[:300]}\n    {ended.said}")
                keep_broken(case.files, len(results))
            results.append(Tried(case, ended))
            shutil.rmtree(folder)
    return results


def keep_broken(own: Files, number: int) -> None:
    """Where FUZZ_KEEP names a folder, files that fail are kept there to look at."""
    folder = os.environ.get("FUZZ_KEEP")
    if folder:
        for name, data in own.items():
            (Path(folder) / f"{number}-{name}").write_bytes(data)


def document(results: dict[str, list[Tried]], command: str) -> str:
    lines = [
        "# Broken files and odd commands",
        "",
        f"`{command}`",
        "",
        "Every case in a process of its own. A named error is one line, exit code 2, and nothing written.",
        "",
        f"| | cases | {' | '.join(WAYS)} | longest CPU s | most MB |",
        "|" + "---|" * (len(WAYS) + 4),
    ]
    for title, cases in results.items():
        rows: dict[str, list[Ended]] = defaultdict(list)
        for tried in cases:
            rows[_group(title, tried.case.name)].append(tried.ended)
            rows[f"**all {title}**"].append(tried.ended)
        for name in sorted(rows):
            lines.append(_row(name, rows[name]))
    return "\n".join(lines) + "\n"


def _group(title: str, name: str) -> str:
    """Files by their suffix, commands by the subcommand."""
    if title == "files":
        return Path(name.split(" ")[0]).suffix
    return name if name in ("fit", "export", "evaluate", "describe", "clean", "segment", "parts") else "other"


def _row(name: str, ended: list[Ended]) -> str:
    counts = Counter(one.way for one in ended)
    longest, most = max(one.seconds for one in ended), max(one.memory for one in ended)
    cells = [str(counts[way]) for way in WAYS]
    return f"| {name} | {len(ended)} | {' | '.join(cells)} | {longest:.1f} | {most / 1e6:.0f} |"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--files", type=int, default=500, metavar="N")
    parser.add_argument("--commands", type=int, default=500, metavar="N")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--limit", type=int, default=60, metavar="S", help="CPU seconds until a case is a hang"
    )
    parser.add_argument("--to", type=Path, default=TARGET, metavar="FILE", help="the table")
    options = parser.parse_args()
    for module in PRELOADED:
        __import__(module)
    with tempfile.TemporaryDirectory() as folder:
        files = whole_files_in_child(Path(folder))

    def show(text: str) -> None:
        print(text, flush=True)

    results = {
        "files": run_all(file_cases(files, options.files, options.seed), files, options.limit, show),
        "commands": run_all(command_cases(options.commands, options.seed), files, options.limit, show),
    }
    command = f"python benchmarks/fuzz.py --files {options.files} --commands {options.commands}"
    write_bytes(options.to, document(results, f"{command} --seed {options.seed}").encode())
    print(f"written to {options.to}")
    ways = {tried.ended.way for cases in results.values() for tried in cases}
    return int(not ways <= {"fine", "named error"})


def whole_files_in_child(folder: Path) -> Files:
    """`whole_files`, made by a child: thread pools that the kernel starts do not live through a fork."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            whole_files(folder)
            code = 0
        except BaseException:
            traceback.print_exc()
        os._exit(code)
    if os.waitpid(child, 0)[1]:
        raise SystemExit("the whole files could not be made")
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.suffix != ".report"}


if __name__ == "__main__":
    sys.exit(main())
