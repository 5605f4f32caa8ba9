"""Edges that boolean operations leave and that a file cannot hold are dropped."""

from __future__ import annotations

from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.export import export, step
from partwright.fields import Box, Cylinder
from tests.export.step_faces import read_back

pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")


def short_edges(shape: object, length: float) -> int:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from partwright.export.brep_topology import edges_of

    count = 0
    for edge in edges_of(shape):  # type: ignore[arg-type]
        found = GProp_GProps()
        BRepGProp.LinearProperties_s(edge, found)
        count += found.Mass() < length
    return count


def test_a_step_that_nobody_sees_goes_and_the_solid_stays() -> None:
    """Two blocks side by side, of which one is higher by a hundred-thousandth."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    from partwright.export.brep_healing import without_short_edges
    from partwright.export.brep_topology import volume_and_area

    low = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(1, 1, 1)).Shape()
    high = BRepPrimAPI_MakeBox(gp_Pnt(1, 0, 0), gp_Pnt(2, 1, 1 + 1e-5)).Shape()
    both = BRepAlgoAPI_Fuse(low, high).Shape()
    assert short_edges(both, 5e-5) > 0
    healed = without_short_edges(both, 5e-5)
    assert short_edges(healed, 5e-5) == 0
    assert BRepCheck_Analyzer(healed).IsValid()
    assert volume_and_area(healed)[0] == pytest.approx(2.0, rel=2e-5)
    assert short_edges(both, 5e-5) > 0, "what was given stays"


def test_a_file_that_reads_well_without_them_is_exact(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither facets nor a warning; only the first reading is at fault here."""
    readings: list[Path] = []
    volume = step._volume_read
    monkeypatch.setattr(
        step,
        "_volume_read",
        lambda path: readings.append(path) or (volume(path) if len(readings) > 1 else None),
    )
    pin = Part(Cylinder(0.5, 4), name="pin")
    export(Assembly((Part(Box((2, 2, 2)), name="box"), pin), "difference", unit="mm"), tmp_path / "a.step")
    assert len(readings) == 2
    assert read_back(tmp_path / "a.step")[1] == {"Plane": 6, "Cylinder": 1}
    assert [path.name for path in tmp_path.iterdir()] == ["a.step"]
