"""What report.json says: of the fit, its input, its masses, and what a user should be told."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.assembly import Assembly, Similarity
from partwright.assembly.repeated_groups import parts_once
from partwright.errors import SettingError
from partwright.fitting.structure_warnings import structure_warnings
from partwright.methods import Fitted, Run
from partwright.shapes import METRES, Shape
from partwright.tolerances import Bounded, bounds_report, bounds_warnings

if TYPE_CHECKING:
    import trimesh

    from partwright.cleaning import Cleaned
    from partwright.metrics import Scores

POOR_IOU = 0.85
POOR_DEVIATION = 0.03  # of the longest side
UNSURE = 0.5
MUCH_MISSING = 0.02  # of the surface
SAME_VOLUME = 0.01  # of the input's triangles and of its inside: then no surface runs through it twice


def report(
    shape: Shape,
    assembly: Assembly,
    surface: trimesh.Trimesh,
    scores: Scores,
    *,
    how: Mapping[str, Any],
    run: Run,
    seconds: Mapping[str, float],
    fitted: Sequence[Fitted],
    enforced: Bounded | None,
    cleaned: Cleaned | None,
) -> dict[str, Any]:
    """What report.json holds (docs/report.md). how: outcome, method and settings, as they are to stand."""
    told = {
        **how,
        "version": __version__,
        "seed": run.seed,
        "device": run.device,
        "threads": run.threads,
        "input": about_input(shape),
        "seconds": {stage: round(spent, 3) for stage, spent in seconds.items()},
        "parts": len(parts_once(assembly)),
        "instances": sum(len(part.copies) for part in assembly.parts),
        "scores": scores.to_dict(),
        "mass_properties": masses(surface, shape, None),
        "warnings": [
            *warnings(shape, scores),
            *structure_warnings(shape, assembly, surface),
            *(bounds_warnings(enforced, shape) if enforced else []),
            *dict.fromkeys(line for one in fitted for line in one.warnings),
        ],
    }
    for name in dict.fromkeys(name for one in fitted for name in one.details):
        told[name] = [one.details[name] for one in fitted]
    if enforced is not None:
        told["bounds"] = bounds_report(enforced, shape, float(surface.volume))
    if fitted[0].curve:
        told["curve"] = [{"parts": p.parts, "score": p.score, "iou": p.iou} for p in fitted[0].curve]
    if cleaned is not None:
        told["clean"] = cleaned.to_dict()
    return told


def about_input(shape: Shape) -> dict[str, Any]:
    return {
        "file": shape.file or shape.name,
        "unit": shape.unit,
        "up": shape.up,
        "triangles": len(shape.input_faces),
        "repairs": list(shape.repairs),
        "openings": asdict(shape.openings),
        "confidence": shape.confidence,
    }


def check_density_of(density: float | None, unit: str | None) -> None:
    from partwright.meshing.mass import check_density

    if density is None:
        return
    check_density(density)
    if unit is None:
        raise SettingError(
            "density: the shape's length unit is unknown, so it has no mass; state it by --unit"
        )


def masses(surface: trimesh.Trimesh, shape: Shape, density: float | None) -> dict[str, Any]:
    """Mass properties of the fitted surface and, where it encloses one volume, of the input's own.

    In metres and kilograms where a density is given, else in the shape's unit and per density.
    """
    import trimesh

    from partwright.meshing.mass import mass_properties

    given = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    simple = math.isclose(given.volume, shape.volume, rel_tol=SAME_VOLUME)
    to_metres = Similarity(METRES[shape.unit]) if density is not None and shape.unit else Similarity()
    unit = shape.unit if density is None else "m"
    fitted, *asked = (
        mass_properties(mesh).transformed(to_metres).to_dict(unit, density)
        for mesh in ([surface, given] if simple else [surface])
    )
    return fitted | ({"input": asked[0]} if asked else {})


def warnings(shape: Shape, scores: Scores) -> list[str]:
    result = []
    side = float((shape.vertices.max(axis=0) - shape.vertices.min(axis=0)).max())
    if scores.iou < POOR_IOU or scores.max_deviation > POOR_DEVIATION * side:
        unit = f" {shape.unit}" if shape.unit else ""
        out = scores.max_protrusion >= scores.max_deviation
        how = "where it sticks out of the shape" if out else "where it does not reach the shape"
        result.append(
            f"the fit is poor in places: IoU {scores.iou:.3f}; it is furthest off, by "
            f"{scores.max_deviation:.3g}{unit}, at the {scores.worst_place}, {how}; "
            "try --quality high or more parts"
        )
    if shape.openings.share > MUCH_MISSING:
        result.append(_about_openings(shape))
    if shape.confidence < UNSURE:
        repairs = "; ".join(shape.repairs)
        result.append(
            f"it is unsure what lies inside this surface (confidence {shape.confidence:.2f}): {repairs}"
        )
    return result


def _about_openings(shape: Shape) -> str:
    """How much of the surface is made up, and where: scores are against the repaired shape, so hide it."""
    from partwright.metrics.deviation import place_in

    openings = shape.openings
    assert openings.largest is not None  # what has a share has a place
    place = f"at the {place_in(shape, shape.frame.to_unit(openings.largest))}"
    if openings.count > 1:
        place = f"in {openings.count} places, the largest {place}"
    return (
        f"about {openings.share:.0%} of the surface was missing, {place}, and is made up; the scores are "
        "against the repaired shape. Mend the input where that matters"
    )
