"""Tries an installed Partwright as a stranger would: the commands, the fit, the page, the optional rest.

    python release/try_wheel.py

Run it with the Python of an environment that has the wheel and nothing of the sources; it works in a folder
of its own. cibuildwheel runs it on every wheel that it builds.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from importlib.metadata import files, version
from pathlib import Path


def run(*words: str) -> str:
    """What `partwright WORDS` prints; its error is this script's."""
    command = [sys.executable, "-m", "partwright", *words]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"partwright {' '.join(words)}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def tried() -> list[str]:
    """One line for each thing that works; anything that does not ends the script."""
    import trimesh

    import partwright

    here = Path(partwright.__file__).parent
    assert "site-packages" in here.parts, f"{here} is not an installed package"
    assert partwright.__version__ == version("partwright")
    lines = [f"partwright {partwright.__version__}, Python {sys.version.split()[0]}, {sys.platform}"]

    installed = {path.name for path in files("partwright") or ()}
    assert {"page.html", "py.typed", "cad_parts.safetensors", "LICENSE"} <= installed, installed
    assert not any(name.startswith("test_") for name in installed)

    trimesh.creation.annulus(0.4, 1.0, 0.5, sections=48).export("ring.stl")
    run("fit", "ring.stl", "-o", "ring", "--quality", "draft")
    report = json.loads(Path("ring/report.json").read_text())
    assert report["scores"]["iou"] > 0.95, report["scores"]
    lines.append(f"fit: {report['parts']} part, IoU {report['scores']['iou']:.3f}")
    run("evaluate", "ring/assembly.json", "ring.stl")
    for suffix in ("glb", "html", "mjcf", "urdf", "scad", "glsl", "3mf"):
        run("export", "ring/assembly.json", "-o", f"ring.{suffix}")
    page = Path("ring.html").read_text(encoding="utf-8")
    assert "<html" in page, page[:100]
    assert len(page) > 100_000, len(page)
    lines.append("exports: glb, html (the studio's page), mjcf, urdf, scad, glsl, 3mf")
    run("fit", "ring.stl", "-o", "tree", "--method", "capri", "--quality", "draft")
    lines.append("capri: fitted")
    Path("folder").mkdir()
    Path("ring.stl").rename("folder/ring.stl")
    run("batch", "folder", "-o", "out", "--quality", "draft")
    assert "1 of 1 done" in run("batch", "status", "out")
    lines.append("batch: one of one done by a worker process")
    return lines


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            print("\n".join(tried()))
        finally:
            os.chdir(Path(folder).parent)


if __name__ == "__main__":
    main()
