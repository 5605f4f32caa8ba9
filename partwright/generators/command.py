"""A generator that is a command: it reads the picture's file and writes a GLB."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import IO

import psutil

from partwright.errors import GeneratorError, SettingError
from partwright.generators.deadline import POLL, Deadline
from partwright.generators.glb import quoted

_PLACEHOLDER = re.compile(r"\{(input|output|folder)\}")
_TAIL = 4000  # bytes of what it said that are looked at


@dataclass(frozen=True)
class Command:
    """Words of a command line; `{input}`, `{output}` and `{folder}` in them stand for paths."""

    words: tuple[str, ...]

    @classmethod
    def of(cls, line: str) -> Command:
        """Of a line as a shell reads it, but without a shell: no variables, pipes or wildcards.

        Raises:
            SettingError: it is empty, a quote is open, or a placeholder is missing.
        """
        try:
            words = shlex.split(line)
        except ValueError as error:
            raise SettingError(f"via: {line!r} cannot be read as a command ({error})") from error
        found = {name for word in words for name in _PLACEHOLDER.findall(word)}
        if "input" not in found or not found & {"output", "folder"}:
            raise SettingError(
                "via: expected http(s)://... or a command with {input} for the picture and {output} for the "
                f"GLB that it writes, or {{folder}} for the folder that it leaves one in, got {line!r}"
            )
        return cls(tuple(words))

    @property
    def name(self) -> str:
        return f"the generator {self.words[0]}"

    def mesh_of(self, image: Path, deadline: Deadline) -> bytes:
        """What it wrote.

        Raises:
            GeneratorError: it could not be started, failed, took too long, or left no GLB or several.
            CancelledError: it was cancelled.
        """
        with TemporaryDirectory() as place, TemporaryFile() as said:
            folder = Path(place)
            output = folder / "output.glb"
            paths = {"input": str(image.absolute()), "output": str(output), "folder": place}
            words = [_PLACEHOLDER.sub(lambda found: paths[found[1]], word) for word in self.words]
            self._run(words, said, deadline)
            return self._written(output, said)

    def _run(self, words: list[str], said: IO[bytes], deadline: Deadline) -> None:
        try:
            process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise GeneratorError(f"{self.name} cannot be started: {reason}; check the command") from error
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(POLL)
                    break
                deadline.check(self.name)
        finally:
            _end(process)
        if process.returncode:
            how = (
                f"exit code {process.returncode}"
                if process.returncode > 0
                else f"signal {-process.returncode}"
            )
            raise GeneratorError(f"{self.name} failed with {how}{_last_words(said)}")

    def _written(self, output: Path, said: IO[bytes]) -> bytes:
        """The GLB where it was to be, or the only one in that folder, as many programs choose the name."""
        left = [output] if output.is_file() else sorted(p for p in output.parent.rglob("*") if p.is_file())
        there = [path for path in left if path.suffix.lower() == ".glb"]
        if len(there) == 1:
            return there[0].read_bytes()
        names = ", ".join(str(path.relative_to(output.parent)) for path in (there or left)[:5])
        if there:
            raise GeneratorError(f"{self.name} left {len(there)} GLB files ({names}); expected one")
        place = f"where it was to be are {names}" if left else "nothing is where {output} or {folder} said"
        raise GeneratorError(f"{self.name} ended well but wrote no GLB: {place}{_last_words(said)}")


def _end(process: subprocess.Popen[bytes]) -> None:
    """The process and all that it has started, where it still runs."""
    if process.poll() is not None:
        return
    with suppress(psutil.Error):
        for child in psutil.Process(process.pid).children(recursive=True):
            with suppress(psutil.Error):
                child.kill()
    process.kill()
    process.wait()


def _last_words(said: IO[bytes]) -> str:
    """Its last line, where it said one: as a rule that is what went wrong."""
    size = said.seek(0, os.SEEK_END)
    said.seek(max(0, size - _TAIL))
    lines = [line for line in said.read().splitlines() if line.strip()]
    text = quoted(lines[-1]) if lines else ""
    return f": {text}" if text else ""
