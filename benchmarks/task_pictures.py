"""The pictures of the pages docs/task-*.md: their own commands are run, and what those draw is kept.

python benchmarks/task_pictures.py [NAME ...]
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images" / "tasks"
COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DRAWN = {  # page -> what its first commands draw
    "collision": "simple/hinge.urdf.png",
    "cad": "tree/preview.png",
    "blender": "truck/preview.png",
}


def main(names: list[str]) -> None:
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in names or list(DRAWN):
        page = (ROOT / "docs" / f"task-{name}.md").read_text()
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "examples", Path(folder) / "examples")
            for line in COMMANDS.findall(page)[0].splitlines():
                called = line.replace("partwright", f"{sys.executable} -m partwright", 1)
                subprocess.run(called, shell=True, cwd=folder, check=True)
            shutil.copy(Path(folder) / DRAWN[name], IMAGES / f"{name}.png")


if __name__ == "__main__":
    main(sys.argv[1:])
