"""USD as usd-core reads and validates it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.palette import palette
from partwright.errors import MissingDependencyError, OutputError
from partwright.export import export
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum
from tests.export.robotics import natives

pxr = pytest.importorskip("pxr")
SUFFIXES = [".usda", ".usdc", ".usd"]


def opened(assembly: Assembly, path: Path) -> Any:
    from pxr import Usd

    export(assembly, path, resolution=16)
    return Usd.Stage.Open(str(path))


def bounds(stage: Any) -> np.ndarray:
    from pxr import Usd, UsdGeom

    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"])
    box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_validator_of_usd_is_content(tmp_path: Path, suffix: str) -> None:
    from pxr import UsdValidation

    block = Part(Box((2, 2, 2)), name="block") - Part(Sphere(0.5), name="a hole")
    leg = Part(Cylinder(0.2, 1.0), (3, 0, 0), name="leg", instances=(Similarity(translation=(1, 0, 0)),))
    stage = opened(
        Assembly((block, leg), unit="mm", up="y", metadata={"source": "a.ply"}), tmp_path / f"a{suffix}"
    )
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [(e.GetName(), e.GetMessage()) for e in errors] == []


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_named_coloured_xform_with_a_mesh_for_each_part(tmp_path: Path, suffix: str) -> None:
    from pxr import UsdGeom

    stage = opened(natives(), tmp_path / f"a{suffix}")
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
    prims = stage.GetDefaultPrim().GetChildren()
    assert [prim.GetDisplayName() or prim.GetName() for prim in prims] == [p.name for p in natives().parts]
    about = prims[1].GetCustomData()["partwright"]
    assert about["field"] == {"kind": "cylinder", "radius": 50.0, "height": 200.0}
    assert about["blend"] == 0.0
    mesh = UsdGeom.Mesh(prims[1].GetChild("mesh"))
    matrix = UsdGeom.Xformable(prims[1]).ComputeLocalToWorldTransform(0)
    points = np.array([matrix.Transform(point) for point in mesh.GetPointsAttr().Get()], dtype=np.float64)
    assert np.allclose(np.abs(natives()["post"].distance(points)), 0, atol=2)
    linear = ((palette(2)[1] / 255 + 0.055) / 1.055) ** 2.4
    assert np.allclose(mesh.GetDisplayColorAttr().Get()[0], linear, atol=1e-3)
    assert np.allclose(bounds(stage), natives().bounds(), atol=10)  # USD's box around a turned rod is loose


@pytest.mark.parametrize(
    ("axis", "told"), [("x", "Z"), ("-x", "Z"), ("y", "Y"), ("-y", "Z"), ("z", "Z"), ("-z", "Z")]
)
def test_every_up_axis_is_up(tmp_path: Path, axis: str, told: str) -> None:
    from pxr import UsdGeom

    x, y, z = (5.0 * (letter == axis[-1]) * (-1) ** axis.startswith("-") for letter in "xyz")
    ball = Part(Sphere(1), (x, y, z))
    stage = opened(Assembly((ball,), unit="m", up=axis), tmp_path / "a.usdc")
    assert UsdGeom.GetStageUpAxis(stage) == told
    middle = bounds(stage).mean(axis=0)
    assert np.allclose(middle, np.array([0.0, 5.0, 0.0] if told == "Y" else [0.0, 0.0, 5.0]), atol=0.1)


def test_subtracted_parts_are_guides_and_copies_are_in_place(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    block = Part(Box((2, 2, 2)), name="block") - Part(Sphere(0.5), name="hole")
    leg = Part(Cylinder(0.2, 1.0), (3, 0, 0), name="leg", instances=(Similarity(translation=(1, 0, 0)),))
    stage = opened(Assembly((block, leg), unit="m", up="z"), tmp_path / "a.usda")
    every = list(stage.Traverse(Usd.TraverseInstanceProxies()))
    assert [prim.GetName() for prim in every if prim.IsInstance()] == ["leg_2"]
    meshes = {str(p.GetPath()): UsdGeom.Mesh(p) for p in every if p.IsA(UsdGeom.Mesh)}
    purposes = {path.split("/")[-2]: mesh.GetPurposeAttr().Get() for path, mesh in meshes.items()}
    assert purposes == {"block": "default", "hole": "guide", "leg": "default", "leg_2": "default"}
    shown = {path.split("/")[-2]: mesh.ComputeVisibility() for path, mesh in meshes.items()}
    assert shown == {"block": "inherited", "hole": "invisible", "leg": "inherited", "leg_2": "inherited"}
    assert (
        stage.GetPrimAtPath("/assembly/assembly/hole").GetCustomData()["partwright"]["role"] == "subtracted"
    )
    assert np.allclose(bounds(stage), [[-1.0, -1.0, -1.0], [4.2, 1.0, 1.0]], atol=0.03)


def test_a_part_without_volume_is_an_xform_without_mesh_and_units_unknown_are_said(tmp_path: Path) -> None:
    sheet = Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet")
    stage = opened(Assembly((Part(Sphere(1.0), name="ball"), sheet)), tmp_path / "a.usda")
    prim = stage.GetPrimAtPath("/assembly/sheet")
    assert prim.GetCustomData()["partwright"]["note"] == "no surface of its own at this resolution"
    assert not prim.GetChildren()
    assert "unit is unknown" in stage.GetDefaultPrim().GetCustomData()["partwright"]["note"]


def test_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OutputError, match="nowhere"):
        export(natives(), tmp_path / "nowhere" / "a.usdc", resolution=8)
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'partwright\[usd\]'"):
        export(natives(), tmp_path / "a.usda")
    assert not list(tmp_path.iterdir())
