"""Rims of extrusions face by face, outlines that cross themselves, and small shapes, in STEP."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.atomic_io import report_path
from partwright.errors import NoSurfaceError
from partwright.export import export, step
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.fields.profile import circle
from partwright.meshing import mesh_csg
from tests.export.step_faces import ANALYTIC, read_back

pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")

ROUNDED = Profile.rectangle(20, 12, 3)
BRACKET = Profile.polygon([(-5, -5), (5, -5), (5, 0), (0, 0), (0, 5), (-5, 5)])
# As a fit has it: arcs that meet at a few degrees, some of them about as round as the fillet is.
KINKED = Profile(
    [
        (-11.3, -50),
        (11.3, -50),
        (11.29, 56.86, 0.2536),
        (10.15, 59.51, 0.1443),
        (-9.81, 59.59, 0.3002),
        (-11.04, 58.32, 0.0847),
        (-11.3, 56.61),
    ]
)


@pytest.mark.parametrize(
    "field",
    [
        Extrusion(ROUNDED, 6, top_fillet=2, bottom_chamfer=1),
        Extrusion(ROUNDED, 7, top_fillet=3, bottom_fillet=4),
        Extrusion(Profile.rectangle(20, 12, 1), 8, top_chamfer=2),
        Extrusion(Profile(ROUNDED.outline, [circle(2, (1, 0))]), 4, top_fillet=1),
        Extrusion(BRACKET, 4, top_fillet=1, bottom_chamfer=0.5),
        Extrusion(KINKED, 9.41, top_fillet=1.47),
    ],
    ids=["both", "round as its corners", "corners less round", "a hole", "an inner corner", "kinks"],
)
def test_strips_lie_on_the_surface_and_close(field: Extrusion) -> None:
    from OCP.BRepCheck import BRepCheck_Analyzer

    from partwright.export.brep import _places
    from partwright.export.brep_rim_strips import with_strips
    from partwright.export.brep_topology import volume_of

    solid = with_strips(field)
    assert BRepCheck_Analyzer(solid).IsValid()
    assert volume_of(solid) == pytest.approx(mesh_csg(Part(field), 1e-3).volume, rel=5e-4)
    places = _places(solid, 1e-3 * field.profile.size)
    assert np.abs(field(places)).max() < 1e-4 * field.profile.size


def test_rims_about_kinks_are_exact_in_step(tmp_path: Path) -> None:
    """An arc was taken for chords there, and a spline was left where they met."""
    whole = Assembly((Part(Extrusion(KINKED, 9.41, top_fillet=1.47), name="plate"),), unit="mm")
    export(whole, tmp_path / "a.step")
    assert not report_path(tmp_path / "a.step").exists()
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(mesh_csg(whole, 1e-3).volume, rel=5e-4)
    assert set(kinds) <= ANALYTIC | {"SurfaceOfRevolution"}


def test_a_ridge_is_no_end() -> None:
    from partwright.export.brep_rim_strips import with_strips

    with pytest.raises(NoSurfaceError):
        with_strips(Extrusion(Profile.rectangle(20, 6, 3), 8, top_fillet=3))


# The side up to the arc at (15.45, 9.59) runs across its beginning, less than chords of the profile tell.
CROSSED = Profile(
    [
        (-15.45, 18.1),
        (-15.45, -18.1),
        (-3.73, -18.1),
        (-3.73, -5.33),
        (0.53, -1.06),
        (9.05, -1.06),
        (13.31, -5.33),
        (13.31, -18.1),
        (15.45, 9.59, -1.0),
        (0.53, 9.59),
    ]
)


def test_an_outline_that_crosses_itself_about_a_corner_turns_where_it_does(tmp_path: Path) -> None:
    """Facets stood for such a part."""
    whole = Assembly((Part(Extrusion(CROSSED, 8), name="plate"),), unit="mm")
    export(whole, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(mesh_csg(whole, 1e-3).volume, rel=1e-3)
    assert kinds == {"Plane": 11, "Cylinder": 1}
    (change,) = json.loads(report_path(tmp_path / "a.step").read_text())["approximated"]
    assert change["to"] == "extrusion"
    assert 0 < change["max_deviation"] < 0.03


def test_outlines_that_do_not_cross_themselves_stay() -> None:
    from partwright.export.brep_crossed_corners import uncrossed

    for profile in (ROUNDED, KINKED, BRACKET, Profile(ROUNDED.outline, [circle(2, (1, 0))])):
        assert uncrossed(profile) == (profile.loops, 0.0)


@pytest.mark.parametrize(("unit", "longest"), [("mm", 1.8), ("um", 300.0), (None, 0.02), ("cm", 30.0)])
def test_small_shapes_are_built_large_and_written_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unit: str | None, longest: float
) -> None:
    """OpenCASCADE's tolerance is a length: unions of parts that are one or two long went wrong."""
    built: list[float] = []
    combined = step.combined
    monkeypatch.setattr(
        step,
        "combined",
        lambda node, *rest: built.append(float(np.ptp(node.bounds(), axis=0).max())) or combined(node, *rest),
    )
    bar = Part(Box((longest, longest / 4, longest / 4)))
    whole = Assembly((bar, Part(Cylinder(longest / 10, longest / 2))), unit=unit)
    export(whole, tmp_path / "a.step")
    assert 100 <= built[0] < 1000
    scale = {"mm": 1.0, "um": 1e-3, None: 1.0, "cm": 10.0}[unit]
    volume, kinds = read_back(tmp_path / "a.step")
    expected = longest**3 * (1 / 16 + math.pi / 100 * (1 / 2 - 1 / 4))
    assert volume == pytest.approx(expected * scale**3, rel=1e-6)
    assert kinds == {"Plane": 8, "Cylinder": 2}
