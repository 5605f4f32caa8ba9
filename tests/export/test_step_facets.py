"""STEP files where nothing but flat facets is a valid solid."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.errors import NoSurfaceError
from partwright.export import brep_facets, export, step
from partwright.export.brep_facets import FacetsWarning
from partwright.export.brep_healing import SHORT
from partwright.export.brep_topology import volume_and_area
from partwright.fields import Box, Cylinder
from tests.export.step_faces import read_back
from tests.export.trees import TURNED

pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")


def _read_badly(monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    readings: list[Path] = []
    volume = step._volume_read
    monkeypatch.setattr(
        step,
        "_volume_read",
        lambda path: readings.append(path) or (volume(path) if len(readings) > times else None),
    )


def test_a_file_that_never_reads_well_becomes_facets_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _read_badly(monkeypatch, 2 + len(SHORT))  # as it is, without short edges, with wide tolerances
    pin = Part(Cylinder(0.5, 4), name="pin")
    tree = Assembly((Part(Box((2, 2, 2)), name="box"), pin), "difference", unit="cm", name="plate")
    with pytest.warns(FacetsWarning, match="plate: .* flat facets stand for all"):
        export(tree, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")  # valid, by OpenCASCADE
    assert volume / 1e3 == pytest.approx(8 - math.pi / 2, rel=5e-3)
    assert set(kinds) == {"Plane"}
    assert kinds["Plane"] - 6 > 20  # those of the hole; each of the box is one, whatever its triangles
    (change,) = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert (change["parts"], change["to"]) == (["box", "pin"], "flat facets")
    assert "does not read as a valid solid" in change["note"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.step", "a.step.report.json"]


@pytest.mark.parametrize("made", [True, False])
def test_a_valid_file_of_another_volume_is_not_kept_in_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: bool
) -> None:
    """As where OpenCASCADE calls valid what lacks a face's worth of volume: facets, or a word on how much."""
    readings: list[Path] = []
    volume = step._volume_read
    lacking = 2 if made else 3  # as it is, with wide tolerances, as facets
    share = lambda: 1.0 if len(readings) > lacking else 0.945  # noqa: E731
    monkeypatch.setattr(step, "_volume_read", lambda path: readings.append(path) or share() * volume(path))
    tree = Assembly((Part(Box((2, 2, 2)), name="box"), Part(Cylinder(0.5, 4), name="pin")), unit="cm")
    with pytest.warns(FacetsWarning, match="another volume" if made else r"volume is off by -5\.5 %"):
        export(tree, tmp_path / "a.step")
    assert len(readings) == 3
    (change,) = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert (change["parts"], change["to"]) == (
        ["box", "pin"],
        "flat facets" if made else "a solid of another volume",
    )
    read, kinds = read_back(tmp_path / "a.step")
    assert read / 1e3 == pytest.approx(8 + math.pi / 2, rel=5e-3)
    assert ("Cylinder" in kinds) != made


@pytest.mark.parametrize("made", [True, False])
def test_what_not_even_facets_mend_is_written_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: bool
) -> None:
    def too_small(*_: object, **__: object) -> None:
        raise NoSurfaceError("too small")

    _read_badly(monkeypatch, 3 + len(SHORT))
    if not made:
        monkeypatch.setattr(step, "faceted", too_small)
    with pytest.warns(FacetsWarning, match="not read as a valid solid"):
        export(Assembly((Part(Cylinder(1, 2), name="pin"),), unit="mm"), tmp_path / "a.step")
    assert read_back(tmp_path / "a.step")[1] == {"Plane": 2, "Cylinder": 1}
    (change,) = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert (change["parts"], change["to"]) == (["pin"], "a solid that is not valid")


def test_facets_keep_cavities_pieces_and_whole_planes() -> None:
    """A box with a cavity and a hole beside it, and a loose box, turned: as many planes as they have."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    cuts = (Part(Box((1, 1, 1))), Part(Box((1, 1, 9)), (1.25, 0, 0)))
    hollow = Assembly((Part(Box((4, 4, 4))), *cuts), "difference")
    solid = brep_facets.faceted(Assembly((hollow, Part(Box((4, 4, 4)), (9, 0, 0), TURNED))))
    assert BRepCheck_Analyzer(solid).IsValid()
    assert volume_and_area(solid)[0] == pytest.approx(64 - 1 - 4 + 64, rel=1e-9)
    counts: dict[str, int] = {}
    for kind in ("FACE", "SHELL", "SOLID"):
        found = TopExp_Explorer(solid, getattr(TopAbs_ShapeEnum, f"TopAbs_{kind}"))
        counts[kind] = 0
        while found.More():
            counts[kind] += 1
            found.Next()
    assert counts == {"FACE": 6 + 6 + 4 + 6, "SHELL": 3, "SOLID": 2}
