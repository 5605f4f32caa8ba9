"""What OpenCASCADE gets wrong at first comes out right, or is said."""

from __future__ import annotations

import functools
import json
import math
from pathlib import Path
from typing import Any

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.similarity import Similarity
from partwright.errors import (
    NoSurfaceError,
)
from partwright.export import brep_booleans, brep_tree, export, step
from partwright.export.brep_facets import FacetsWarning
from partwright.export.brep_healing import SHORT
from partwright.fields import Box, Cylinder, Extrusion, Revolution, Sphere, SuperFrustum, Tube
from partwright.fields.profile import Profile
from partwright.meshing import has_exact_mesh, mesh_csg, mesh_part
from tests.export.step_faces import ANALYTIC, read_back
from tests.export.trees import lone

pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")


@pytest.mark.parametrize(
    "outline",
    [
        (
            (0.372, 0.0983, 0.63),
            (0.0, 0.9),
            (0.0, -0.5),
            (0.372, -0.5),
        ),  # an arc about a place beyond the axis
        (
            (1, 1),
            (0, 1),
            (0, 0.8, -0.9996),
            (0, -0.3),
            (0, -0.5),
            (1, -0.5),
        ),  # nearly half a circle, a cavity
    ],
)
def test_arcs_whose_circles_cross_the_axis_are_read_as_they_were(tmp_path: Path, outline: Any) -> None:
    field = Revolution(Profile(outline))
    export(lone(field, unit="mm"), tmp_path / "solid.step")
    volume, kinds = read_back(tmp_path / "solid.step")
    assert volume == pytest.approx(mesh_part(Part(field), 256).volume, rel=1e-3)
    assert set(kinds) <= ANALYTIC | {"SurfaceOfRevolution"}


def test_faces_that_nearly_touch_are_united(tmp_path: Path) -> None:
    """Two pieces as a fit has them, round alike but for the fourth digit: their exact union loses a third."""
    rounds = ((0.3817, 0.11, 0.642910064975703), (0.065, 0.11), (-0.4007, 0.11))
    left = (*rounds, (-0.4135, 0.1462, 1.1706161833162516), (-0.6018, 0.0441), (-0.4007, -0.2185))
    waved = ((0.9, -0.1527, 0.4142141496294555), (0.8672, -0.1199), (0.7358, -0.1199, -0.41421363398847827))
    rounds = (
        (0.67, -0.0542),
        (0.67, 0.11),
        (0.1058, 0.11, 0.642910064975703),
        (-0.211, 0.11),
        (-0.6766, 0.11),
    )
    right = ((-0.6895, 0.1462, 1.1706271160175887), (-0.8777, 0.0441), (-0.6766, -0.2185), (0.9, -0.2185))
    block = Extrusion(Profile((*left, (0.624, -0.2185), (0.624, 0.11))), 0.2628)
    bar = Extrusion(Profile((*waved, *rounds, *right)), 0.1445)
    turned = (0.5, 0.5, 0.5, 0.5)
    tree = Assembly((Part(block, (0.2496, -0.276, 1e-5), turned), Part(bar, (0.3875, 0, 1e-5), turned)))
    export(tree, tmp_path / "bars.step")
    volume, kinds = read_back(tmp_path / "bars.step")
    assert volume == pytest.approx(mesh_csg(tree).volume, rel=1e-3)
    assert set(kinds) <= ANALYTIC
    assert not (tmp_path / "bars.step.report.json").exists()


def test_balls_of_a_ring_that_turn_with_it_are_all_there(tmp_path: Path) -> None:
    """Turned with the ring, the poles and seams of balls come to lie in the edges of the race."""
    ring = Part(Cylinder(0.9, 0.57), rotation=(0.9999, 0, 0, -0.0136))
    bore = Part(Cylinder(0.33, 0.7))
    lower = Part(Tube(0.71984, 0.22533, 0.3437), (0, 0, -0.1445), (0.9556, 0, 0, 0.2945))
    upper = Part(Tube(0.71985, 0.22528, 0.3239), (0, 0, 0.154), (0.9668, 0, 0, 0.2554))
    turns = [(math.cos(k * math.pi / 12), 0.0, 0.0, math.sin(k * math.pi / 12)) for k in range(1, 12)]
    ball = Part(
        Sphere(0.14023),
        (-0.5261, 0.3037, 0),
        (0.5, 0.5, 0.5, 0.5),
        instances=tuple(Similarity(rotation=turn) for turn in turns),
    )
    tree = Assembly((Assembly((ring, bore, lower, upper), "difference"), ball), unit="mm")
    export(tree, tmp_path / "bearing.step")
    volume, kinds = read_back(tmp_path / "bearing.step")
    assert volume == pytest.approx(mesh_csg(tree, 1e-4).volume, rel=1e-3)
    assert kinds["Sphere"] == 12
    assert not (tmp_path / "bearing.step.report.json").exists()


