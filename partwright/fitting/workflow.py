"""`fit` and `fit_nodes`: by a method, then held to distances or cleaned, then scored."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from partwright.assembly import Assembly
from partwright.assembly.checks import MAX_NAME
from partwright.at_once import limited
from partwright.blas import one_blas_thread
from partwright.errors import CancelledError, SettingError
from partwright.fitting.ahead import Ahead
from partwright.fitting.former import former
from partwright.fitting.options import Clean, Start, Tolerance, check_able, suitable
from partwright.fitting.report import report
from partwright.fitting.result import Result
from partwright.methods import (
    METHODS,
    Ability,
    Cancellation,
    FitRequest,
    Fitted,
    Method,
    Outcome,
    Progress,
    Run,
    SettingsOfMethod,
    changed,
    interruptible,
    timed,
)
from partwright.shapes import Shape
from partwright.tolerances import Bounded, DistanceBounds, check_alone, enforce

if TYPE_CHECKING:
    import trimesh

    from partwright.cleaning import Cleaned
    from partwright.metrics import Scores

# A result stands for the worst of its pieces, in this order.
_WORST_FIRST: tuple[Outcome, ...] = ("interrupted", "budget_reached", "converged", "target_reached")


def fit(
    shape: Shape,
    method: str | SettingsOfMethod = "superfrusta",
    *,
    quality: str | None = None,
    seed: int = 0,
    device: str = "auto",
    threads: int = 0,
    start: Assembly | Start | None = None,
    tolerance: float | str | Tolerance | None = None,
    clean: bool | Clean = False,
    progress: Callable[[Progress], None] | None = None,
    cancel: Cancellation | None = None,
    saving: bool = False,
    **settings: Any,
) -> Result:
    """Fit an assembly to a shape.

    Args:
        method: a name ("superfrusta", "solids", "capri", "parts", or what an installed package adds), or a
            method's own settings: `pw.Capri(nested=False)`, `pw.LearnedParts("cars")`.
        quality: "draft", "normal" (if not given) or "high"; only beside a method's name.
        seed: the same seed gives the same assembly, at any number of threads.
        device: "cpu", "cuda", or "auto": the compiled kernel on the CPU, which needs no other package.
        threads: 0 means one a core.
        start: an assembly to refine and continue; `Start` also locks some of its parts.
        tolerance: the largest distance between the surfaces, kept with the fewest parts that do: in the
            shape's units, or text as "0.5mm" or "1%" of the longest side. `Tolerance` also contains the shape
            or stays inside it.
        clean: make numbers plain and relations exact after the fit.
        progress: told at each step; its `assembly()` is the best so far.
        cancel: ends the fit with its best so far, from any thread. If not given, Ctrl-C does.
        saving: the result will be saved: begin with what takes longest of that while scores are taken, unless
            `threads` is 1.
        settings: of the method: max_parts (at most so many), min_iou (the fewest parts that reach it), curve
            (an assembly of every size, `Result.curve`), symmetry, subtract, and all that its settings have.

    Raises:
        SettingError: an option has a value that cannot be used, or the method cannot do what it asks for.
        BoundsError: a tolerance contradicts itself, or is finer than can be told.
        CancelledError: cancelled before there was anything to keep.
        EmptyShapeError: nothing could be fitted.

    See Also:
        fit_nodes: each node of a scene by itself.

    Example:
        result = pw.fit(pw.load_shape("mug.glb"), max_parts=12, start=pw.Start(assembly, locked=["handle"]))
    """
    given, settings = former(settings, start=start, tolerance=tolerance, clean=clean)
    if given.pop("per_node", False):
        if start is not None:
            raise SettingError("per_node fits every node anew, so it takes no start")
        return fit_nodes(
            shape, method, quality=quality, seed=seed, device=device, threads=threads,
            tolerance=given["tolerance"], clean=given["clean"], progress=progress, cancel=cancel, **settings,
        )  # fmt: skip
    run = Run(seed, device, threads, progress, cancel or Cancellation())
    task = _Task.of(shape, method, quality, run, settings, **given)
    return task.result(listen=cancel is None, saving=saving)


def fit_nodes(
    shape: Shape,
    method: str | SettingsOfMethod = "superfrusta",
    *,
    quality: str | None = None,
    seed: int = 0,
    device: str = "auto",
    threads: int = 0,
    tolerance: Tolerance | None = None,
    clean: bool | Clean = False,
    progress: Callable[[Progress], None] | None = None,
    cancel: Cancellation | None = None,
    saving: bool = False,
    **settings: Any,
) -> Result:
    """Fit each node of a scene by itself: the assembly's children are named after the nodes.

    Arguments and errors as of `fit`; max_parts holds for each node. It takes no start, no curve, and of a
    tolerance only the sides (`contain`, `inside`): the number of parts of one node cannot be told from
    another's.
    """
    run = Run(seed, device, threads, progress, cancel or Cancellation())
    task = _Task.of(
        shape, method, quality, run, settings, tolerance=tolerance, clean=clean, pieces=shape.split_nodes()
    )
    return task.result(listen=cancel is None, saving=saving)


@dataclass(frozen=True)
class _Task:
    """A fit with all its options checked: what is left is work."""

    shape: Shape
    pieces: Sequence[Shape] | None
    """The nodes to fit by themselves; None for the shape as a whole."""
    method: Method[Any]
    settings: Any
    quality: str | None
    run: Run
    start: Start | None
    bounds: DistanceBounds | None
    clean: Clean | None

    @classmethod
    def of(
        cls,
        shape: Shape,
        method: str | SettingsOfMethod,
        quality: str | None,
        run: Run,
        settings: dict[str, Any],
        *,
        start: Assembly | Start | None = None,
        tolerance: float | str | Tolerance | None = None,
        clean: bool | Clean = False,
        pieces: Sequence[Shape] | None = None,
    ) -> _Task:
        """Raises SettingError, or BoundsError, for what cannot be done, before any work."""
        found: Method[Any] = METHODS[method if isinstance(method, str) else method.method]
        quality = quality or ("normal" if isinstance(method, str) else None)
        begin, limits, cleaning = Start.of(start), Tolerance.of(tolerance), Clean.of(clean)
        asked = {
            Ability.START: begin is not None,
            Ability.LOCK: begin is not None and begin.locked,
            Ability.BOUNDS: limits is not None,
            Ability.CLEAN: cleaning is not None,
            Ability.PER_NODE: pieces is not None,
            Ability.CUDA: run.device == "cuda",
        }
        check_able(found, *(ability for ability, wanted in asked.items() if wanted))
        own = _settings(found, method, quality, suitable(found, settings))
        target, curve = getattr(own, "min_iou", None), bool(getattr(own, "curve", False))
        if pieces is not None and curve:
            raise SettingError("a curve is of one assembly; fit the shape as a whole, or leave it out")
        bounds = None
        if limits is not None:
            check_alone(limits.within, min_iou=target, curve=curve, per_node=pieces is not None)
            bounds = DistanceBounds.of(shape, limits.within, limits.contain, limits.inside)
        _check_cleaning(cleaning, shape, begin, bounds)
        if begin is not None:
            begin.check_size(shape)
        return cls(shape, pieces, found, own, quality, run, begin, bounds, cleaning)

    def result(self, listen: bool, saving: bool) -> Result:
        """The work. listen: Ctrl-C cancels it. saving: it will be saved."""
        listening = interruptible(self.run.cancel) if listen else nullcontext()
        with listening, one_blas_thread(), limited(self.run.threads):
            return self.done(saving and Ahead.pays(self.run.threads))

    def done(self, saving: bool) -> Result:
        started = time.perf_counter()
        fitted = self.fitted(self.settings)
        assembly, seconds = self.assembled(fitted), {"reading": self.shape.reading_seconds} | _seconds(fitted)
        outcome: str = next(o for o in _WORST_FIRST if any(one.outcome == o for one in fitted))
        enforced: Bounded | None = None
        if self.bounds is not None:
            with timed(seconds, "bounds"):
                enforced, outcome = self.enforced(assembly, outcome)
            assembly = enforced.assembly
        cleaned: Cleaned | None = None
        if self.clean is not None and outcome != "interrupted":
            with timed(seconds, "clean"):
                cleaned, outcome = self.cleaned(assembly, outcome)
            assembly = cleaned.assembly if cleaned else assembly
        made = fitted[0].surface if len(fitted) == 1 and not (enforced or cleaned) else None
        ahead = Ahead(self.shape, assembly) if saving else None
        try:
            scores, surface = _scored(self.shape, assembly, self.run.seed, seconds, made, ahead)
        except BaseException:
            if ahead is not None:
                ahead.give_up()
            raise
        seconds["all"] = self.shape.reading_seconds + time.perf_counter() - started
        told = report(
            self.shape, assembly, surface, scores, how=self.how(outcome), run=self.run, seconds=seconds,
            fitted=fitted, enforced=enforced, cleaned=cleaned,
        )  # fmt: skip
        return Result(self.shape, assembly, outcome, scores, surface, told, fitted[0].curve, cleaned, ahead)

    def how(self, outcome: str) -> dict[str, Any]:
        """What the report says of the fit itself."""
        settings = {"quality": self.quality, "per_node": self.pieces is not None, **asdict(self.settings)}
        return {"outcome": outcome, "method": self.method.name, "settings": settings}

    def fitted(self, settings: Any) -> list[Fitted]:
        """Each piece by the method; after an interruption the rest are left out."""
        pieces = [self.shape] if self.pieces is None else self.pieces
        result: list[Fitted] = []
        for i, piece in enumerate(pieces):

            def report(step: Progress, i: int = i, name: str = piece.name) -> None:
                stage = step.stage if self.pieces is None else f"{name}: {step.stage}"
                self.run.told(replace(step, stage=stage, fraction=(i + step.fraction) / len(pieces)))

            start, locked = (self.start.assembly, self.start.locked) if self.start else (None, ())
            run = replace(self.run, progress=report if self.run.progress else None)
            result.append(self.method.fit(FitRequest(piece, settings, run, start, locked)))
            if result[-1].outcome == "interrupted":
                break
        return result

    def assembled(self, fitted: list[Fitted]) -> Assembly:
        """One assembly that knows the shape's name, unit and up axis; by nodes, one named child a node."""
        whole = fitted[0].assembly
        if self.pieces is not None:
            # After an interruption, only the first pieces are fitted.
            named = zip(self.pieces, fitted, strict=False)
            whole = Assembly(
                tuple(replace(one.assembly, name=_printable(piece.name)) for piece, one in named)
            )
        metadata = {**whole.metadata, "source": self.shape.file or self.shape.name}
        return replace(
            whole, name=_printable(self.shape.name), unit=self.shape.unit, up=self.shape.up, metadata=metadata
        )

    def enforced(self, assembly: Assembly, outcome: str) -> tuple[Bounded, str]:
        """Held to the bounds, with more parts where it takes more."""
        most = getattr(self.settings, "max_parts", None)

        def refit(share: float) -> Assembly | None:
            if most is not None and len(assembly) >= most:
                return None
            return self.assembled(self.fitted(self.method.denser(self.settings, share)))

        assert self.bounds is not None
        locked = self.start.locked if self.start else ()
        run = self.run
        return enforce(assembly, self.shape, self.bounds, outcome, refit, locked, run.seed, run.cancel)

    def cleaned(self, assembly: Assembly, outcome: str) -> tuple[Cleaned | None, str]:
        """None, and interrupted, where it was cancelled: the fit is then kept as it was."""
        from partwright.cleaning import clean

        assert self.clean is not None
        try:
            return clean(assembly, self.shape, self.clean.tolerance, self.run.cancel), outcome
        except CancelledError:
            return None, "interrupted"


