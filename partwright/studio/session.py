"""One assembly in the studio: its journal, the shape beside it, the fit that may be running, its scores."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from partwright.assembly import Assembly
from partwright.assembly.file_text import to_text
from partwright.assembly.files import from_text
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError, PartwrightError, SettingError
from partwright.export.formats import FORMATS
from partwright.fitting import Start, fit
from partwright.methods import METHODS, Cancellation, Progress
from partwright.metrics import evaluate
from partwright.shapes import Shape
from partwright.studio import messages
from partwright.studio.journal import Journal

Send = Callable[[Any], None]

_SHOWN_EVERY = 0.4  # seconds between two assemblies of a running fit
_QUIET = 0.4  # seconds without an edit before scores are taken


class Session:
    """All methods but `_work...` run in the server's event loop."""

    def __init__(self, journal: Journal, file: Path, shape: Shape | None) -> None:
        self.journal, self.file, self.shape = journal, file, shape
        self._pages: set[Send] = set()
        self._cancel: Cancellation | None = None
        self._scoring: asyncio.Task[None] | None = None
        self._busy = threading.Lock()

    # Pages

    def join(self, send: Send) -> None:
        self._pages.add(send)
        send(self.state(self.journal.note))
        self.score_soon()

    def leave(self, send: Send) -> None:
        self._pages.discard(send)

    def tell(self, message: Any, but: Send | None = None) -> None:
        for send in self._pages:
            if send != but:
                send(message)

    def state(self, note: str = "") -> messages.State:
        past, future = self.journal.steps()
        shape = self.shape
        box = np.ptp(shape.vertices, axis=0) if shape else None
        corners = (
            [shape.vertices.min(axis=0), shape.vertices.max(axis=0)] if shape and box is not None else []
        )
        return messages.State(
            revision=self.journal.revision,
            text=self.journal.text,
            past=past,
            future=future,
            file=self.file.name,
            saved=self.journal.text == self.journal.saved,
            input=(shape.file or shape.name) if shape else "",
            box=[float(v) for corner in corners for v in corner],
            unit=(shape.unit if shape else None) or "",
            up=(shape.up if shape else None) or "",
            methods=[name for name in METHODS if name != "parts"],
            formats=list(FORMATS.own),
            fitting=self._cancel is not None,
            note=note,
        )

    def assembly(self) -> Assembly:
        """Raises AssemblyFileError where there is none yet."""
        return from_text(self.journal.text)

    # What pages ask for

    def heard(self, message: Any, send: Send) -> None:
        """Raises PartwrightError for what cannot be done."""
        if isinstance(message, messages.Commit | messages.Undo | messages.Redo):
            self._edit(message, send)
        elif isinstance(message, messages.Fit):
            self._fit(message)
        elif isinstance(message, messages.Stop):
            if self._cancel is not None:
                self._cancel.request()
        elif isinstance(message, messages.Save):
            self._save()

    def _edit(self, message: messages.Commit | messages.Undo | messages.Redo, send: Send) -> None:
        if message.base != self.journal.revision:
            send(self.state("Another page has changed the assembly; your change comes on top of its own."))
            return
        if isinstance(message, messages.Commit):
            from_text(message.text)  # nothing gets into the journal that cannot be read again
            self.journal.commit(message.label[:200], message.text)
        elif isinstance(message, messages.Undo):
            self.journal.undo()
        else:
            self.journal.redo()
        send(messages.Accepted(self.journal.revision))
        self.tell(self.state(), but=send)
        self.score_soon()

    def _save(self) -> None:
        assembly = self.assembly()
        write_bytes(self.file, to_text(assembly).encode())
        self.journal.mark_saved()
        self.tell(messages.Saved(str(self.file)))

    def replace_shape(self, shape: Shape) -> None:
        """Another input beside the assembly."""
        self.shape = shape
        self.tell(self.state())
        self.score_soon()

    def commit(self, label: str, assembly: Assembly) -> None:
        """An edit by the server itself."""
        self.journal.commit(label, to_text(assembly))
        self.tell(self.state())
        self.score_soon()

    # Fitting

    def _fit(self, message: messages.Fit) -> None:
        if self.shape is None:
            raise SettingError(
                "there is no shape to fit to: drop one into the page, or name it on the command line"
            )
        if self._cancel is not None:
            raise SettingError("a fit is running already; stop it first")
        start, label = None, "Fit"
        settings: dict[str, Any] = {}
        if message.mode != "new":
            assembly = self.assembly()
            names = {part.name for part in assembly.parts}
            chosen = [name for name in message.names if name in names]
            locked = chosen if message.mode == "except" else sorted(names - set(chosen))
            if len(locked) == len(names):
                raise SettingError("every part is locked, so there is nothing to refit")
            start = Start(assembly, tuple(locked))
            free = sorted(names - set(locked))
            label = f"Refit {free[0] if len(free) == 1 else f'{len(free)} parts'}"
            settings["max_parts"] = len(assembly)
        elif message.max_parts is not None:
            settings["max_parts"] = message.max_parts
        self._cancel = Cancellation()
        loop = asyncio.get_running_loop()
        shape, cancel = self.shape, self._cancel

        def on_loop(function: Callable[..., None], *arguments: Any) -> None:
            loop.call_soon_threadsafe(function, *arguments)

        last = [0.0]

        def progress(step: Progress) -> None:
            text = ""
            if time.monotonic() - last[0] > _SHOWN_EVERY:
                best = step.assembly()
                text = to_text(best) if best is not None else ""
                last[0] = time.monotonic()
            told = messages.Fitting(step.stage, step.fraction, step.parts, float(step.iou), text)
            on_loop(self.tell, told)

        def work() -> None:
            try:
                result = fit(
                    shape, message.method, quality=message.quality, start=start,
                    progress=progress, cancel=cancel, **settings,
                )  # fmt: skip
            except PartwrightError as error:
                on_loop(self._fit_ended, None, label, messages.Failed(str(error)))
            except Exception as error:
                on_loop(self._fit_ended, None, label, messages.Failed(f"the fit failed: {error!r}"))
                raise
            else:
                done = messages.Fitted(result.outcome, len(result.assembly), float(result.scores.iou))
                on_loop(self._fit_ended, _with_locked(result.assembly, start), label, done)

        threading.Thread(target=work, name="fit", daemon=True).start()
        self.tell(messages.Fitting("starting", 0.0, 0, 0.0))

    def _fit_ended(self, assembly: Assembly | None, label: str, told: Any) -> None:
        self._cancel = None
        if assembly is not None:
            self.journal.commit(label, to_text(assembly))
        self.tell(told)
        self.tell(self.state())
        self.score_soon()

    # Scores

    def score_soon(self) -> None:
        """In the background, once edits have paused."""
        if self._scoring is not None:
            self._scoring.cancel()
        if self.shape is not None and self.journal.text and self._cancel is None:
            self._scoring = asyncio.create_task(self._score())

    async def _score(self) -> None:
        await asyncio.sleep(_QUIET)
        revision, text, shape = self.journal.revision, self.journal.text, self.shape
        assert shape is not None
        try:
            scores = await asyncio.to_thread(self._work_scores, text, shape)
        except NoSurfaceError:
            return
        except PartwrightError as error:
            self.tell(messages.Failed(f"no scores: {error}"))
            return
        if revision == self.journal.revision:
            told = messages.Scored(
                revision,
                scores.iou,
                scores.chamfer,
                scores.max_deviation,
                scores.deviation_95,
                scores.overlap,
            )
            self.tell(told)

    def _work_scores(self, text: str, shape: Shape) -> Any:
        with self._busy:  # one at a time; what was cancelled while it waited is not missed
            return evaluate(from_text(text), shape, emd=False)

    def stop(self) -> None:
        if self._cancel is not None:
            self._cancel.request()
        if self._scoring is not None:
            self._scoring.cancel()


def _with_locked(assembly: Assembly, start: Start | None) -> Assembly:
    """Locked solids under their own names: a fit of SuperFrusta gives them back as what they also are."""
    for name in start.locked if start else ():
        if any(part.name == name for part in assembly.parts):
            assembly = assembly.replace_part(name, start.assembly[name])  # type: ignore[union-attr]
    return assembly
