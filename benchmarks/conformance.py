"""Scenes as others' validators see them: GLB by Khronos' glTF validator, USD by usd-core's own.

    npm install --prefix build/node gltf-validator
    python benchmarks/conformance.py FITS ... --node build/node/node_modules

FITS holds NAME/assembly.json, as `partwright fit SHAPE -o FITS/NAME` writes it. Each is written as GLB and
USD in every way that has colliders or none; errors, warnings and hints are counted. The glTF validator knows
no KHR_implicit_shapes and KHR_physics_rigid_bodies, and says so as information; the extensions' own
schemas are tried in tests/export/test_physics.py. The table goes to benchmarks/results/conformance.md; exits
with 1 where there is an error or a warning.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import partwright as pw

TARGET = Path(__file__).parent / "results" / "conformance.md"
WAYS = (("glb", None), ("glb", "khr"), ("glb", "unreal"), ("glb", "godot"), ("usda", None), ("usda", "usd"))
SEVERITIES = ("errors", "warnings", "infos", "hints")  # in the glTF validator's order
VALIDATE = """
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
const report = require("gltf-validator").validateBytes(bytes, {maxIssues: 0});
report.then(told => console.log(JSON.stringify(told.issues)));
"""


def gltf_issues(path: Path, node: Path) -> tuple[Counter[str], set[str]]:
    """How many of each severity, and the codes of those that are more than hints."""
    done = subprocess.run(
        ["node", "-e", VALIDATE, path],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"NODE_PATH": str(node.resolve())},
    )
    issues = json.loads(done.stdout)
    found = Counter({name: issues[f"num{name.capitalize()}"] for name in SEVERITIES})
    return found, {f"{one['code']}" for one in issues["messages"] if one["severity"] < 3}


def usd_issues(path: Path) -> tuple[Counter[str], set[str]]:
    """All that usd-core's validators have to say are errors here."""
    from pxr import Usd, UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return Counter(errors=len(errors)), {error.GetName() for error in errors}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", type=Path, metavar="FITS")
    parser.add_argument("--node", type=Path, required=True, help="the folder that holds gltf-validator")
    options = parser.parse_args()
    fits = sorted(path for folder in options.folders for path in folder.glob("*/assembly.json"))
    lines = [
        "# Scenes, validated",
        "",
        f"`python benchmarks/conformance.py FITS`, {len(fits)} assemblies: "
        f"{', '.join(path.parent.name for path in fits)}. GLB by Khronos' glTF validator, USD by all "
        "validators of usd-core.",
        "",
        "| format | colliders | files | errors | warnings | infos | hints | what it says |",
        "|---|---|---:|---:|---:|---:|---:|---|",
    ]
    wrong = 0
    for suffix, physics in WAYS:
        total: Counter[str] = Counter()
        codes: set[str] = set()
        for fit in fits:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"scene.{suffix}"
                about = {"physics": physics} if physics else {}
                pw.export(pw.load_assembly(fit), path, **about)
                found, said = gltf_issues(path, options.node) if suffix == "glb" else usd_issues(path)
            total += found
            codes |= said
        wrong += total["errors"] + total["warnings"]
        counts = " | ".join(str(total[name]) for name in SEVERITIES)
        row = f"{suffix.upper()} | {physics or ''} | {len(fits)} | {counts} | {', '.join(sorted(codes))}"
        lines.append(f"| {row} |")
        print(lines[-1], flush=True)
    TARGET.write_text("\n".join(lines) + "\n")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
