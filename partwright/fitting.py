"""`fit`: a shape in, a result out. Picks the method, cleans or bounds what it made, and scores it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.assembly import Assembly
from partwright.assembly.checks import MAX_NAME
from partwright.atomic_io import finishing
from partwright.errors import SettingError
from partwright.reporting import about_input, check_density_of, masses, warnings
from partwright.results import Result
from partwright.shapes import Shape
from partwright.tolerances import DistanceBounds, bounds_report, bounds_warnings, check_alone, enforce

if TYPE_CHECKING:
    import trimesh

    from partwright.cleaning import Cleaned
    from partwright.metrics import Scores

# method -> the module whose `fit(shape, settings, progress=...)` and `Settings` do it
METHODS = {
    "superfrusta": "partwright.superfrusta",
    "solids": "partwright.superfrusta.solids",
    "capri": "partwright.capri",
}
DEVICES = ("auto", "cpu", "cuda")
CLEANABLE = ("superfrusta", "solids")  # methods whose parts have numbers that relations can bind
# A result stands for the worst of its pieces, in this order.
OUTCOMES = ("interrupted", "budget_reached", "converged", "target_reached")


def fit(
    shape: Shape,
    method: str = "superfrusta",
    *,
    quality: str = "normal",
    max_parts: int | None = None,
    min_iou: float | None = None,
    curve: bool = False,
    start: Assembly | None = None,
    locked: Sequence[str] = (),
    per_node: bool = False,
    symmetry: bool = True,
    subtract: bool | None = None,
    seed: int = 0,
    device: str = "auto",
    threads: int = 0,
    progress: Callable[[Any], None] | None = None,
    source: str | None = None,
    density: float | None = None,
    tolerance: float | str | None = None,
    contain: float | str | bool | None = None,
    inside: float | str | bool | None = None,
    clean: bool = False,
    clean_tolerance: float | None = None,
) -> Result:
    """Fit an assembly to a shape.

    Args:
        quality: "draft", "normal" or "high".
        max_parts: at most so many parts (with per_node: in each node).
        min_iou: stop at the fewest parts that reach it.
        curve: also keep the assembly of every size from the result's down to one part (`Result.curve`).
        start: an assembly to refine and continue. locked: names of its parts that stay as they are.
        per_node: fit each node of a scene by itself; the assembly's children are named after the nodes.
        symmetry: where the shape has a mirror plane or a rotation, parts come as repeats (`Part.instances`).
        subtract: parts may be taken away from others (holes); None: for superfrusta no, for the others yes.
        seed: the same seed gives the same assembly, at any number of threads.
        device: "cpu", "cuda", or "auto": the compiled kernel on the CPU, which needs no other package.
        threads: 0 means one per core.
        progress: called with the method's progress: .stage .round .rounds .parts .iou .fraction.
        source: the file's name, for the report.
        density: in kg/m3; the report then has the mass and its inertia, too.
        tolerance: the largest distance between the surfaces, both ways, kept with the fewest parts that do:
            in the shape's units, or text as "0.5mm" or "1%" of the longest side.
        contain: the shape nowhere sticks out of the assembly by more than this; True is 0.
        inside: the assembly nowhere sticks out of the shape by more than this; True is 0.
        clean: make numbers plain and relations exact after the fit (`partwright.clean`). clean_tolerance: how
            much further from the shape any part may come to lie by that, on average, in the shape's units.

    Raises:
        BoundsError: tolerance, contain or inside contradict each other, or are finer than can be told.
        SettingError: an option has a value that cannot be used.
    """
    check_density_of(density, shape.unit)
    started = time.perf_counter()
    if method not in METHODS:
        raise SettingError(f"unknown method {method!r}; expected one of {', '.join(METHODS)}")
    if device not in DEVICES:
        raise SettingError(
            f"device {device!r} is not available for {method}; use one of {', '.join(DEVICES)}"
        )
    bounds = None
    if any(asked not in (None, False) for asked in (tolerance, contain, inside)):
        check_alone(tolerance, min_iou=min_iou, curve=curve, per_node=per_node)
        if method == "capri":
            raise SettingError("capri keeps no tolerance and no bound; use method superfrusta or solids")
        bounds = DistanceBounds.of(shape, tolerance, contain, inside)
    _check_cleaning(method, shape, clean, clean_tolerance, locked, bounds is not None)
    module = import_module(METHODS[method])
    settings = module.Settings.for_quality(
        quality,
        max_parts=max_parts,
        min_iou=min_iou,
        curve=curve,
        symmetry=symmetry,
        seed=seed,
        threads=threads,
        device=device,
        **({} if subtract is None else {"subtract": subtract}),
    )
    if per_node and (curve or start is not None):
        raise SettingError("per_node fits every node anew; it goes with neither a curve nor a start")
    pieces = shape.split_nodes() if per_node else [shape]
    fitted = _fit_pieces(module, pieces, settings, progress, start, locked)
    assembly = _assembled(shape, pieces, fitted, per_node, source)
    seconds = _seconds(fitted)
    outcome = next(o for o in OUTCOMES if any(one.outcome == o for one in fitted))
    bounded = None
    if bounds is not None:

        def refit(share: float) -> Assembly | None:
            if max_parts is not None and len(assembly) >= max_parts:
                return None
            cheaper = dataclasses.replace(settings, alpha=settings.alpha * share)
            again = _fit_pieces(module, pieces, cheaper, progress, start, locked)
            return _assembled(shape, pieces, again, per_node, source)

        fitted_at = time.perf_counter()
        bounded, outcome = enforce(assembly, shape, bounds, outcome, refit, locked, seed)
        assembly, seconds["bounds"] = bounded.assembly, time.perf_counter() - fitted_at
    cleaned = None
    if clean and outcome != "interrupted":
        cleaned, seconds["clean"] = _cleaned(assembly, shape, clean_tolerance)
        if cleaned is None:
            outcome = "interrupted"
        else:
            assembly = cleaned.assembly
    with finishing():
        scores, surface = _scored(shape, assembly, seed, seconds)
    seconds["all"] = time.perf_counter() - started
    report = {
        "outcome": outcome,
        "version": __version__,
        "method": method,
        "seed": seed,
        "settings": {"quality": quality, "per_node": per_node, **dataclasses.asdict(settings)},
        "input": about_input(shape, source),
        "seconds": {stage: round(spent, 3) for stage, spent in seconds.items()},
        "parts": len(assembly),
        "instances": sum(len(part.copies) for part in assembly.parts),
        "scores": scores.to_dict(),
        "mass_properties": masses(surface, shape, density),
        "warnings": warnings(shape, scores) + (bounds_warnings(bounded, shape) if bounded else []),
    }
    if bounded is not None:
        report["bounds"] = bounds_report(bounded, shape, float(surface.volume))
    if method == "capri":
        report["tree"] = [one.details for one in fitted]
    points = tuple(fitted[0].curve)
    if points:
        report["curve"] = [{"parts": p.parts, "score": p.score, "iou": p.iou} for p in points]
    if cleaned is not None:
        report["clean"] = cleaned.to_dict()
    return Result(shape, assembly, outcome, scores, surface, report, points, cleaned)


def _check_cleaning(
    method: str, shape: Shape, clean: bool, tolerance: float | None, locked: Sequence[str], bounded: bool
) -> None:
    if not clean:
        if tolerance is not None:
            raise SettingError("a clean tolerance was given, but nothing is to be cleaned; add --clean")
        return
    if method not in CLEANABLE:
        raise SettingError(f"what {method} makes cannot be cleaned; {', '.join(CLEANABLE)} can")
    if locked:
        raise SettingError("cleaning may change every part, so no part can be locked; clean or lock")
    if bounded:
        raise SettingError("cleaning moves surfaces, which bounds do not allow; clean, or bound the fit")
    if tolerance is not None:
        from partwright.cleaning import checked_tolerance

        checked_tolerance(tolerance, shape)


def _cleaned(assembly: Assembly, shape: Shape, tolerance: float | None) -> tuple[Cleaned | None, float]:
    """None after Ctrl-C: the fit is then kept as it was. And the seconds it took."""
    from partwright.cleaning import clean

    start = time.perf_counter()
    try:
        return clean(assembly, shape, tolerance), time.perf_counter() - start
    except KeyboardInterrupt:
        return None, time.perf_counter() - start


def _fit_pieces(
    module: Any,
    pieces: list[Shape],
    settings: Any,
    progress: Callable[[Any], None] | None,
    start: Assembly | None,
    locked: Sequence[str],
) -> list[Any]:
    """Each piece by the method; after an interruption the rest are left out."""
    fitted: list[Any] = []
    for i, piece in enumerate(pieces):

        def report(step: Any, i: int = i, name: str = piece.name) -> None:
            assert progress is not None
            stage = step.stage if len(pieces) == 1 else f"{name}: {step.stage}"
            progress(dataclasses.replace(step, stage=stage, fraction=(i + step.fraction) / len(pieces)))

        told = report if progress else None
        fitted.append(module.fit(piece, settings, progress=told, start=start, locked=locked))
        if fitted[-1].outcome == "interrupted":
            break
    return fitted


def _assembled(
    shape: Shape, pieces: list[Shape], fitted: list[Any], per_node: bool, source: str | None
) -> Assembly:
    """One assembly that knows the shape's name, unit and up axis; by nodes, one named child a node."""
    whole: Assembly = fitted[0].assembly
    if per_node:
        named = zip(pieces, fitted, strict=False)  # after an interruption, only the first pieces are fitted
        whole = Assembly(
            tuple(dataclasses.replace(one.assembly, name=_clean(piece.name)) for piece, one in named)
        )
    metadata = {**whole.metadata, "source": source or shape.name}
    return dataclasses.replace(
        whole, name=_clean(shape.name), unit=shape.unit, up=shape.up, metadata=metadata
    )


def _clean(name: str) -> str:
    """A file's or node's name as the name of an assembly."""
    return "".join(c if c.isprintable() else "_" for c in name)[:MAX_NAME]


def _seconds(fitted: list[Any]) -> dict[str, float]:
    """The stages of all pieces, added."""
    seconds: dict[str, float] = {}
    for one in fitted:
        for stage, spent in one.seconds.items():
            seconds[stage] = seconds.get(stage, 0.0) + spent
    return seconds


def _scored(
    shape: Shape, assembly: Assembly, seed: int, seconds: dict[str, float]
) -> tuple[Scores, trimesh.Trimesh]:
    from partwright.meshing import mesh_assembly
    from partwright.metrics import evaluate

    start = time.perf_counter()
    surface = mesh_assembly(assembly)
    meshed = time.perf_counter()
    scores = evaluate(assembly, shape, seed=seed, emd=False, surface=surface)
    seconds |= {"meshing": meshed - start, "scores": time.perf_counter() - meshed}
    return scores, surface
