"""The search: where the best is known, bounds, what stays, and how it ends."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.cli.main import main
from partwright.cli.optimise import FILES as SAID
from partwright.errors import ObjectiveError, SettingError
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum
from partwright.goals import Options, Step, optimise
from partwright.goals.contacts import contacts, pieces_by
from partwright.goals.optimising import FILES
from partwright.goals.problem import Problem
from partwright.goals.surface import pieces, surface_of
from partwright.goals.symmetry import asymmetry
from partwright.goals.wanted import Wanted
from partwright.methods import Cancellation

PLATE = Part(Box((2.0, 1.0, 0.4)), name="plate")
POST = Part(Cylinder(0.25, 1.0), (0.6, 0.0, 0.6), name="post")
BOSS = Part(SuperFrustum((0.5, 0.6, 0.6), 0.3, taper=0.8), (-0.5, 0.0, 0.4), blend=0.08, name="boss")
QUICK = Options(steps=6, resolution=24, anchor=0.0)


def test_a_box_of_a_given_width_becomes_as_light_as_its_bounds_allow() -> None:
    bounds = ["plate.size_x>=1.8", "plate.size_y>=0.8", "wall_thickness>=75%"]
    options = Options(steps=20, resolution=16, anchor=0.0)
    result = optimise(Assembly((PLATE,)), "volume", bounds=bounds, options=options)
    field: Any = result.assembly["plate"].field
    assert field.size == pytest.approx((1.8, 0.8, 0.3), rel=0.02)
    assert result.kept


def test_a_target_is_met_and_frozen_parts_keep_their_bits() -> None:
    assembly = Assembly((PLATE, POST, BOSS))
    result = optimise(assembly, "centre@x=0.05", freeze=["plate", "post:form"], options=QUICK)
    assert result.numbers["centre@x"][1] == pytest.approx(0.05, abs=0.01)
    assert result.assembly["plate"] == assembly["plate"]
    assert result.assembly["post"].field == assembly["post"].field
    assert result.assembly["post"] != assembly["post"]


def test_what_touched_still_does_and_nothing_comes_loose() -> None:
    """The post is pulled up and away; only the contact holds it (by an edge, where it tilts)."""
    assembly = Assembly((PLATE, POST))
    (touch,) = contacts(assembly)
    assert touch.depth == pytest.approx(-0.1, abs=0.01)
    options = Options(steps=8, resolution=24, anchor=0.0, reach=1.0)
    result = optimise(assembly, "centre@z:-1", freeze=["plate", "post:form"], options=options)
    moved = result.assembly["post"].translation[2]
    assert 0.62 < moved <= 0.7
    assert result.kept
    assert contacts(result.assembly)
    free = Options(steps=8, resolution=24, anchor=0.0, reach=1.0, contacts=False)
    loose = optimise(assembly, "centre@z:-1", freeze=["plate", "post:form"], options=free)
    assert loose.assembly["post"].translation[2] < 0.72  # kept by the rule that nothing comes loose


def test_what_was_apart_by_less_than_a_cell_may_go_where_the_mesh_sees_it() -> None:
    """The mesh joins what a gap of a fifth of a cell parts: that is no piece that came loose."""
    apart = Part(SuperFrustum((0.5, 0.5, 0.4), 0.3), (0.1, 0.03, 0.415), name="apart")
    assembly = Assembly((PLATE, apart))
    options = Options(resolution=28)
    problem = Problem(assembly, [Wanted.of("volume")], [], ["plate"], options)
    names = [problem.parameters.name(k) for k in range(len(problem.parameters))]
    change = np.zeros(len(names))
    change[names.index("apart.tz")] = 0.06 / problem.parameters.units[names.index("apart.tz")]
    assert pieces(surface_of(assembly, 28)) == 1
    moved = problem.at(change)
    assert moved is not None
    assert pieces(moved.surface) == 2


def test_pieces_are_counted_by_what_touches() -> None:
    """Two wheels, each with its tyre, stand apart from a plate with its post."""
    move = Similarity(1.0, (0.0, 0.0, 0.0, 1.0))
    wheel = Part(Cylinder(0.2, 0.2), (0.8, 2.0, 0.0), name="wheel", instances=(move,))
    tyre = Part(Cylinder(0.3, 0.1), (0.8, 2.0, 0.0), name="tyre", instances=(move,))
    assembly = Assembly((PLATE, wheel, POST, tyre))
    assert pieces_by(contacts(assembly), assembly) == 3
    assert pieces(surface_of(assembly, 32)) == 3
    assert pieces_by(contacts(Assembly((PLATE, POST))), Assembly((PLATE, POST))) == 1


def test_changes_are_the_same_on_both_sides() -> None:
    """Mass is pulled to one side, where it is 0 but for rounding; and both sides may only change alike."""
    sides = [Part(Cylinder(0.25, 1.0), (x, 0.0, 0.6), name=f"side{x}") for x in (-0.6, 0.6)]
    assembly = Assembly((PLATE, *sides))
    goals, bounds = ["volume", "centre@x:-0.5"], ["volume>=80%"]
    options = Options(steps=3, resolution=12, anchor=0.0)
    apart = optimise(assembly, goals, bounds=bounds, freeze=["plate"], options=options)
    assert 0.01 < apart.numbers["centre@x"][1] < 1.0
    both = replace(options, symmetric="x")
    alike = optimise(assembly, goals, bounds=bounds, freeze=["plate"], options=both)
    assert abs(alike.numbers["centre@x"][1]) < 5e-3
    assert alike.numbers["volume"][1] < 0.98 * alike.numbers["volume"][0]
    before, after = alike.to_dict()["asymmetry"]
    assert before < 1e-4
    assert after < 1e-3 < asymmetry(apart.assembly, apart.surface, "x")
    assert apart.to_dict()["asymmetry"] is None


def test_copies_stay_copies() -> None:
    leg = Part(Cylinder(0.1, 0.8), (0.8, 0.3, -0.5), name="leg", instances=(Similarity(1.0, (0, 0, 0, 1)),))
    result = optimise(Assembly((PLATE, leg)), "volume", freeze=["plate"], options=QUICK)
    made = result.assembly["leg"]
    assert made.instances == leg.instances
    assert made.field != leg.field


def test_it_ends_with_the_best_so_far_when_it_is_asked_to(tmp_path: Path) -> None:
    cancel, seen = Cancellation(), []

    def told(step: Step) -> None:
        seen.append(step)
        if sum(s.accepted for s in seen) == 3:
            cancel.request()

    result = optimise(Assembly((PLATE, POST)), "volume", options=QUICK, progress=told, cancel=cancel)
    assert result.ending == "interrupted"
    assert result.numbers["volume"][1] == seen[-1].numbers["volume"] < result.numbers["volume"][0]


def test_an_objective_that_fails_on_the_way_leaves_the_best_so_far(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "calls = []\n"
        "def lighter(v, f, labels):\n"
        "    calls.append(1)\n"
        "    return (float('nan') if len(calls) > 4 else (v ** 2).sum()), 2 * v\n"
    )
    Assembly((PLATE,)).save(tmp_path / "plate.json")
    code = main(
        ["optimise", str(tmp_path / "plate.json"), "-o", str(tmp_path / "out"), "--steps", "9",
         "--resolution", "16", "--objective", f"{tmp_path / 'own.py'}:lighter"]
    )  # fmt: skip
    assert code == 2
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["ending"] == "failed"
    assert "nan" in report["reason"]
    assert load_assembly(tmp_path / "out" / "assembly.json") != Assembly((PLATE,))


def test_the_command_writes_all_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assembly = Assembly((PLATE, POST))
    assembly.save(tmp_path / "a.json")
    arguments = ["--objective", "drag", "--bound", "volume>=60%", "--freeze", "plate"]
    common = ["-o", str(tmp_path / "out"), "--steps", "3", "--resolution", "24"]
    code = main(["optimise", str(tmp_path / "a.json"), *common, *arguments])
    assert code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == set(FILES) == set(SAID)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["unchanged_parts"] == ["plate"]
    assert report["objectives"][0]["name"] == "newtonian_drag@x"
    assert report["objectives"][0]["after"] < report["objectives"][0]["before"]
    assert "no flow simulation" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"objective": "drag@w"}, "newtonian_drag: expected an axis"),
        ({"freeze": ["*"]}, "everything is frozen"),
        ({"freeze": ["wheel_*"]}, "no part is named 'wheel_\\*'; the names are: plate, post"),
        ({"freeze": ["post:colour"]}, "expected after ':' one of pose"),
        ({"bounds": ["wheel.tx<=1"]}, "no part is named 'wheel'"),
        ({"bounds": ["post.diameter<=1"]}, "no such parameter; expected one of tx"),
        ({"bounds": ["post.radius<=0.1"]}, "beyond 0.1"),
        ({"freeze": ["plate", "post:form", "post:position"]}, "no number that is free"),
    ],
)  # fmt: skip
def test_questions_without_an_answer_are_refused(given: dict[str, Any], said: str) -> None:
    sphere = Part(Sphere(0.3), (0.6, 0.0, 0.4), name="post")
    with pytest.raises(SettingError, match=said):
        optimise(Assembly((PLATE, sphere)), **{"objective": "volume", "options": QUICK, **given})


def test_an_objective_without_a_number_at_the_start_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def lighter(v, f, labels):\n    return v.sum()\n")
    with pytest.raises(ObjectiveError, match="gives no gradient"):
        optimise(Assembly((PLATE,)), f"{tmp_path / 'own.py'}:lighter", options=QUICK)
    assert np.isfinite(QUICK.anchor)