def test_faces_stay_several_where_making_them_one_loses_volume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where OpenCASCADE makes faces one and drops what they bound, and calls that valid."""
    from OCP import ShapeUpgrade
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    class Losing:
        def __init__(self, *_: Any) -> None: ...
        def Build(self) -> None: ...
        def Shape(self) -> Any:
            return BRepPrimAPI_MakeBox(1, 1, 1).Shape()

    monkeypatch.setattr(ShapeUpgrade, "ShapeUpgrade_UnifySameDomain", Losing)
    tree = Assembly((Part(Cylinder(1, 2)), Part(Cylinder(1, 2), (0, 0, 1))), unit="mm")
    export(tree, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(3 * math.pi, rel=1e-6)
    assert kinds["Cylinder"] > 1  # the seams show


def test_what_cannot_be_joined_moves_a_hair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where OpenCASCADE fails at all operands where they are."""
    monkeypatch.setattr(brep_booleans, "_results", lambda *_: iter(()))
    tree = Assembly((Part(Box((2, 2, 2)), name="box"), Part(Cylinder(0.5, 4), name="pin")), unit="cm")
    export(tree, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume / 1e3 == pytest.approx(8 + math.pi / 2, rel=1e-3)
    assert set(kinds) == {"Plane", "Cylinder"}
    (change,) = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert change["parts"] == ["pin"]
    assert change["max_deviation"] == pytest.approx(2e-4 * 2, rel=1e-6)


@pytest.mark.parametrize("operation", ["union", "difference"])
def test_what_fails_for_one_part_costs_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, operation: Any
) -> None:
    """As where OpenCASCADE unites or cuts all but the pin, which it takes as facets in a cut at most."""
    operated = brep_tree.operated

    def without_pins(kind: str, solids: Any, right: Any, label: str, *ways: Any, **rough: Any) -> Any:
        whole_pin = label == "'pin'" and kind == operation and (operation == "union" or not faceted)
        if len(solids) > 2 or whole_pin:
            raise NoSurfaceError("fails")
        return operated(kind, solids, right, label, *ways, **rough)

    faceted: list[Any] = []
    facets = brep_tree.faceted
    monkeypatch.setattr(brep_tree, "faceted", lambda node, fine: faceted.append(node) or facets(node, fine))
    monkeypatch.setattr(brep_tree, "operated", without_pins)
    moved = brep_tree.operated_on_moved

    def without_moved_pins(kind: str, solids: Any, right: Any, label: str, *ways: Any) -> Any:
        if label == "'pin'":
            raise NoSurfaceError("fails")
        return moved(kind, solids, right, label, *ways)

    monkeypatch.setattr(brep_tree, "operated_on_moved", without_moved_pins)
    parts = (
        Part(Box((2, 2, 2)), name="box"),
        Part(Cylinder(0.5, 4), name="pin"),
        Part(Box((1, 1, 1)), (1, 0, 0), name="side"),
    )
    tree = Assembly(parts, operation, unit="cm")
    export(tree, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume / 1e3 == pytest.approx(mesh_csg(tree).volume, rel=4e-3)  # facets
    (change,) = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert change["parts"] == ["pin"]
    assert set(kinds) == ({"Plane", "Cylinder"} if operation == "union" else {"Plane"})


def test_a_file_that_reads_badly_is_made_again_with_wide_tolerances(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where what was valid in memory is not after the digits of the file, without short edges either."""
    readings, tolerances = [], []
    results = brep_booleans._results

    def seen(kind: str, solids: Any, given: Any, repairs: Any) -> Any:
        tolerances.append(given[0])
        return results(kind, solids, given, repairs)

    volume = step._volume_read
    monkeypatch.setattr(
        step,
        "_volume_read",
        lambda path: readings.append(path) or (volume(path) if len(readings) > 1 + len(SHORT) else None),
    )
    monkeypatch.setattr(brep_booleans, "_results", seen)
    tree = Assembly((Part(Box((2, 2, 2))), Part(Cylinder(0.5, 4))), unit="mm")
    export(tree, tmp_path / "a.step")
    assert len(readings) == 2 + len(SHORT)
    assert tolerances[0] == 0 < tolerances[-1]
    assert read_back(tmp_path / "a.step")[0] == pytest.approx(8 + math.pi / 2, rel=1e-3)
    assert [path.name for path in tmp_path.iterdir()] == ["a.step"]


def test_tries_have_a_budget_and_the_report_says_that_it_is_spent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where nothing that OpenCASCADE makes is right: some tries, and facets."""
    tries: list[int] = []
    monkeypatch.setattr(brep_booleans, "_at_once", lambda _, solids, fuzzy: tries.append(len(solids)))
    parts = [Part(Box((2, 2, 2)), (1.5 * k, 0, 0.1 * k), name=f"box_{k}") for k in range(5)]
    exporting = functools.partial(export, Assembly(tuple(parts), unit="cm"), tmp_path / "a.step")
    exporting()
    unbounded = len(tries)
    assert "budget" not in (report := tmp_path / "a.step.report.json").read_text()
    tries.clear()
    with monkeypatch.context() as small:
        small.setattr(brep_booleans.Repairs.__init__, "__defaults__", (30,))  # each box has six faces
        exporting()
    # The first of the whole, and of each box that joins it, and of what is left of each.
    assert len(tries) == 9 < unbounded
    assert "until the budget" in json.loads(report.read_text())["notes"][-1]
    assert read_back(tmp_path / "a.step")[1].keys() == {"Plane"}


def test_an_outline_that_touches_itself_is_moved_a_hair_apart(tmp_path: Path) -> None:
    quarter = -math.tan(math.pi / 8) - 1e-7  # a touch beyond the edge, within rounding
    hole = [(0.5, 1, quarter), (0.8, 0.7), (0.8, 0.5, -1), (0.2, 0.5), (0.2, 0.7, quarter), (0.5, 1)]
    touching = Profile([(0, 0), (1, 0), (1, 1), *hole, (0, 1)])
    tree = Assembly((Part(Extrusion(touching, 0.2), name="ring"), Part(Cylinder(0.1, 1), (0.12, 0.12, 0))))
    export(tree, tmp_path / "ring.step")
    volume, kinds = read_back(tmp_path / "ring.step")
    assert volume == pytest.approx(mesh_csg(tree).volume, rel=1e-3)
    assert kinds == {"Plane": 10, "Cylinder": 5}
    (change,) = json.loads((tmp_path / "ring.step.report.json").read_text())["approximated"]
    assert (change["parts"], change["to"]) == (["ring"], "extrusion")
    assert 0 < change["max_deviation"] < 1e-3


def test_a_part_too_small_for_opencascade_does_not_end_the_export(tmp_path: Path) -> None:
    apart = Assembly((Part(Sphere(1e-9)), Part(Box((1e8, 1e8, 1e8)), (1e8, 0, 0))))
    export(apart, tmp_path / "apart.step")
    assert (tmp_path / "apart.step").stat().st_size > 1000


def test_a_bent_part_that_a_union_loses_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bent parts have no exact mesh; points of their field tell the volume."""
    bent = SuperFrustum((0.4, 0.3, 1.0), bulge=0.3)
    tree = Assembly((Part(bent, name="left"), Part(bent, (1.0, 0.0, 0.0), name="right")), unit="mm")
    assert not has_exact_mesh(tree)
    export(tree, tmp_path / "whole.step")
    assert not (tmp_path / "whole.step.report.json").exists()
    monkeypatch.setattr(brep_tree, "operated", lambda _, solids, *rest: solids[0])
    with pytest.warns(FacetsWarning, match=r"off by -(49|50)\.\d %"):
        export(tree, tmp_path / "half.step")
    told = json.loads((tmp_path / "half.step.report.json").read_text())["approximated"]
    assert [change["to"] for change in told] == ["a solid of another volume"]
