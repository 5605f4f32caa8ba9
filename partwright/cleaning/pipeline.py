"""`clean`: a fitted assembly with the numbers that a person would type.

Six steps, each change taken only if it costs little: parts become named solids; they turn along the input's
axes and one another; relations between their numbers become equations; the numbers that are left free are
fitted once more; all go to a grid; parts that repeat become one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh

from partwright.assembly import Assembly
from partwright.cleaning.acceptance import AcceptanceTest
from partwright.cleaning.agreement import Agreement, VolumeSamples
from partwright.cleaning.deviation_samples import DeviationSamples, State
from partwright.cleaning.feature_cleaning import cleaned_features, same_numbers
from partwright.cleaning.feature_relations import FeatureNumber, feature_numbers, feature_relations
from partwright.cleaning.grid import Grid
from partwright.cleaning.model import Model, check_cleanable
from partwright.cleaning.orientations import turned
from partwright.cleaning.relations import Relation, relations
from partwright.cleaning.repeated_parts import collapsed, tidy, unchanged
from partwright.cleaning.snapping import snapped
from partwright.cleaning.solid_kinds import plainer
from partwright.errors import SettingError
from partwright.fields import Pipe, Swept
from partwright.meshing import mesh_assembly
from partwright.methods import Cancellation
from partwright.shapes import Shape
from partwright.tolerances.noise import roughness

TOLERANCE = 5e-4  # of the longest side
_POINTS = 8000
_MESHED = 128  # cells along the longest side
_COARSEST = 0.05  # of the longest side
_FINEST = 1e-5


@dataclass(frozen=True)
class Cleaned:
    """What `clean` made."""

    assembly: Assembly
    """The very one that was given where nothing was to be done."""
    relations: tuple[Relation, ...]
    """All that hold in it."""
    tolerance: float
    """How much further from the shape each part could come to lie, on average; own units."""
    before: Agreement
    """Of the given assembly."""
    after: Agreement
    """Of the cleaned one, at the very samples of `before`."""
    changed: bool
    """Whether anything but rounding differs."""
    numbers: tuple[FeatureNumber, ...] = ()
    """Of extrusions, revolutions and what lies among them: nominal beside measured."""

    def to_dict(self) -> dict[str, Any]:
        """For report.json."""
        return {
            "tolerance": self.tolerance,
            "changed": self.changed,
            "before": self.before.to_dict(),
            "after": self.after.to_dict(),
            "relations": [relation.to_dict() for relation in self.relations],
            "numbers": [number.to_dict() for number in self.numbers],
        }


def clean(
    assembly: Assembly,
    shape: Shape | None = None,
    tolerance: float | None = None,
    cancel: Cancellation | None = None,
    told: Callable[[str], None] | None = None,
) -> Cleaned:
    """The assembly with plain numbers: relations between parts made exact, lengths on a grid.

    What a person may have typed already stays, so that a second time changes nothing.

    Args:
        shape: what the assembly stands for, in the same units; the assembly's own surface if not given.
        tolerance: how much further from the shape the surface of any part may come to lie, on average, in
            own units; half a thousandth of the longest side, or the mesh's noise, if not given.
        cancel: asked before each change, from any thread.
        told: of each step as it begins, in a word.

    Raises:
        CancelledError: cancelled on the way; half cleaned, an assembly is neither as fitted nor plain.
        UncleanableError: a part is neither a SuperFrustum nor a named solid, or there are too many.
        SettingError: the tolerance is no positive length, too large, or below the mesh's own noise.
        NoSurfaceError: nothing is left of the assembly.
    """
    told = told or _nobody
    if any(isinstance(part.field, Swept | Pipe) for part in assembly.parts):
        return _with_features(assembly, shape, tolerance, cancel or Cancellation(), told)
    told("sampling")
    model = Model.of(assembly)
    target = assembly if shape is None else shape
    tolerance = checked_tolerance(tolerance, target)
    grid = Grid.of(_longest(target))
    samples = DeviationSamples.of(model, shape)
    given = State.of(samples, model)
    acceptance = AcceptanceTest.of(given, tolerance * samples.scale, cancel or Cancellation())
    told("naming solids")
    plain = plainer(given, acceptance, grid)
    told("turning")
    state, frames = turned(plain, acceptance)
    told("relating")
    state = snapped(state, acceptance, frames, grid)
    tidied = np.array([tidy(value, grid) for value in state.vector.tolist()])
    told("finding repeats")
    made = collapsed(state.model.moved(tidied), frames, grid)
    changed = not unchanged(model, made, grid)
    result = made if changed else assembly
    told("measuring")
    volume = VolumeSamples.of(target)

    def agreement(whole: Assembly) -> Agreement:
        off = samples.mean_deviation(whole.transformed(samples.frame))
        return Agreement(volume.iou(whole), off, len(whole))

    before = agreement(assembly)
    after = agreement(result) if changed else before
    return Cleaned(result, relations(result, frames, grid), tolerance, before, after, changed)


def _with_features(
    assembly: Assembly,
    shape: Shape | None,
    tolerance: float | None,
    cancel: Cancellation,
    told: Callable[[str], None],
) -> Cleaned:
    """`clean` where some parts are extrusions, revolutions or pipes; parts that are SuperFrusta stay."""
    for part in assembly.parts:
        if not isinstance(part.field, Swept | Pipe):
            check_cleanable(part)
    target = assembly if shape is None else shape
    tolerance = checked_tolerance(tolerance, target)
    grid = Grid.of(_longest(target))
    told("relating")
    made = cleaned_features(assembly, tolerance, grid, cancel)
    told("measuring")
    if shape is None:
        surface = mesh_assembly(assembly, _MESHED)
        points = np.asarray(trimesh.sample.sample_surface(surface, _POINTS, seed=0)[0])
    else:
        points = shape.frame.from_unit(shape.unit_surface(_POINTS, 0).points)
    volume = VolumeSamples.of(target)

    def agreement(whole: Assembly) -> Agreement:
        off = float(np.abs(whole.distance(points)).mean())
        return Agreement(volume.iou(whole), off, len(whole))

    before, after = agreement(assembly), agreement(made)
    changed = (
        not same_numbers(assembly, made, grid) and after.mean_deviation <= before.mean_deviation + tolerance
    )
    if not changed:
        made, after = assembly, before
    numbers = feature_numbers(assembly, made, tolerance)
    return Cleaned(made, feature_relations(made, grid), tolerance, before, after, changed, numbers)


def _nobody(_: str) -> None:
    pass


def _longest(of: Assembly | Shape) -> float:
    return float(np.ptp(of.bounds(), axis=0).max())


def checked_tolerance(tolerance: float | None, of: Assembly | Shape) -> float:
    """The tolerance of cleaning against a shape, or an assembly by itself, in own units; the default if None.

    The default is the mesh's own noise where that is more: what a scan measures to a fifth of a millimetre is
    no nearer to 4.46 than to 4.5. Below the noise nothing can be told, but half a thousandth of the longest
    side is always allowed: it is a mean over many samples.

    Raises:
        SettingError: it is no positive length, too large, or too small.
    """
    longest = _longest(of)
    length = f" {of.unit}" if of.unit else ""
    if tolerance is None:
        noise = roughness(of) / of.frame.scale if isinstance(of, Shape) else 0.0
        return max(TOLERANCE * longest, noise)
    if not (math.isfinite(tolerance) and 0 < tolerance <= _COARSEST * longest):
        raise SettingError(
            f"clean tolerance {tolerance:g}: expected a length above 0 and at most "
            f"{_COARSEST * longest:.3g}{length}, a twentieth of the longest side"
        )
    if tolerance < _FINEST * longest:
        raise SettingError(
            f"clean tolerance {tolerance:g}{length} is below what distances are computed to; "
            f"give at least {_FINEST * longest:.3g}{length}"
        )
    if isinstance(of, Shape) and tolerance < TOLERANCE * longest:
        noise = roughness(of) / of.frame.scale
        if tolerance < noise:
            raise SettingError(
                f"clean tolerance {tolerance:g}{length} is below the mesh's own noise, {noise:.3g}{length}; "
                f"give at least {min(noise, TOLERANCE * longest):.3g}{length}"
            )
    return tolerance
