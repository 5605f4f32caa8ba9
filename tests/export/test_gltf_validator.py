"""GLB as the Khronos validator sees it; npm install -g gltf-validator."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.export import export
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum

_VALIDATE = """
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
require("gltf-validator").validateBytes(bytes).then(report => console.log(JSON.stringify(report)));
"""


def validated(path: Path) -> dict[str, Any]:
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("node and npm are missing (Debian: npm)")
    folder = subprocess.run([npm, "root", "-g"], capture_output=True, text=True, check=True).stdout.strip()
    if not (Path(folder) / "gltf-validator").exists():
        pytest.skip("gltf-validator is missing: npm install -g gltf-validator")
    done = subprocess.run(
        ["node", "-e", _VALIDATE, path],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"NODE_PATH": folder},
    )
    return json.loads(done.stdout)["issues"]


@pytest.mark.parametrize("unit", ["mm", None])
def test_the_validator_finds_nothing(tmp_path: Path, unit: str | None) -> None:
    holed = Part(Box((2, 2, 2)), name="block") - Part(Sphere(0.5), name="a hole")
    bent = Part(SuperFrustum((0.3, 0.3, 2), 1.0, 0.05, 0.8, 0.6), (0, 3, 0), blend=0.1, name="bent / ü")
    leg = Part(Cylinder(0.2, 1.0), (3, 0, 0), name="leg", instances=(Similarity(translation=(1, 0, 0)),))
    sheet = Part(SuperFrustum((1, 1, 1), onion=1.0), name="no volume")
    export(Assembly((holed, bent, leg, sheet), unit=unit, up="z"), tmp_path / "a.glb", resolution=16)
    issues = validated(tmp_path / "a.glb")
    assert [message["message"] for message in issues["messages"]] == []
