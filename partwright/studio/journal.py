"""Edits on disk as they happen: a line each, so that whatever ends the server, none is lost."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

from partwright.errors import OutputError
from partwright.studio.images import Images
from partwright.studio.messages import Curve, Size, Step

_KEPT = 500  # steps that the page is told of; the journal has all


def state_folder() -> Path:
    """Where programs keep what is to outlast them (XDG_STATE_HOME, or ~/.local/state)."""
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "partwright" / "studio"


class Journal:
    """The assembly's text, what came before, and what was undone. Each change is written before it is told.

    Steps are kept without their images, which `images` has once.

    folder: of the state; made if need be, readable by its owner alone. file: the assembly file that is
    edited, which need not exist; original: its text, empty where there is none. A journal that began with
    another text is put aside: the file has been changed by something else since.
    """

    def __init__(self, folder: Path, file: Path, original: str) -> None:
        self.past: list[Step] = []
        self.future: list[Step] = []
        self.images = Images()
        self.short, _ = self.images.taken_out(original)
        """The text without its images."""
        self.revision = 0
        self.curve: Curve | None = None
        """The last fit's assemblies of falling size, until another shape takes the place of the input."""
        self.note = ""
        self._saved = self.short
        name = hashlib.sha256(os.fsencode(file.absolute())).hexdigest()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._path = folder / f"{name}.jsonl"
            self._secret_path = folder / f"{name}.token"
            self._read(original)
            self._out = self._opened(file, original)
        except OSError as error:
            raise OutputError(f"cannot keep edits in {folder}: {error.strerror or error}") from error

    def token(self) -> str:
        """256 bits, the same each time: a page that is still open finds the server again after its end."""
        try:
            known = self._secret_path.read_text("ascii").strip()
        except (OSError, ValueError):
            known = ""
        if len(known) == 64 and all(c in "0123456789abcdef" for c in known):
            return known
        made = secrets.token_hex(32)
        handle = os.open(self._secret_path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "w") as out:
            out.write(made)
        return made

    @property
    def text(self) -> str:
        return self.images.put_back(self.short)

    @property
    def saved(self) -> str:
        return self.images.put_back(self._saved)

    def commit(self, label: str, text: str) -> None:
        short, new = self.images.taken_out(text)
        for name in new:
            self._write({"action": "image", "name": name, "data": self.images.known[name]})
        self._write({"action": "commit", "label": label, "text": short})
        self._apply({"action": "commit", "label": label, "text": short})

    def undo(self) -> None:
        self._move("undo")

    def redo(self) -> None:
        self._move("redo")

    def mark_saved(self) -> None:
        self._write({"action": "saved", "text": self.short})
        self._saved = self.short

    def keep_curve(self, curve: Curve | None) -> None:
        if curve == self.curve:
            return
        self._write({"action": "curve", "curve": asdict(curve) if curve is not None else None})
        self.curve = curve

    def steps(self) -> tuple[list[Step], list[Step]]:
        """The last of what came before, and what was undone."""
        return self.past[-_KEPT:], self.future[-_KEPT:]

    def close(self) -> None:
        self._out.close()

    def _move(self, action: str) -> None:
        if self.past if action == "undo" else self.future:
            self._write({"action": action})
            self._apply({"action": action})

    def _apply(self, line: dict[str, Any]) -> None:
        action = line["action"]
        if action == "curve":
            self.curve = _curve(line["curve"])
            return
        if action == "saved":
            self._saved = line["text"]
            return
        if action == "image":
            self.images.known[line["name"]] = line["data"]
            return
        self.revision += 1
        if action == "commit":
            self.past.append(Step(line["label"], self.short))
            self.future.clear()
            self.short = line["text"]
        elif action in ("undo", "redo"):
            source, target = (self.past, self.future) if action == "undo" else (self.future, self.past)
            step = source.pop()
            target.append(Step(step.label, self.short))
            self.short = step.text

    def _write(self, line: dict[str, Any]) -> None:
        try:
            self._out.write(json.dumps(line) + "\n")
            self._out.flush()
            os.fsync(self._out.fileno())
        except OSError as error:
            raise OutputError(
                f"the edit cannot be kept in {self._path}: {error.strerror or error}"
            ) from error

    def _read(self, original: str) -> None:
        if not self._path.exists():
            return
        lines = self._path.read_text("utf-8", errors="replace").splitlines()
        try:
            head = json.loads(lines[0])
            first = head["original"]
            rest = []
            for line in lines[1:]:
                try:
                    rest.append(json.loads(line))
                except ValueError:
                    break  # the line that was being written when the server ended
            first, _ = self.images.taken_out(first)
            self.short = self._saved = first
            for entry in rest:
                self._apply(entry)
        except (ValueError, KeyError, IndexError, TypeError):
            self._put_aside("was damaged")
            self._reset(original)
            return
        if self.images.taken_out(original)[0] not in (first, self._saved):
            self._put_aside("is of an earlier state of the file, which something else has changed since")
            self._reset(original)
        elif self.revision:
            self.note = "Your edits are here again."

    def _reset(self, original: str) -> None:
        self.past, self.future, self.revision, self.curve = [], [], 0, None
        self.short = self._saved = self.images.taken_out(original)[0]

    def _put_aside(self, why: str) -> None:
        aside = self._path.with_suffix(f".{secrets.token_hex(4)}.old")
        self._path.rename(aside)
        self.note = f"The journal of earlier edits {why}; it is kept as {aside}."

    def _opened(self, file: Path, original: str) -> IO[str]:
        new = not self._path.exists()
        handle = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        out = os.fdopen(handle, "a", encoding="utf-8")
        if new:
            out.write(json.dumps({"file": str(file), "original": original}) + "\n")
            out.flush()
        elif not self._path.read_bytes().endswith(b"\n"):
            out.write("\n")
            out.flush()
        return out


def _curve(kept: dict[str, Any] | None) -> Curve | None:
    return Curve([Size(**size) for size in kept["sizes"]], kept["of"]) if kept else None
