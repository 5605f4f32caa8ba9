"""Where a command writes: tried before the work, and never over what is read unless that was asked for."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable
from pathlib import Path

from partwright.atomic_io import check_files, check_folder, check_unread
from partwright.errors import OutputError

Group = argparse._ActionsContainer  # what options can be added to: a parser or a group of its options
Paths = Callable[[argparse.Namespace], Iterable[Path]]
_MAX_BYTES = 255  # of one name, on every common file system


def add_output(
    command: Group,
    metavar: str,
    text: str,
    *,
    reads: Paths,
    writes: Paths,
    folder: Callable[[argparse.Namespace], Path] | None = None,
    required: bool = True,
) -> None:
    """-o and --overwrite. `reads` and `writes` give the files, for `check`; `folder` the one that is made."""
    command.add_argument("-o", "--output", metavar=metavar, type=Path, required=required, help=text)
    command.add_argument(
        "--overwrite", action="store_true", help="write even where that replaces what is read"
    )
    command.set_defaults(reads=reads, writes=writes, folder=folder)


def add_output_folder(command: Group) -> None:
    """The same for commands that write a fit's files into a folder, which is made if need be."""
    text = "where to write; SHAPE-parts if not given"
    add_output(command, "DIR", text, reads=_fit_reads, writes=_fit_writes, folder=_folder, required=False)


def check(arguments: argparse.Namespace) -> None:
    """Before the work: whether a command with `add_output` will be able to write, and not over its inputs.

    Raises:
        OutputError: it will not.
    """
    if "writes" not in arguments:
        return
    if arguments.folder:
        arguments.output = arguments.folder(arguments)
    elif arguments.output is not None and not arguments.output.name:
        raise OutputError(f"cannot write {arguments.output}: give the name of a file with -o")
    writes = list(arguments.writes(arguments))
    if not arguments.overwrite:
        check_unread(writes, arguments.reads(arguments))
    if arguments.folder:
        check_folder(arguments.output, [path.name for path in writes])
    else:
        check_files(writes)


def _folder(arguments: argparse.Namespace) -> Path:
    """-o, or a folder named after SHAPE, shortened where the file system would not take the name."""
    if arguments.output is not None:
        return Path(arguments.output)
    ending = "-parts"
    stem = os.fsencode(arguments.shape.stem)[: _MAX_BYTES - len(ending)]
    return Path(os.fsdecode(stem) + ending)


def _fit_reads(arguments: argparse.Namespace) -> list[Path]:
    start, model = (getattr(arguments, name, None) for name in ("start", "model"))
    return given(arguments.shape, start if isinstance(start, Path) else None, model)


def _fit_writes(arguments: argparse.Namespace) -> list[Path]:
    """A result's files, and those of an earlier one that it removes."""
    from partwright.fitting.result import CURVE_FILES, FILES

    folder: Path = arguments.output
    there = sorted(folder.iterdir()) if folder.is_dir() else []
    names: list[str] = [*FILES, *(path.name for path in there if CURVE_FILES.fullmatch(path.name))]
    if getattr(arguments, "via", None) is not None:
        from partwright.generators import GENERATED

        names.append(GENERATED)
    return [folder / name for name in names]


def given(*paths: str | Path | None) -> list[Path]:
    """Those of the optional arguments that were given."""
    return [Path(path) for path in paths if path is not None]
