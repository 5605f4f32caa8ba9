"""Holes of what was added, to be cut once more: what came later may reach into them, as one pipe does that
ends in another."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from manifold3d import Manifold

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.holes import hole_parts
from partwright.approximation.sketches.sections import FINE
from partwright.assembly import Part
from partwright.fields import Cylinder, Extrusion, Revolution, Tube
from partwright.meshing.csg import solid_of
from partwright.superfrusta.feature_steps import Step

_CHORD = 1e-3  # unit lengths: how far chords of a hole may be off


def bores(steps: Sequence[Step], of: Callable[[Candidate], list[Candidate]]) -> list[Candidate]:
    """One for each hole of parts that were added, where another was added later. of: `bores_of`."""
    last = max((k for k, step in enumerate(steps) if step.added), default=0)
    return [bore for step in steps[:last] if step.added for bore in of(step.chosen)]


def bores_of(chosen: Candidate) -> list[Candidate]:
    """One for each hole of a candidate."""
    return [_bore(hole) for hole in _holes(chosen.part)]


def _bore(hole: Part) -> Candidate:
    return Candidate(hole, partial(_solid, hole), _sides(hole), float(solid_of(hole, _CHORD).volume()))


def _holes(part: Part) -> Iterator[Part]:
    field = part.field
    if isinstance(field, Tube):
        yield dataclasses.replace(part, field=Cylinder(field.radius - field.thickness, field.height))
    elif isinstance(field, Revolution) and field.full:
        (inner, low), (_, high) = field.profile.bounds()
        if inner > 0:
            shifted = Part(Cylinder(float(inner), float(high - low)), (0.0, 0.0, float(low + high) / 2))
            yield shifted.transformed(part.pose)
    elif isinstance(field, Extrusion):
        for hole in hole_parts(part):
            yield from (dataclasses.replace(copy, instances=()) for copy in hole.copies)


def _sides(hole: Part) -> int:
    return len(hole.field.profile.corners) if isinstance(hole.field, Extrusion) else 2


def _solid(hole: Part, further: float) -> Manifold:
    """A round one a little wider or narrower than the chords of what is around it."""
    by = math.copysign(FINE, further) if further else 0.0
    if isinstance(hole.field, Cylinder) and by:
        hole = dataclasses.replace(hole, field=Cylinder(hole.field.radius + by, hole.field.height))
    return solid_of(hole, _CHORD)
