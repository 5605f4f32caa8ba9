"""docs/extending.md: its code, installed as a package of its own, does what the page says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (my_package/\w+\.py)\n")


def python(code: str, folder: Path) -> str:
    """What the code prints, run beside the package, as one that is installed."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(folder / "site"), str(ROOT)))}
    run = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:my_package", "-c", code],
        cwd=folder, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page's package as an installer lays it out, and the examples."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "examples").symlink_to(ROOT / "examples")
    package, metadata = folder / "site" / "my_package", folder / "site" / "my_package-1.0.dist-info"
    package.mkdir(parents=True)
    metadata.mkdir()
    (package / "__init__.py").touch()
    for language, text in BLOCK.findall(PAGE):
        if language == "python" and (named := FILE.match(text)):
            (folder / "site" / named[1]).write_text(text)
    (declared,) = (text for language, text in BLOCK.findall(PAGE) if language == "toml")
    groups = tomllib.loads(declared)["project"]["entry-points"]
    lines = [
        line
        for group, points in groups.items()
        for line in (f"[{group}]", *(f"{name} = {place}" for name, place in points.items()))
    ]
    (metadata / "entry_points.txt").write_text("\n".join(lines))
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
    return folder


def test_the_page_runs_as_it_stands(installed: Path) -> None:
    (use,) = (t for language, t in BLOCK.findall(PAGE) if language == "python" and not FILE.match(t))
    said = python(use, installed).splitlines()
    outcome, parts, iou, error = said[0].split()
    assert outcome == "converged"
    assert 1 < int(parts) <= 6
    assert 0.2 < float(iou) < 1
    assert 0 < float(error) < 2
    assert said[1] == "Octahedron(radius=2.0)"
    assert (installed / "bracket.off").read_text().startswith("OFF")


def test_the_method_keeps_the_contract(installed: Path) -> None:
    code = """
import importlib
import trimesh
import partwright as pw
from partwright.errors import CancelledError, SettingError

importlib.import_module("partwright.metrics.iou").RESOLUTION = 64  # of scores, of which nothing is asked here
shape = pw.load_shape(trimesh.creation.cylinder(1.0, 2.0, sections=24))
assert len(pw.fit(shape, "slabs", max_parts=1).assembly) == 1
bytes_ = [pw.fit(shape, "slabs", seed=3).assembly.distance(shape.vertices).tobytes() for _ in range(2)]
assert bytes_[0] == bytes_[1]

cancel, seen = pw.Cancellation(), []
def progress(step):
    seen.append(step.assembly())
    if len(seen) == 3:
        cancel.request()
result = pw.fit(shape, "slabs", progress=progress, cancel=cancel)
assert result.outcome == "interrupted" and len(result.assembly) == len(seen[-1]) == 3

start = {"start": result.assembly}
for asked in ({"clean": True}, start, {"curve": True}, {"tolerance": "1%"}, {"sides": 3}):
    try:
        pw.fit(shape, "slabs", **asked)
    except SettingError as error:
        print(error)
    else:
        raise AssertionError(asked)
cancel = pw.Cancellation()
cancel.request()
try:
    pw.fit(shape, "slabs", cancel=cancel)
except CancelledError:
    print("nothing to keep")
"""
    said = python(code, installed).splitlines()
    assert "slabs makes parts that cannot be cleaned (clean); use method superfrusta or solids" in said[0]
    assert said[-1] == "nothing to keep"
    assert len(said) == 6


def test_the_field_is_a_solid_like_any_other(installed: Path) -> None:
    code = """
import math
import numpy as np
import torch
import partwright as pw
from my_package.octahedron import Octahedron

field = Octahedron(2.0)
whole = pw.Assembly([pw.Part(field, translation=(5, 0, 0), rotation=(0.8, 0.6, 0, 0))]).scaled(3.0)
mesh = pw.meshing.mesh_assembly(whole)
assert mesh.is_watertight and math.isclose(mesh.volume, 4 / 3 * 6.0**3, rel_tol=0.01)
points = np.random.default_rng(0).normal(size=(500, 3), scale=3)
values = field(points)
assert values.dtype == np.float32
assert np.allclose(values, field(torch.from_numpy(points)).numpy(), atol=1e-5)
assert (np.abs(np.diff(values)) <= np.linalg.norm(np.diff(points, axis=0), axis=1) + 1e-5).all()
whole.save("octahedron.json")
again = pw.load_assembly("octahedron.json")
assert (again.distance(points) == whole.distance(points)).all()
for name in ("whole.glb", "whole.stl"):
    pw.export(again, name)
scores = pw.evaluate(again, pw.load_shape("whole.stl"), emd=False)
assert scores.iou > 0.98 and scores.overlap == 0
"""
    python(code, installed)


def test_without_the_package_its_names_are_unknown(tmp_path: Path) -> None:
    code = """
import partwright as pw
from partwright.errors import SettingError, UnsupportedFormatError
from partwright.fields import KINDS
from partwright.metrics import METRICS
assert "octahedron" not in KINDS and "volume_error" not in METRICS
try:
    pw.export(pw.Assembly([pw.Part(pw.fields.Sphere(1.0))]), "ball.off")
except UnsupportedFormatError as error:
    print(error)
"""
    assert "names no format" in python(code, tmp_path)