def _settings(method: Method[Any], given: str | SettingsOfMethod, quality: str | None, changes: Any) -> Any:
    if isinstance(given, str):
        return method.settings(quality or "normal", **changes)
    if quality is not None:
        raise SettingError(f"quality stands for settings of its own; give {method.name}'s settings alone")
    return changed(given, changes)


def _check_cleaning(
    clean: Clean | None, shape: Shape, start: Start | None, bounds: DistanceBounds | None
) -> None:
    if clean is None:
        return
    if start is not None and start.locked:
        raise SettingError("cleaning may change every part, so no part can be locked; clean or lock")
    if bounds is not None:
        raise SettingError("cleaning moves surfaces, which bounds do not allow; clean, or bound the fit")
    if clean.tolerance is not None:
        from partwright.cleaning import checked_tolerance

        checked_tolerance(clean.tolerance, shape)


def _printable(name: str) -> str:
    """A file's or node's name as the name of an assembly."""
    return "".join(c if c.isprintable() else "_" for c in name)[:MAX_NAME]


def _seconds(fitted: Sequence[Fitted]) -> dict[str, float]:
    """The stages of all pieces, added."""
    seconds: dict[str, float] = {}
    for one in fitted:
        for stage, spent in one.seconds.items():
            seconds[stage] = seconds.get(stage, 0.0) + spent
    return seconds


def _scored(
    shape: Shape,
    assembly: Assembly,
    seed: int,
    seconds: dict[str, float],
    made: trimesh.Trimesh | None,
    ahead: Ahead | None,
) -> tuple[Scores, trimesh.Trimesh]:
    from partwright.meshing import lean_assembly, mesh_assembly
    from partwright.metrics import evaluate

    with timed(seconds, "meshing"):
        whole = mesh_assembly(assembly) if made is None else made
        surface = lean_assembly(assembly, mesh=whole)
    if ahead is not None:
        ahead.draw(surface)
    with timed(seconds, "scores"):
        scores = evaluate(assembly, shape, seed=seed, emd=False, surface=whole)
    return scores, surface
