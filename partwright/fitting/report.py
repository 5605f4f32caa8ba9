"""What report.json says: of the fit, its input, its masses, and what a user should be told."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright import __version__
from partwright.assembly import Assembly, Similarity
from partwright.assembly.repeated_groups import parts_once
from partwright.errors import SettingError
from partwright.fitting.structure_warnings import structure_warnings
from partwright.methods import Fitted, Run
from partwright.shapes import METRES, Shape, length_text
from partwright.shapes.distance import MeshDistance
from partwright.tolerances import Bounded, bounds_report, bounds_warnings

if TYPE_CHECKING:
    import trimesh

    from partwright.cleaning import Cleaned
    from partwright.metrics import Scores

POOR_IOU = 0.85
POOR_DEVIATION = 0.03  # of the longest side
UNSURE = 0.5
MUCH_MISSING = 0.02  # of the surface: made up, or left out
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
    points = point_deviations(shape, surface) if any(one.of_points for one in fitted) else None
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
            # What a method says first, as that it knows no such shape: the others advise to try harder.
            *dict.fromkeys(line for one in fitted for line in one.warnings),
            *(points_warnings(shape, points) if points else warnings(shape, scores, _more(how["settings"]))),
            *structure_warnings(shape, assembly, surface),
            *(bounds_warnings(enforced, shape) if enforced else []),
        ],
    }
    for name in dict.fromkeys(name for one in fitted for name in one.details):
        told[name] = [one.details[name] for one in fitted]
    if points is not None:
        told["points"] = asdict(points)
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
        "left_out": shape.left_out,
        "sealed": shape.sealed,
        "thickness": shape.thickness,
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


@dataclass(frozen=True)
class PointDeviations:
    """How far `count` given points lie from the fitted surface: mean, 95 % and largest, in own units and, as
    `_share`, of the longest side."""

    count: int
    mean: float
    deviation_95: float
    max_deviation: float
    mean_share: float
    deviation_95_share: float
    max_deviation_share: float


def point_deviations(shape: Shape, surface: trimesh.Trimesh) -> PointDeviations:
    """Of a shape that came as points, by a method that comes close to these themselves.

    What its scores are against, a surface laid through the points, closes what a scan has not seen and chews
    what it has seen with noise.
    """
    assert shape.points is not None
    faces = np.asarray(surface.faces, dtype=np.int64)
    surface_distance = MeshDistance(np.asarray(surface.vertices), faces, faces, closed=False)
    off = surface_distance.exact(shape.points)
    numbers = (float(off.mean()), float(np.quantile(off, 0.95)), float(off.max()))
    return PointDeviations(len(off), *numbers, *(number / _side(shape) for number in numbers))


def points_warnings(shape: Shape, points: PointDeviations) -> list[str]:
    """One line where the surface passes many of the points by; single ones may be strays."""
    if points.deviation_95_share <= POOR_DEVIATION:
        return []
    off = length_text(points.deviation_95, shape.unit)
    return [
        f"the surface passes the points by: a twentieth of them lie {off} or more "
        f"from it, {points.deviation_95_share:.0%} of the longest side; look at preview.png"
    ]


def _side(shape: Shape) -> float:
    return float(np.ptp(shape.bounds(), axis=0).max())


def _more(settings: Mapping[str, Any]) -> str:
    """What may bring a method with these settings closer."""
    return "try --quality high or more parts" if "max_parts" in settings else "try --quality high"


def warnings(shape: Shape, scores: Scores, more: str) -> list[str]:
    """Of the fitted surface against the shape's. more: what to try where it is poor."""
    result = []
    if scores.iou < POOR_IOU or scores.max_deviation > POOR_DEVIATION * _side(shape):
        off = length_text(scores.max_deviation, shape.unit)
        out = scores.max_protrusion >= scores.max_deviation
        how = "where it sticks out of the shape" if out else "where it does not reach the shape"
        result.append(
            f"the fit is poor in places: IoU {scores.iou:.3f}; it is furthest off, by "
            f"{off}, at the {scores.worst_place}, {how}; {more}"
        )
    if shape.openings.share > MUCH_MISSING:
        result.append(_about_openings(shape))
    if shape.left_out > MUCH_MISSING:
        result.append(
            f"sheets with {shape.left_out:.0%} of the surface enclose nothing and were left out; "
            "--thickness 1% makes walls of them"
        )
    if shape.sealed:
        result.append(
            "the surface is open in many places, and the solid that is seen in it was taken for what is "
            "meant; where sheets were meant, --thickness 1% makes walls of them"
        )
    if shape.confidence < UNSURE:
        repairs = "; ".join(shape.repairs)
        result.append(
            f"it is unsure what lies inside this surface (confidence {shape.confidence:.2f}): {repairs}"
            + (
                ". Where sheets were meant, --thickness 1% makes walls of them"
                if shape.thickness is None
                else ""
            )
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
