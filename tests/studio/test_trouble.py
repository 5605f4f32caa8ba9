"""What goes wrong is said in the page, and no edit is lost by it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from tests.studio.conftest import Page, Server, ServerProcess

pytest.importorskip("uvicorn", reason="the studio's server needs uvicorn")

TABLE = Assembly(
    (Part(Box((60, 40, 10)), (0, 0, 20), name="top"), Part(Cylinder(8, 50), name="foot")), unit="mm", up="z"
)


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    mesh_assembly(TABLE, 48).export(tmp_path / "table.stl")
    TABLE.save(tmp_path / "table.json")
    return "table.json", "--shape=table.stl"


@pytest.fixture
def server(files: tuple[str, str], serve: Callable[..., Server]) -> Server:
    return serve(*files)


def opened(page: Page, server: Server | ServerProcess) -> Page:
    page.open(server.url)
    page.wait("() => live.state?.input === 'table.stl' && partwright.viewport.renderer.hasInput")
    return page


def move(page: Page, name: str, keys: str) -> None:
    page.page.locator(f".row[data-name={name}]").click()
    page.page.keyboard.press("g")
    page.page.keyboard.type(keys)
    page.page.keyboard.press("Enter")


def complaint(page: Page) -> str:
    toast = page.page.locator(".toast.error").last
    toast.wait_for()
    return str(toast.inner_text())


def test_a_fit_that_fails_and_files_that_are_broken(server: Server, new_page: Callable[..., Page]) -> None:
    page = opened(new_page(1000, 600), server)
    move(page, "foot", "z3")
    before = page.assembly()
    page.page.get_by_label("Method").select_option("capri")
    page.page.get_by_label("Every size, from few parts to many").check()
    page.page.get_by_role("button", name="Fit", exact=True).click()
    assert "capri gives no curve of sizes" in complaint(page)
    page.wait("() => !live.fit.running")
    drop = "([text, name]) => partwright.onDrop(new File([text], name))"
    for text, name, said in (
        ("solid nothing", "broken.stl", "broken.stl"),
        ('{"format": "partwright-assembly", "version": 1', "cut.json", "cut.json"),
        ("x", "program.exe", "not a format that is read"),
    ):
        page.ask(drop, [text, name])
        page.wait(
            "(n) => [...document.querySelectorAll('.toast.error')].some((t) => t.textContent.includes(n))",
            said,
        )
    assert page.assembly() == before
    assert page.ask("() => live.state.input") == "table.stl"
    # What is right works as before.
    page.ask(
        "([text, name]) => partwright.onDrop(new File([text], name))",
        [before.replace("foot", "leg"), "other.json"],
    )
    page.wait("() => partwright.store.undoLabel === 'Open other.json'")
    page.page.keyboard.press("Control+z")
    assert page.assembly() == before
    assert not page.errors


def test_with_the_server_gone_the_page_says_what_it_cannot_do(
    server: Server, new_page: Callable[..., Page]
) -> None:
    page = opened(new_page(1000, 600), server)
    server.stop()
    page.page.locator(".banner").wait_for()
    page.page.locator(".row[data-name=foot]").click()
    page.page.get_by_role("button", name="Refit selected").click()
    assert "The server is gone" in complaint(page)
    move(page, "foot", "x2")
    edited = from_text(page.assembly())
    # The tab is closed, and opened again once the server is there: the browser has kept the edit.
    page.page.goto("about:blank")
    server.start()
    page.open(server.url)
    page.wait(
        "() => live.link.revision > 0 && !live.link.waiting.length && partwright.store.program.parts.length"
    )
    assert from_text(page.assembly()) == edited
    assert page.ask("() => partwright.store.undoLabel") == "Edits of this page"


def test_two_tabs_see_each_other_and_neither_loses_an_edit(
    files: tuple[str, str], serve_apart: Callable[..., ServerProcess], new_page: Callable[..., Page]
) -> None:
    server = serve_apart(*files)
    one, two = (opened(new_page(900, 500), server) for _ in range(2))
    move(one, "foot", "x3")
    two.wait("(t) => partwright.text() === t", one.assembly())
    two.page.keyboard.press("Control+z")
    one.wait("(t) => partwright.text() === t", two.assembly())
    assert from_text(one.assembly()) == TABLE
    two.wait("() => !live.link.waiting.length")
    # Both at once: what the second has is on its way while the first changes something else.
    two.ask("() => void (live.link.sent = 1)")
    move(two, "top", "z4")
    move(one, "foot", "y5")
    two.wait("() => partwright.store.undoLabel === 'Edits of this page' && !live.link.waiting.length")
    last = two.assembly()
    assert from_text(last)["top"].translation == (0, 0, 24)
    one.wait("(t) => partwright.text() === t", last)
    # The first one's is a step of its own, below the second's.
    one.page.keyboard.press("Control+z")
    one.wait("(t) => partwright.text() !== t", last)
    first = one.assembly()
    two.wait("(t) => partwright.text() === t", first)
    assert from_text(first)["foot"].translation == (0, 5, 0)
    assert from_text(first)["top"] == TABLE["top"]
    assert not one.errors + two.errors


def test_without_webgl_2_the_server_still_fits_and_the_list_still_edits(
    server: Server, new_page: Callable[..., Page]
) -> None:
    page = new_page(1000, 600)
    page.page.add_init_script(
        """const real = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return kind === "webgl2" ? null : real.call(this, kind, ...rest);
        };"""
    )
    page.page.goto(server.url)
    page.wait("() => window.live?.state?.input === 'table.stl'")
    assert "offers no WebGL 2" in page.page.locator(".no-webgl").inner_text()
    page.page.locator(".row[data-name=foot]").click()
    radius = page.page.get_by_label("radius", exact=True).first
    radius.fill("5")
    radius.press("Enter")
    page.page.get_by_label("Quality").select_option("draft")
    page.page.get_by_role("button", name="Refit selected").click()
    page.wait("() => partwright.store.undoLabel === 'Refit foot' && !live.fit.running")
    assert from_text(page.assembly())["top"] == TABLE["top"]
    assert not page.errors


def test_an_edit_that_cannot_be_written_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("httpx", reason="starlette's test client needs httpx")
    from starlette.testclient import TestClient

    from partwright.assembly.file_text import to_text
    from partwright.errors import OutputError
    from partwright.studio.server import application, opened

    TABLE.save(tmp_path / "table.json")
    session = opened(tmp_path / "table.json", state=tmp_path / "state")
    token, host = "0" * 64, "127.0.0.1:8765"
    app: Any = application(session, token, frozenset({host}))
    edit = {"type": "commit", "base": 0, "label": "x", "text": to_text(TABLE.without("foot"))}
    with (
        TestClient(app, base_url=f"http://{host}") as client,
        client.websocket_connect(
            f"/{token}/socket", headers={"host": host, "origin": f"http://{host}"}
        ) as socket,
    ):
        socket.receive_json()
        with monkeypatch.context() as full:

            def fail(line: object) -> None:
                raise OutputError("the edit cannot be kept: no space left on device")

            full.setattr(session.journal, "_write", fail)
            socket.send_json(edit)
            answer = socket.receive_json()
            assert answer["type"] == "unkept"
            assert "no space left" in answer["message"]
            assert session.assembly() == TABLE
        socket.send_json(edit)
        assert socket.receive_json() == {"type": "accepted", "revision": 1}
