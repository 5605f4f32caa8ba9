"""The page and the server together, over real sockets: fits, refits, and a server that dies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part, load_assembly
from partwright.assembly.files import from_text
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from tests.studio.conftest import Page, Server, ServerProcess

pytest.importorskip("uvicorn", reason="the studio's server needs uvicorn")

TABLE = Assembly(
    (Part(Box((60, 40, 10)), (0, 0, 20), name="top"), Part(Cylinder(8, 50), name="foot")), unit="mm"
)


def test_refit_edits_and_a_server_that_is_killed(
    tmp_path: Path, serve_apart: Callable[..., ServerProcess], new_page: Callable[..., Page]
) -> None:
    mesh_assembly(TABLE, 48).export(tmp_path / "table.stl")
    wrong = TABLE.replace_part("foot", Part(Cylinder(5, 44), (4, 0, 0)))
    wrong.save(tmp_path / "table.json")
    server = serve_apart("table.json", "--shape=table.stl")
    page = new_page().open(server.url)
    page.wait("() => live.state?.input === 'table.stl'")

    def iou() -> float:
        revision = page.ask("() => live.link.revision")
        page.wait("(r) => document.querySelector('.fit-panel dl').dataset.revision === String(r)", revision)
        return float(page.page.locator(".fit-panel dd").first.inner_text())

    before = iou()
    page.page.locator(".row[data-name=foot]").click()
    page.page.get_by_label("Quality").select_option("draft")
    page.page.get_by_role("button", name="Refit selected").click()
    page.wait("() => partwright.store.undoLabel === 'Refit foot' && !live.fit.running")
    assert iou() > before + 0.02
    refitted = from_text(page.assembly())
    assert refitted["top"] == wrong["top"]

    # The server dies; an edit is made; it is started again, and the page finds it by itself.
    server.kill()
    page.wait("() => !document.querySelector('.banner').hidden")
    page.page.keyboard.press("g")
    page.page.keyboard.type("z-1.5")
    page.page.keyboard.press("Enter")
    edited = from_text(page.assembly())
    server.start()
    page.wait("() => document.querySelector('.banner').hidden && !live.link.waiting.length")
    page.page.reload()
    page.wait("() => !!window.live && live.link.revision > 0")
    assert from_text(page.assembly()) == edited
    page.page.keyboard.press("Control+z")
    page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == wrong
    page.page.keyboard.press("Control+y")
    page.page.keyboard.press("Control+s")
    page.page.locator(".toast", has_text="Saved").wait_for()
    assert load_assembly(tmp_path / "table.json") == refitted
    assert not page.errors


def test_a_fit_from_nothing_shows_its_rounds_and_stops_with_its_best(
    tmp_path: Path, serve: Callable[..., Server], new_page: Callable[..., Page]
) -> None:
    mesh_assembly(TABLE, 48).export(tmp_path / "table.stl")
    page = new_page().open(serve("table.stl").url)
    page.wait("() => live.state?.input === 'table.stl' && partwright.viewport.renderer.hasInput")
    page.page.get_by_role("button", name="Fit", exact=True).click()
    page.wait("() => partwright.store.program.parts.length > 0")
    assert page.ask("() => partwright.store.undoLabel") is None  # it is shown, and no step yet
    page.page.get_by_role("button", name="Stop, keep the best").click()
    page.wait("() => partwright.store.undoLabel === 'Fit'")
    assert len(from_text(page.assembly())) > 0
    assert page.page.locator(".fit-panel .hint").first.inner_text().startswith(("Stopped", "Done"))
    # The input was shown while there was nothing else; the parts took its place.
    assert page.ask("() => partwright.viewport.renderer.look.show") == "parts"
