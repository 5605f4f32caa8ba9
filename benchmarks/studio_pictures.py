"""Draws the pictures of docs/studio.md.

    python benchmarks/studio_pictures.py

The page in Debian's chromium, at 1,440 and 390 pixels, light and dark.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

import partwright as pw
from studio import ARGUMENTS

ROOT = Path(__file__).parents[1]
OUTPUT = ROOT / "docs" / "images" / "studio"
SHAPES = ROOT / "examples" / "shapes"


def settle(page: Any) -> None:
    while not page.evaluate("() => !!window.partwright && partwright.viewport.renderer.settled"):
        time.sleep(0.05)


def edit(page: Any) -> None:
    """The largest wheel, with the handles to move it."""
    page.locator(".row").nth(1).click()
    page.get_by_title("Move (W)").click()


def turn(page: Any) -> None:
    page.locator(".row").nth(1).click()
    page.get_by_role("tab", name="Numbers").click()
    page.get_by_title("Rotate (E)").click()


PICTURES = (
    ("edit", "truck.glb", "superfrusta", 1440, 900, "light", edit),
    ("dark", "truck.glb", "superfrusta", 1440, 900, "dark", edit),
    ("narrow", "bracket.stl", "solids", 390, 844, "light", turn),
    ("narrow_dark", "bracket.stl", "solids", 390, 844, "dark", turn),
)


def main() -> None:
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        for name, shape, method, width, height, theme, do in PICTURES:
            path = Path(folder) / f"{shape}.html"
            if not path.exists():
                pw.export(pw.fit(pw.load_shape(SHAPES / shape), method, quality="draft").assembly, path)
            page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
            page.goto(path.as_uri())
            settle(page)
            do(page)
            page.mouse.move(width / 2, 5)
            settle(page)
            page.screenshot(path=OUTPUT / f"{name}.png")
            with Image.open(OUTPUT / f"{name}.png") as picture:
                picture.convert("P", palette=Image.Palette.ADAPTIVE, colors=192).save(
                    OUTPUT / f"{name}.png", optimize=True
                )
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
