"""Extrusions and revolutions whose numbers were shaken come back as they were typed."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.cleaning import clean
from partwright.cleaning.hole_standards import is_drawn_in_inches, standard_hole
from partwright.cleaning.outline_equations import Solver, centred, coordinate, round_of
from partwright.cli.main import main
from partwright.errors import CancelledError
from partwright.fields import Cylinder, Extrusion, Pipe, Revolution, Swept
from partwright.fields.profile import Profile, circle
from partwright.meshing import mesh_csg
from partwright.methods import Cancellation
from partwright.shapes import load_shape

TOLERANCE = 0.1  # of a part of 100 mm: rounding may then move a number by a third of it
DOWN = (0.5, 0.5, 0.5, 0.5)


def bracket() -> Assembly:
    """A rounded plate with an opening, a web across it, a turned boss, and holes for M6."""
    plate = Profile(Profile.rectangle(100, 60, corner=8).outline, (circle(12, (-20, 0)),))
    web = Profile([(0, 0), (40, 0), (40, 10), (15, 30), (0, 30)])
    boss = Profile([(0, 0), (14, 0), (14, 18), (9, 24), (0, 24)])
    body = Assembly(
        (
            Part(Extrusion(plate, 10), (0, 0, 5), name="plate"),
            Part(Extrusion(web, 6), (0, 0, 10), DOWN, name="web"),
            Part(Revolution(boss), (30, 10, 10), name="boss"),
        )
    )
    holes = [Part(Cylinder(3.3, 12), (x, -22, 5), name=f"hole_{x}") for x in (-40, 40)]
    return Assembly((body, *holes), "difference", unit="mm")


def shaken(assembly: Assembly, by: float = 0.02) -> Assembly:
    """Every corner, radius, height and place up to so much off."""
    rng = np.random.default_rng(3)
    for part in assembly.parts:
        field = part.field
        if isinstance(field, Extrusion | Revolution):
            loops = [
                tuple((x + rng.uniform(-by, by) * (x != 0), y + rng.uniform(-by, by), b) for x, y, b in loop)
                if len(loop) > 2
                else circle(12 + rng.uniform(-by, by), tuple(np.add((-20, 0), rng.uniform(-by, by, 2))))
                for loop in field.profile.loops
            ]
            changes: dict[str, float] = {}
            if isinstance(field, Extrusion):
                changes["height"] = field.height + rng.uniform(-by, by)
            field = dataclasses.replace(field, profile=Profile.of_loops(loops), **changes)  # type: ignore[arg-type]
        elif isinstance(field, Cylinder):
            field = Cylinder(field.radius + rng.uniform(-by, by), field.height + rng.uniform(-by, by))
        place = np.array(part.translation) + rng.uniform(-by, by, 3) / 2
        changed = dataclasses.replace(part, field=field, translation=tuple(place.tolist()))
        assembly = assembly.replace_part(part.name, changed)
    return assembly


def test_a_shaken_bracket_is_as_it_was() -> None:
    wanted = bracket()
    cleaned = clean(shaken(wanted), tolerance=TOLERANCE)
    assert cleaned.changed
    points = np.random.default_rng(0).uniform(-50, 50, (20_000, 3)).astype(np.float32)
    assert cleaned.assembly.distance(points) == pytest.approx(wanted.distance(points), abs=1e-4)
    told = {(relation.kind, relation.text) for relation in cleaned.relations}
    assert ("aligned", "along the input's axes") in told
    assert ("flush", "flush at z = 10 mm") in told
    assert ("equal", "equal radius 3.3 mm") in told
    assert ("tangent", "sides run smoothly into one another at 8 corners") in told
    hole = next(one for one in cleaned.numbers if one.part == "hole_40" and one.name == "diameter")
    assert (hole.nominal, hole.standard) == (6.6, "M6 clearance, ISO 273 medium")
    assert 0 < abs(hole.deviation) < 0.04


def test_a_shaken_pipe_is_as_it_was_and_its_corner_where_a_plate_has_its_face() -> None:
    wanted = (((0.0, 0.0, 0.0), (40.0, 0.0, 0.0, 12.0), (40.0, 30.0, 0.0)), 5.0, 1.5)
    path = ((0.011, -0.013, 0.012), (40.012, 0.007, -0.014, 12.013), (39.991, 30.008, 0.009))
    plate = Part(Cylinder(12.0, 4.0), (40.0, 30.0, 0.0), name="plate")
    cleaned = clean(
        Assembly((Part(Pipe(path, 5.012, 1.509), name="pipe"), plate), unit="mm"), tolerance=TOLERANCE
    )
    assert cleaned.assembly["pipe"].field == Pipe(*wanted)
    told = {(one.name, one.nominal) for one in cleaned.numbers if one.part == "pipe"}
    assert {("diameter", 10.0), ("thickness", 1.5), ("bend", 12.0)} <= told
    again = clean(cleaned.assembly, tolerance=TOLERANCE)
    assert not again.changed


def test_a_second_time_changes_nothing() -> None:
    once = clean(shaken(bracket()), tolerance=TOLERANCE)
    twice = clean(once.assembly, tolerance=TOLERANCE)
    assert not twice.changed
    assert twice.assembly is once.assembly


def test_the_shape_is_the_yardstick(tmp_path: Path) -> None:
    mesh_csg(bracket()).export(tmp_path / "bracket.ply")
    cleaned = clean(shaken(bracket()), load_shape(tmp_path / "bracket.ply"), TOLERANCE)
    assert cleaned.after.mean_deviation < cleaned.before.mean_deviation / 2
    assert cleaned.after.iou > cleaned.before.iou


def test_what_goes_too_far_stays() -> None:
    """A corner that no plain number is near keeps its place to the finest grid."""
    odd = Profile([(0, 0), (37.3437, 1.7171), (30.1357, 22.2223), (3.1313, 20.7171)])
    cleaned = clean(Assembly((Part(Extrusion(odd, 5), name="wedge"),)), tolerance=1e-3)
    (wedge,) = cleaned.assembly.parts
    assert isinstance(wedge.field, Swept)
    world = wedge.field.profile.corners[:, :2] + wedge.translation[:2]
    assert world == pytest.approx(odd.corners[:, :2], abs=2e-3)


def test_equations_move_an_arc_as_little_as_they_must() -> None:
    slot = Profile([(0.01, 0, 0), (10, 0.02, 1.001), (10.01, 4, 0), (0, 4.01, 0.999)])
    solver = Solver(slot, 0.05)
    straight = [coordinate(0, 1, 0.0), coordinate(1, 1, 0.0), coordinate(2, 1, 4.0), coordinate(3, 1, 4.0)]
    assert len(solver.take(straight)) == 4
    assert len(solver.take([round_of(1, 2, 2.0), centred(1, 2, 0, 10.0)])) == 2
    side = solver.profile.sides[0][1]
    assert (side.radius, *(side.centre or ())) == pytest.approx((2, 10, 2), abs=1e-9)
    assert solver.take([round_of(3, 0, 2.5)]) == []  # further than it may go
    assert solver.profile.sides[0][3].radius == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize(
    ("diameter", "tolerance", "unit", "name"),
    [
        (6.62, 0.05, "mm", "M6 clearance, ISO 273 medium"),
        (0.662, 0.005, "cm", "M6 clearance, ISO 273 medium"),
        (0.2, 0.005, "in", "1/4-20 UNC tapping"),
        (6.3, 0.05, "mm", None),
        (6.6, 0.05, None, None),
    ],
)
def test_holes_are_called_after_their_screws(
    diameter: float, tolerance: float, unit: str | None, name: str | None
) -> None:
    found = standard_hole(diameter, tolerance, unit)
    assert (found[0] if found else None) == name
    assert found is None or math.isclose(found[1], diameter, abs_tol=tolerance)


def inch_plate(inch: float) -> Assembly:
    """8 x 12 x 1/2 with four holes for screws of a quarter of an inch, an inch being so long."""
    outline = Profile.rectangle(8 * inch, 12 * inch, corner=inch)
    plate = Part(Extrusion(outline, inch / 2), name="plate")
    moves = [Similarity(translation=(x * inch, y * inch, 0.0)) for x, y in ((6.5, 0), (0, 9), (6.5, 9))]
    hole = Part(Cylinder(0.133 * inch, inch), (-3.25 * inch, -4.5 * inch, 0), name="hole", instances=moves)
    slot = Part(Extrusion(Profile.rectangle(1.75 * inch, 0.625 * inch), inch), name="slot")
    return Assembly((plate, hole, slot), operation="difference", unit="mm")


def test_holes_of_parts_that_were_drawn_in_inches_are_for_unified_screws() -> None:
    """Whatever unit they are stored in; 6.76 mm would be for a tap of M8. Of the same in metric numbers they
    are ISO's."""
    imperial = inch_plate(25.4)
    assert is_drawn_in_inches(imperial)
    assert is_drawn_in_inches(dataclasses.replace(imperial.scaled(0.1), unit="cm"))
    metric = inch_plate(25.5)
    assert not is_drawn_in_inches(metric)
    assert not is_drawn_in_inches(dataclasses.replace(imperial, unit=None))
    for plate, name in ((imperial, "1/4 clearance, ASME B18.2.8 close"), (metric, "M8 tapping, ISO 2306")):
        made = clean(plate, tolerance=0.05)
        (number,) = [one for one in made.numbers if one.part == "hole" and one.name == "diameter"]
        assert number.standard == name
    assert clean(imperial, tolerance=0.05).assembly["hole"].field.radius == pytest.approx(25.4 * 0.133)


