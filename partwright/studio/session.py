"""One assembly in the studio: its journal, the shape beside it, the fit that may be running, its scores."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from partwright.assembly import Assembly
from partwright.assembly.file_text import to_text
from partwright.assembly.files import from_text
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError, OutputError, PartwrightError, SettingError
from partwright.export.formats import FORMATS
from partwright.methods import METHODS, Cancellation, Progress
from partwright.metrics import Scores, evaluate
from partwright.shapes import Shape
from partwright.studio import fits, improving, learned, messages
from partwright.studio.journal import Journal
from partwright.textures import Colours

Send = Callable[[Any], None]

_SHOWN_EVERY = 0.4  # seconds between two assemblies of a running fit
_QUIET = 0.4  # seconds without an edit before scores are taken


class Session:
    """All methods but `_work...` run in the server's event loop, which the first page that joins tells of."""

    def __init__(
        self, journal: Journal, file: Path, shape: Shape | None, colours: Colours | None = None
    ) -> None:
        self.journal, self.file, self.shape, self.colours = journal, file, shape, colours
        self._pages: set[Send] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._cancel: Cancellation | None = None
        self._scoring: asyncio.Task[None] | None = None
        self._busy = threading.Lock()
        self._scored: tuple[str, Shape, Scores] | None = None  # the last, which a page that joins asks again

    # Pages

    def join(self, send: Send) -> None:
        self._loop = asyncio.get_running_loop()
        self._pages.add(send)
        send(self.state(self.journal.note))
        if self.journal.curve is not None:
            send(self.journal.curve)
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
        return messages.State(
            revision=self.journal.revision,
            text=self.journal.short,
            past=past,
            future=future,
            images=[messages.Image(name, data) for name, data in self.journal.images.known.items()],
            file=self.file.name,
            saved=self.journal.text == self.journal.saved,
            input=(shape.file or shape.name) if shape else "",
            coloured=self.colours is not None,
            box=shape.bounds().ravel().tolist() if shape else [],
            unit=(shape.unit if shape else None) or "",
            up=(shape.up if shape else None) or "",
            methods=[*(name for name in METHODS if name != "parts"), *learned.methods()],
            donors=self._donors(),
            goals=improving.goals(),
            formats=list(FORMATS.own),
            format_names=[FORMATS[suffix].name for suffix in FORMATS.own],
            fitting=self._cancel is not None,
            note=note,
        )

    def _donors(self) -> list[str]:
        try:
            return learned.donors(self.assembly()) if '"neural"' in self.journal.short else []
        except PartwrightError:
            return []

    def assembly(self) -> Assembly:
        """Raises AssemblyFileError where there is none yet."""
        return from_text(self.journal.text)

    # What pages ask for

    def heard(self, message: Any, send: Send) -> None:
        """Raises PartwrightError for what cannot be done."""
        if isinstance(message, messages.Commit | messages.Undo | messages.Redo):
            self._edit(message, send)
        elif isinstance(message, messages.Fit | messages.Reshape | messages.Bake):
            self._begin(self._task(message))
        elif isinstance(message, messages.Learned):
            self._begin(learned.reforming(self.assembly(), message))
        elif isinstance(message, messages.Improve):
            self._begin(improving.improving(self.assembly(), message))
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
        try:
            if isinstance(message, messages.Commit):
                self.journal.commit(message.label[:200], message.text)
            elif isinstance(message, messages.Undo):
                self.journal.undo()
            else:
                self.journal.redo()
        except OutputError as error:
            send(messages.Unkept(str(error)))
            return
        send(messages.Accepted(self.journal.revision))
        self.tell(self.state(), but=send)
        self.score_soon()

    def _save(self) -> None:
        assembly = self.assembly()
        write_bytes(self.file, to_text(assembly).encode())
        self.journal.mark_saved()
        self.tell(messages.Saved(str(self.file)))

    def replace_shape(self, shape: Shape, colours: Colours | None) -> None:
        """Another input beside the assembly."""
        self.journal.keep_curve(None)
        self.shape, self.colours = shape, colours
        self.tell(self.state())
        self.score_soon()

    def commit(self, label: str, assembly: Assembly) -> None:
        """An edit by the server itself."""
        self.journal.commit(label, to_text(assembly))
        self.tell(self.state())
        self.score_soon()

    # Fitting

    def _task(self, message: messages.Fit | messages.Reshape | messages.Bake) -> fits.Task:
        if self.shape is None:
            raise SettingError(
                "there is no shape to fit to: drop one into the page, or name it on the command line"
            )
        if isinstance(message, messages.Fit):
            return fits.fitting(self.shape, message, self.assembly)
        if isinstance(message, messages.Bake):
            return fits.baking(self.colours, self.assembly(), message.size)
        return fits.reshaping(self.shape, message, self.assembly())

    def _begin(self, task: fits.Task) -> None:
        if self._cancel is not None:
            raise SettingError("a fit is running already; stop it first")
        self._cancel = Cancellation()
        threading.Thread(target=self._work_on, args=(task, self._cancel), name="fit", daemon=True).start()
        self.tell(messages.Fitting("starting", 0.0, 0, 0.0))

    def _work_on(self, task: fits.Task, cancel: Cancellation) -> None:
        last = time.monotonic()

        def progress(step: Progress | messages.Improving) -> None:
            nonlocal last
            if isinstance(step, messages.Improving):
                self._on_loop(self.tell, step)
                return
            text = ""
            if time.monotonic() - last > _SHOWN_EVERY:
                best = step.assembly()
                text = to_text(best) if best is not None else ""
                last = time.monotonic()
            told = messages.Fitting(step.stage, step.fraction, step.parts, float(step.iou), text)
            self._on_loop(self.tell, told)

        try:
            done = task.work(progress, cancel)
        except PartwrightError as error:
            self._on_loop(self._fit_failed, str(error))
        except Exception as error:
            self._on_loop(self._fit_failed, f"the fit failed: {error!r}")
            raise
        else:
            self._on_loop(self._fit_ended, task.label, done)

    def _fit_ended(self, label: str, done: fits.Done) -> None:
        try:
            self.journal.commit(label, to_text(done.assembly))
            if done.curve is not None:
                self.journal.keep_curve(done.curve)
        except PartwrightError as error:  # the disk is full
            self._fit_failed(str(error))
            return
        self._cancel = None
        if done.curve is not None:
            self.tell(done.curve)
        self.tell(done.told)
        self.tell(self.state())
        self.score_soon()

    def _fit_failed(self, why: str) -> None:
        self._cancel = None
        self.tell(messages.Failed(why))
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
        outdated = threading.Event()
        try:
            scores = await asyncio.to_thread(self._work_scores, text, shape, outdated)
        except asyncio.CancelledError:
            outdated.set()
            raise
        except NoSurfaceError:
            return
        except PartwrightError as error:
            self.tell(messages.Failed(f"no scores: {error}"))
            return
        if scores is not None and revision == self.journal.revision:
            told = messages.Scored(
                revision,
                scores.iou,
                scores.chamfer,
                scores.max_deviation,
                scores.deviation_95,
                scores.overlap,
            )
            self.tell(told)

    def _work_scores(self, text: str, shape: Shape, outdated: threading.Event) -> Scores | None:
        """None of an assembly that was edited, or a server that was stopped, while others were scored."""
        with self._busy:  # one at a time
            if outdated.is_set():
                return None
            if self._scored is None or self._scored[0] != text or self._scored[1] is not shape:
                self._scored = text, shape, evaluate(from_text(text), shape, emd=False)
            return self._scored[2]

    def _on_loop(self, function: Callable[..., None], *arguments: Any) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, *arguments)

    def stop(self) -> None:
        if self._cancel is not None:
            self._cancel.request()
        if self._scoring is not None:
            self._scoring.cancel()
