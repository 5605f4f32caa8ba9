"""How soon the studio's page shows something, and how fast it draws, without a graphics card.

    python benchmarks/studio.py --output benchmarks/results/studio.md

Debian's chromium draws with the processor (SwiftShader). The parts, SuperFrusta that blend, fill the same
room whatever their number.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from fit import machine
from playwright.sync_api import sync_playwright

from partwright.assembly import Assembly, Part
from partwright.export import export
from partwright.fields import SuperFrustum

COUNTS = (8, 24, 64)
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WINDOW = {"width": 1068, "height": 556}  # of which the picture has 512 x 512
FRAME = """async (runs) => {
    const { store, viewport } = partwright, { renderer } = viewport;
    const frames = Array.from({ length: runs + 1 }, () => renderer.frameNow()).slice(1);
    const shown = [];
    for (let i = 0; i < runs; i++) {
        const began = performance.now();
        const picture = new Promise((resolve) => {
            const before = renderer.onPicture;
            renderer.onPicture = () => {
                before();
                renderer.onPicture = before;
                resolve();
            };
        });
        const [part] = store.program.parts;
        const moved = { ...part, translation: [part.translation[0] + 0.01, ...part.translation.slice(1)] };
        store.commit({ ...store.root, children: [moved, ...store.root.children.slice(1)] }, "Move");
        await picture;
        shown.push(performance.now() - began);
    }
    return { frames, shown, size: [renderer.canvas.width, renderer.canvas.height] };
}"""


def parts(count: int) -> Assembly:
    """Seeded; the longest side is about 2."""
    rng = np.random.default_rng(count)
    side = 0.9 * count ** (-1 / 3)
    return Assembly(
        tuple(
            Part(
                SuperFrustum(
                    tuple(side * rng.uniform(0.5, 1.5, 3)),
                    float(rng.random()),
                    0.02,
                    float(rng.uniform(0.5, 1.5)),
                    float(rng.choice([0.0, 0.5])),
                    float(rng.choice([0.0, 0.0, 0.6])),
                ),
                tuple(rng.uniform(-0.8, 0.8, 3)),
                tuple(rng.normal(size=4)),
                blend=0.1 * side,
            )
            for _ in range(count)
        )
    )


def measured(browser: Any, path: Path, runs: int) -> tuple[float, float, float]:
    """Seconds to the first picture; milliseconds of a whole frame, and from an edit to its picture."""
    page = browser.new_page(viewport=WINDOW)
    start = time.perf_counter()
    page.goto(path.as_uri())
    ready = "() => !!window.partwright && partwright.viewport.renderer.lastFrame.pixels > 0"
    while not page.evaluate(ready):
        time.sleep(0.01)
    first = time.perf_counter() - start
    found = page.evaluate(FRAME, runs)
    assert found["size"] == [512, 512]
    page.close()
    return first, median(found["frames"]), median(found["shown"])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", metavar="N", type=int, default=7, help="of each (default: %(default)s)")
    parser.add_argument("--output", type=Path, help="where the table goes (Markdown; default: printed)")
    arguments = parser.parse_args()
    lines = [
        "| parts | file, kB | first picture, s | frame of 512 x 512, ms | beside the first | "
        "edit to picture, ms |",
        "|---:|---:|---:|---:|---:|---:|",
    ]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        fewest = 0.0
        for count in COUNTS:
            path = Path(folder) / f"{count}.html"
            export(parts(count), path)
            first, frame, shown = measured(browser, path, arguments.runs)
            fewest = fewest or frame
            size = path.stat().st_size / 1000
            numbers = (
                f"{size:.0f}",
                f"{first:.1f}",
                f"{frame:.0f}",
                f"{frame / fewest:.1f} x",
                f"{shown:.0f}",
            )
            cells = (str(count), *numbers)
            lines.append(f"| {' | '.join(cells)} |")
            print(lines[-1], flush=True)
        browser.close()
    intro = (
        f"`python benchmarks/studio.py` on {machine()}, drawn by the processor (SwiftShader), "
        f"medians of {arguments.runs}. A whole frame is at full resolution; after an edit a coarser one is "
        "shown first. The first picture waits for the shader to be compiled; until then a mesh stands in."
    )
    text = "\n".join(["# The studio's page", "", intro, "", *lines]) + "\n"
    if arguments.output:
        arguments.output.write_text(text)


if __name__ == "__main__":
    main()
