"""Objectives: numbers known exactly, and derivatives against finite differences of the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.errors import ObjectiveError, SettingError
from partwright.fields import Box, Sphere, SuperFrustum
from partwright.goals import OBJECTIVES, Start, by_torch
from partwright.goals.objective import measured
from partwright.goals.surface import surface_of
from partwright.goals.wanted import Bound, Wanted, measure_of

BOX = Assembly((Part(Box((3.0, 2.0, 1.0)), (0.5, 0.0, 0.25), name="box"),), unit="m")
BALL = Assembly((Part(Sphere(1.0), name="ball"),))
LUMP = Assembly(
    (Part(SuperFrustum((1.4, 1.0, 1.6), 0.6, 0.2, 0.8)), Part(Sphere(0.6), (0.5, 0.3, 0.2), blend=0.2))
)

NEED_MORE = ("keep_out", "distance", "surrogate_drag")  # than their name: these have tests of their own


def start_of(assembly: Assembly, resolution: int = 32) -> Start:
    return Start(assembly, surface_of(assembly, resolution), float(np.ptp(assembly.bounds(), axis=0).max()))


def number(name: str, assembly: Assembly, resolution: int = 32) -> float:
    start = start_of(assembly, resolution)
    faces = np.zeros(len(start.surface.faces), int)
    return measured(name, measure_of(name, start)[0], start.surface, faces).value


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("volume", 6.0),
        ("mass@7850", 6 * 7850.0),
        ("centre@x", 0.5),
        ("centre@-z", -0.25),
        ("inertia@z", 6 * (9 + 4) / 12),
        ("frontal_area@x", 2.0),
        ("frontal_area@-y", 3.0),
        ("silhouette@z", 0.0),
        ("keep_out@0,-5,-5,9,9,9", 4.0),
        ("keep_out@0,-5,-5,9,9,9;-9,-9,0,9,9,9", 4.0 + 4.5),
        ("wall_thickness", 1.0),
        ("newtonian_drag@x", 2 * 2.0),
        ("newtonian_drag@-z", 2 * 6.0),
    ],
)
def test_of_a_box_they_are_exact(name: str, value: float) -> None:
    assert number(name, BOX) == pytest.approx(value, rel=1e-5, abs=1e-9)


def test_a_ball_in_newtonian_flow_has_a_drag_coefficient_of_one() -> None:
    assert number("newtonian_drag@y", BALL, 64) == pytest.approx(np.pi, rel=0.01)


def test_faces_in_the_lee_of_others_are_not_met_by_the_flow() -> None:
    behind = Assembly((Part(Box((1.0, 1.0, 1.0))), Part(Box((1.0, 1.0, 1.0)), (3.0, 0, 0))))
    assert number("newtonian_drag@x", behind) == pytest.approx(2.0, rel=1e-6)


def test_the_distance_to_a_target_is_that_between_two_balls(tmp_path: Path) -> None:
    surface_of(BALL, 48).export(tmp_path / "ball.stl")
    larger = Assembly((Part(Sphere(1.25)),))
    assert number(f"distance@{tmp_path / 'ball.stl'}", larger, 48) == pytest.approx(0.25, rel=0.01)


@pytest.mark.parametrize(
    "name",
    [*(n for n in OBJECTIVES.own if n not in NEED_MORE), "keep_out@0,0,0,2,2,2"],
)
def test_derivatives_are_those_of_finite_differences(name: str) -> None:
    """Along a smooth motion of all vertices: a stretch, a shear and a shift."""
    start = start_of(LUMP)
    measure, _ = measure_of(name, start)
    faces, x = np.array(start.surface.faces), np.array(start.surface.vertices)
    labels = np.zeros(len(faces), int)
    motion = x * (1.0, -0.4, 0.3) + x[:, [1, 2, 0]] * (0.2, 0.1, -0.3) + (0.1, 0.2, 0.3)
    at = x + 1e-2 * motion  # the outline at the start itself is a kink of `silhouette`
    _, slope = measure(at, faces, labels)
    ends = [measure(at + s * 1e-3 * motion, faces, labels)[0] for s in (1, -1)]
    expected = (ends[0] - ends[1]) / 2e-3
    assert (slope * motion).sum() == pytest.approx(expected, rel=0.06 if name.startswith("keep") else 0.03)


def test_a_function_of_a_file_is_an_objective(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "def reach(v, f, labels):\n    return v[:, 0] @ v[:, 0] / 2, v * [1, 0, 0]\n"
    )
    start = start_of(BOX)
    measure, _ = measure_of(f"{tmp_path / 'own.py'}:reach", start)
    found = measured("own", measure, start.surface, np.zeros(len(start.surface.faces), int))
    assert found.value == pytest.approx((start.surface.vertices[:, 0] ** 2).sum() / 2)


@pytest.mark.parametrize(
    ("measure", "said"),
    [
        (lambda v, f, n: (float("nan"), v), "its number is nan"),
        (lambda v, f, n: 1.0, "no gradient"),
        (lambda v, f, n: (1.0, v * np.inf), "not finite"),
        (lambda v, f, n: (1.0, v[:2]), "of shape"),
        (lambda v, f, n: 1 / 0, "division by zero"),
        (lambda v, f, n: "much", "failed: ValueError"),
        (by_torch(lambda x, f, n: 3.0), "does not depend on the vertices"),  # type: ignore[arg-type,return-value]
    ],
)  # fmt: skip
def test_numbers_that_cannot_be_used_are_refused(measure: object, said: str) -> None:
    start = start_of(BOX)
    with pytest.raises(ObjectiveError, match=said):
        measured("own", measure, start.surface, np.zeros(len(start.surface.faces), int))  # type: ignore[arg-type]


def test_what_is_typed_is_understood() -> None:
    assert Wanted.of("newtonian_drag@-x") == Wanted("newtonian_drag@-x")
    both = Wanted.of("centre@z=1.5e1:-2")
    assert (both.name, both.target and both.target.value, both.weight) == ("centre@z", 15.0, -2.0)
    own = Wanted.of("C:/goals/own.py:lighter:3")
    assert (own.name, own.target, own.weight) == ("C:/goals/own.py:lighter", None, 3.0)
    share = Wanted.of("volume=80%").target
    assert share is not None
    assert share.beside(5.0) == pytest.approx(4.0)
    bound = Bound.of("leg_*.tz >= -5")
    assert (bound.name, bound.upper, bound.value.value, bound.of_parameter) == ("leg_*.tz", False, -5.0, True)
    assert not Bound.of("keep_out@0,0,0,1.5,1,1<=0").of_parameter


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("volum", "did you mean 'volume'"),
        ("volume@x", "takes no argument"),
        ("centre@up", "expected an axis"),
        ("keep_out@1,2,3", "expected boxes"),
        ("keep_out", "expected boxes"),
        ("mass@-1", "expected a density"),
        ("distance", "expected a file"),
        ("nowhere.py:lighter", "there is no file"),
    ],
)
def test_names_and_arguments_that_do_not_exist_are_refused(name: str, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        measure_of(name, start_of(BOX, 8))
    with pytest.raises(SettingError, match="expected NAME<=VALUE"):
        Bound.of("volume<5")
