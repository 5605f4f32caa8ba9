"""From the page: one part split, two merged, one for what is missing in a box, and a slider along a curve."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from tests.studio.conftest import Page, Server

pytest.importorskip("uvicorn", reason="the studio's server needs uvicorn")

TOP = Part(Box((80, 40, 10)), (0, 0, 40), name="top")
LEGS = [Part(Box((10, 40, 40)), (x, 0, 15), name=n) for x, n in ((-35, "left"), (35, "right"))]
KNOB = Part(Cylinder(8, 24), (20, 0, 57), name="knob")
TABLE = Assembly((TOP, *LEGS, KNOB), unit="mm", up="z")


@pytest.fixture
def table(tmp_path: Path, serve: Callable[..., Server], new_page: Callable[..., Page]) -> Any:
    """The page with an assembly beside the mesh of the table."""

    def make(assembly: Assembly) -> Page:
        mesh_assembly(TABLE, 64).export(tmp_path / "table.stl")
        assembly.save(tmp_path / "table.json")
        page = new_page(1200, 700).open(serve("table.json", "--shape=table.stl").url)
        page.wait("() => live.state?.input === 'table.stl' && partwright.viewport.renderer.hasInput")
        page.page.get_by_label("Quality").select_option("draft")
        return page

    return make


def iou(page: Page) -> float:
    revision = page.ask("() => live.link.revision")
    page.wait("(r) => document.querySelector('.fit-panel dl').dataset.revision === String(r)", revision)
    return float(page.page.locator(".fit-panel dd").first.inner_text())


def done(page: Page, label: str) -> Assembly:
    page.wait("(l) => partwright.store.undoLabel === l && !live.fit.running", label)
    return from_text(page.assembly())


def test_a_part_is_split_and_two_are_merged(table: Any) -> None:
    block = Part(Box((80, 40, 40)), (0, 0, 15), name="legs")
    start = Assembly((TOP, block, KNOB), unit="mm", up="z")
    page = table(start)
    split, merge = (page.page.get_by_role("button", name=n) for n in ("Split in two", "Merge into one"))
    assert split.is_disabled()
    assert merge.is_disabled()
    before = iou(page)
    page.page.locator(".row[data-name=legs]").click()
    split.click()
    two = done(page, "Split legs")
    assert {part.name for part in two.parts} == {"top", "legs", "legs_02", "knob"}
    assert two["top"] == TOP
    assert iou(page) > before + 0.2
    page.page.locator(".row[data-name=legs]").click()
    page.page.locator(".row[data-name=legs_02]").click(modifiers=["Control"])
    assert split.is_disabled()
    merge.click()
    one = done(page, "Merge 2 parts")
    assert {part.name for part in one.parts} == {"top", "legs", "knob"}
    page.page.keyboard.press("Control+z")
    page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == start
    assert not page.errors


def test_a_box_is_drawn_where_a_part_is_missing_and_gets_one(table: Any) -> None:
    start = TABLE.without("knob")
    page = table(start)
    before = iou(page)
    page.page.get_by_role("button", name="A part is missing").click()
    page.page.keyboard.press("1")  # from the front: x to the right, z up
    place = """(p) => {
        const { viewport, store } = partwright, box = viewport.element.getBoundingClientRect();
        const { eye, right, up, back, half } = viewport.view;
        const v = p.map((c, i) => c * store.frame.scale + store.frame.offset[i] - eye[i]);
        const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], depth = -dot(v, back);
        return [box.left + (dot(v, right) / depth / half[0] + 1) / 2 * box.width,
                box.top + (1 - dot(v, up) / depth / half[1]) / 2 * box.height];
    }"""
    # First where nothing is missing.
    for low, high in (((-30, 0, 30), (-10, 0, 38)), ((0, 0, 72), (40, 0, 44))):
        (x0, y0), (x1, y1) = page.ask(place, list(low)), page.ask(place, list(high))
        page.page.mouse.move(x0, y0)
        page.page.mouse.down()
        page.page.mouse.move((x0 + x1) / 2, (y0 + y1) / 2)
        page.page.mouse.move(x1, y1)
        page.page.mouse.up()
        if high[2] == 38:
            assert "Nothing is missing there" in page.page.locator(".status").inner_text()
    box = np.array(
        page.ask(
            """() => partwright.viewport.region.box.map((p) => p.map(
                (v, i) => (v - partwright.store.frame.offset[i]) / partwright.store.frame.scale))"""
        )
    )
    assert np.abs(box - [[11, -9, 45], [29, 9, 70]]).max() < 3
    # The upper face goes down by 8 mm, and the part ends there.
    x, y = page.middle("[data-face='z+']")
    (_, y0), (_, y1) = page.ask(place, [20, 0, 70]), page.ask(place, [20, 0, 62])
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x, y + (y1 - y0) / 2)
    page.page.mouse.move(x, y + y1 - y0)
    page.page.mouse.up()
    page.page.get_by_role("button", name="Fit a part in it").click()
    found = done(page, "Part in a box")
    new = found.parts[-1]
    assert [found[part.name] for part in start.parts] == list(start.parts)
    assert 58 < new.bounds()[1][2] < box[1, 2] - 5
    assert iou(page) > before + 0.01
    assert not page.errors


def test_the_slider_goes_from_few_parts_to_many(
    tmp_path: Path, serve: Callable[..., Server], new_page: Callable[..., Page]
) -> None:
    mesh_assembly(Assembly((TOP, KNOB)), 48).export(tmp_path / "table.stl")
    server = serve("table.stl")
    page = new_page(1200, 700).open(server.url)
    page.wait("() => live.state?.input === 'table.stl'")
    page.page.get_by_label("Quality").select_option("draft")
    page.page.get_by_label("Every size, from few parts to many").check()
    page.page.get_by_role("button", name="Fit", exact=True).click()
    best = done(page, "Fit")
    slider = page.page.get_by_label("From few parts to many", exact=True)
    assert len(best) > 1
    assert int(slider.get_attribute("max")) >= len(best) - 1
    slider.fill("0")
    fewest = done(page, f"1 of at most {int(slider.get_attribute('max')) + 1} parts")
    assert len(fewest) == 1
    assert page.page.locator(".curve output").inner_text().startswith("1 part, IoU 0.")
    page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == best
    assert int(slider.input_value()) == len(best) - 1
    server.stop()
    server.start()
    page.open(server.url)
    page.wait("() => live.link.revision > 0 && !!document.querySelector('.curve output')?.textContent")
    assert int(slider.input_value()) == len(best) - 1  # the server has it again
    assert not page.errors