def test_a_cancelled_cleaning_says_so() -> None:
    cancel = Cancellation()
    cancel.request()
    with pytest.raises(CancelledError, match="stays as it was"):
        clean(shaken(bracket()), tolerance=TOLERANCE, cancel=cancel)


def test_the_command_tells_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shaken(bracket()).save(tmp_path / "a.json")
    command = ["clean", str(tmp_path / "a.json"), "--clean-tolerance", "0.1", "-o", str(tmp_path / "b.json")]
    assert main(command) == 0
    assert "M6 clearance, ISO 273 medium" in capsys.readouterr().out
    report = json.loads((tmp_path / "b.json.report.json").read_text())
    assert {"part", "name", "nominal", "measured", "deviation", "standard"} == set(report["numbers"][0])
    assert load_assembly(tmp_path / "b.json").parts[-1].field == Cylinder(3.3, 12)


def test_the_wall_of_a_thin_tube_moves_by_little_of_it() -> None:
    """Half a millimetre: rounded as coarsely as the tube is wide, it would be a fifth thinner."""
    tube = Pipe(((0, 0, 0), (40, 0, 0, 12), (40, 30, 0)), 5.0, 0.5437)
    cleaned = clean(Assembly((Part(tube, name="tube"),), unit="mm"), tolerance=0.5)
    (made,) = (part.field for part in cleaned.assembly.parts)
    assert isinstance(made, Pipe)
    assert made.thickness == pytest.approx(tube.thickness, rel=1 / 50)
    assert made.radius == pytest.approx(tube.radius, abs=0.01)
