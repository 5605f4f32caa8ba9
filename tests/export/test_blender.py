"""The script is Python that stands by itself, and Blender, where there is one, builds the solid from it."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.errors import NoSurfaceError, SettingError
from partwright.export import export
from partwright.fields import Quadric, Sphere, SuperFrustum
from tests.export.trees import flange, lone

_MEASURE = """
import bmesh, bpy, json, sys
report = {"collections": {c.name: [o.name for o in c.objects] for c in bpy.data.collections}}
report["volumes"], report["places"], report["properties"] = {}, {}, {}
for collection in bpy.data.collections:
    collection.hide_viewport = False
bpy.context.view_layer.update()
graph = bpy.context.evaluated_depsgraph_get()
for thing in bpy.data.objects:
    if thing.type == "MESH":
        mesh = bmesh.new()
        mesh.from_mesh(thing.evaluated_get(graph).to_mesh())
        report["volumes"][thing.name] = mesh.calc_volume()
        report["places"][thing.name] = [list(row) for row in thing.matrix_world]
        report["properties"][thing.name] = sorted(thing.keys())
with open(sys.argv[-1], "w") as file:
    json.dump(report, file)
"""


def test_the_script_is_plain_python_that_needs_no_other_file(tmp_path: Path) -> None:
    export(flange()[0], tmp_path / "a.blender.py", resolution=16)
    text = (tmp_path / "a.blender.py").read_text("ascii")
    compile(text, "a.blender.py", "exec")
    data = {}
    exec(text[: text.index("import bpy")], data)
    assert [entry["name"] for entry in data["PARTS"]] == ["for", "boss\\", "lambda", "3d", "#"]
    assert data["TREE"] == (
        "difference",
        [("union", ["for", "boss\\"]), "lambda", ("intersection", ["3d", "#"])],
    )
    assert data["METRES_PER_UNIT"] == 1e-3
    assert data["NAME"] == "Flansch ä"


def built(assembly: Assembly, folder: Path, **options: Any) -> dict[str, Any]:
    """What Blender says of the scene that the script makes."""
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is missing (Debian: blender)")
    export(assembly, folder / "a.blender.py", **options)
    (folder / "measure.py").write_text(_MEASURE)
    command = [blender, "-b", "--factory-startup", "--python-exit-code", "3", "-P", folder / "a.blender.py"]
    command += ["-P", folder / "measure.py", "--", folder / "report.json"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads((folder / "report.json").read_text())


def test_quadrics_come_as_the_convexes_that_they_bound(tmp_path: Path) -> None:
    planes = tuple(Part(Quadric.plane(n, 0.5)) for n in np.vstack([np.eye(3), -np.eye(3)]))
    cube = Assembly(planes, "intersection", "cube")
    drilled = Assembly((cube, Part(Quadric.cylinder(0.3), name="bore")), "difference", "drilled")
    report = built(drilled, tmp_path)
    assert report["collections"]["drilled parts"] == ["cube", "bore"]
    assert report["volumes"]["cube"] == pytest.approx(1.0)
    assert report["volumes"]["drilled surface"] == pytest.approx(1 - 0.09 * np.pi, rel=1e-3)
    assert "bore" in report["properties"]["bore"]


@pytest.mark.parametrize("unit", ["mm", None])
def test_blender_builds_the_solid(tmp_path: Path, unit: str | None) -> None:
    assembly, volume = flange(unit)
    report = built(assembly, tmp_path, resolution=48)
    assert report["collections"]["Flansch ä parts"] == [part.name for part in assembly.parts]
    assert report["volumes"]["Flansch ä surface"] == pytest.approx(volume, rel=0.01)
    assert report["volumes"]["boss\\"] == pytest.approx(np.pi / 2, rel=0.01)
    assert np.allclose(np.array(report["places"]["lambda"])[:3, 3], assembly["lambda"].translation)
    assert {"kind", "size", "taper", "blend"} <= set(report["properties"]["boss\\"])


def test_nothing_to_export_and_unknown_units_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoSurfaceError, match="nothing to export"):
        export(Assembly((Part(SuperFrustum((1, 1, 0))),)), tmp_path / "a.blender.py")
    with pytest.raises(SettingError, match="parsec"):
        export(lone(Sphere(1.0), unit="parsec"), tmp_path / "a.blender.py")
    assert not list(tmp_path.iterdir())
