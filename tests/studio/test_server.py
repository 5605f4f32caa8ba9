"""The server by itself: who it answers, and what it takes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, load_assembly
from partwright.assembly.file_text import to_text
from partwright.fields import Box, Cylinder, Sphere
from partwright.textures import PartMap

pytest.importorskip("starlette", reason="the studio's server needs starlette")
pytest.importorskip("httpx", reason="starlette's test client needs httpx")

from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from partwright.studio import server
from partwright.studio.server import application, opened

TOKEN = "0123456789abcdef" * 4
HOST = "127.0.0.1:8765"
ORIGIN = {"origin": f"http://{HOST}"}
STOOL = Assembly(
    (Part(Box((60, 40, 30)), name="seat"), Part(Cylinder(5, 40), (20, 0, -30), name="leg")), unit="mm"
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    STOOL.save(tmp_path / "stool.json")
    return tmp_path / "stool.json"


@pytest.fixture
def client(file: Path) -> Iterator[TestClient]:
    session = opened(file, state=file.parent / "state")
    app: Any = application(session, TOKEN, frozenset({HOST}))
    with TestClient(app, base_url=f"http://{HOST}") as client:
        yield client


def talking(client: TestClient, **headers: str) -> Any:
    return client.websocket_connect(f"/{TOKEN}/socket", headers={"host": HOST, **ORIGIN, **headers})


ROUTES = ["/", "/input", "/export?format=.stl", "/nothing"]


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("token", ["", "0" * 64, TOKEN[:-1], TOKEN + "0", "..", "%00"])
def test_without_the_token_nothing_is_told(client: TestClient, route: str, token: str) -> None:
    answer = client.get(f"/{token}{route}")
    assert (answer.status_code, answer.text) == (404, "not found\n")


def test_other_hosts_and_origins_are_refused(client: TestClient) -> None:
    page = f"/{TOKEN}/"
    assert client.get(page).status_code == 200
    assert client.get(page, headers=ORIGIN).status_code == 200
    for headers in (
        {"host": "evil.example:8765"},
        {"host": "127.0.0.1"},
        {"host": ""},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": f"https://{HOST}"},
    ):
        assert client.get(page, headers=headers).status_code == 404
    assert client.post(f"/{TOKEN}/drop?name=a.json", content=b"{}").status_code == 404  # it names no origin


@pytest.mark.parametrize(
    "headers", [{"origin": "http://evil.example"}, {"origin": ""}, {"host": "evil.example"}]
)
def test_a_socket_of_others_is_refused(client: TestClient, headers: dict[str, str]) -> None:
    with pytest.raises(WebSocketDisconnect), talking(client, **headers) as socket:
        socket.receive_json()


def test_answers_are_neither_kept_nor_framed(client: TestClient) -> None:
    headers = client.get(f"/{TOKEN}/").headers
    assert headers["cache-control"] == "no-store"
    assert headers["referrer-policy"] == "no-referrer"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert "access-control-allow-origin" not in headers


def test_edits_are_kept_undone_and_saved(client: TestClient, file: Path) -> None:
    lower = STOOL.without("leg")
    with talking(client) as socket:
        state = socket.receive_json()
        assert (state["type"], state["revision"], state["text"]) == ("state", 0, to_text(STOOL))
        socket.send_json({"type": "commit", "base": 0, "label": "Delete leg", "text": to_text(lower)})
        assert socket.receive_json() == {"type": "accepted", "revision": 1}
        assert load_assembly(file) == STOOL
        socket.send_json({"type": "save"})
        assert socket.receive_json()["type"] == "saved"
        assert load_assembly(file) == lower
        socket.send_json({"type": "undo", "base": 1})
        assert socket.receive_json()["revision"] == 2
    again = opened(file, state=file.parent / "state")
    assert again.assembly() == STOOL
    assert [step.label for step in again.journal.future] == ["Delete leg"]


def test_two_pages_hear_of_each_other_and_neither_loses_an_edit(client: TestClient) -> None:
    first, second = (to_text(STOOL.renamed("leg", name)) for name in ("one", "two"))
    with talking(client) as a, talking(client) as b:
        a.receive_json(), b.receive_json()
        a.send_json({"type": "commit", "base": 0, "label": "first", "text": first})
        assert a.receive_json()["type"] == "accepted"
        assert b.receive_json()["text"] == first
        b.send_json({"type": "commit", "base": 0, "label": "second", "text": second})
        refused = b.receive_json()
        assert (refused["type"], refused["text"], refused["revision"]) == ("state", first, 1)
        assert "Another page" in refused["note"]
        b.send_json({"type": "commit", "base": 1, "label": "second", "text": second})
        assert b.receive_json()["revision"] == 2
        state = a.receive_json()
        assert state["text"] == second
        assert [step["text"] for step in state["past"]] == [to_text(STOOL), first]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        '{"type": "commit", "base": 0, "label": "x", "text": "no assembly"}',
        '{"type": "run", "code": "1"}',
    ],
)
def test_what_is_no_message_changes_nothing(client: TestClient, text: str) -> None:
    with talking(client) as socket:
        socket.receive_json()
        socket.send_text(text)
        assert socket.receive_json()["type"] == "failed"
    with talking(client) as socket:
        assert socket.receive_json()["revision"] == 0


def test_a_fit_without_a_shape_says_what_to_do(client: TestClient) -> None:
    with talking(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "fit", "mode": "new", "names": [], "method": "solids", "quality": "draft"})
        assert "drop one into the page" in socket.receive_json()["message"]


def test_every_format_comes_by_its_name_and_no_path_does(client: TestClient) -> None:
    answer = client.get(f"/{TOKEN}/export", params={"format": ".stl"})
    assert answer.status_code == 200
    assert "stool.stl" in answer.headers["content-disposition"]
    for given in ("../../etc/passwd", "", "stl", ".nothing"):
        assert client.get(f"/{TOKEN}/export", params={"format": given}).status_code == 422


def test_an_export_says_of_how_many_parts_it_leaves_the_maps_out(tmp_path: Path) -> None:
    image = {"texture": PartMap(np.full((4, 4, 3), 200, np.uint8)).text()}
    STOOL.replace_part("leg", replace(STOOL["leg"], metadata=image)).save(tmp_path / "stool.json")
    app: Any = application(
        opened(tmp_path / "stool.json", state=tmp_path / "state"), TOKEN, frozenset({HOST})
    )
    with TestClient(app, base_url=f"http://{HOST}") as client:
        for suffix, bare in ((".scad", "1"), (".glb", "0")):
            answer = client.get(f"/{TOKEN}/export", params={"format": suffix})
            assert answer.headers["x-without-maps"] == bare


def test_files_that_are_dropped_are_read_limited_and_put_nowhere(
    client: TestClient, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def drop(name: str, content: bytes) -> Any:
        return client.post(f"/{TOKEN}/drop", params={"name": name}, content=content, headers=ORIGIN)

    before = sorted(path.name for path in file.parent.iterdir())
    ball = Assembly((Part(Sphere(5), name="ball"),))
    assert drop("../../ball.json", to_text(ball).encode()).status_code == 200
    with talking(client) as socket:
        state = socket.receive_json()
    assert state["text"] == to_text(ball)
    assert state["past"][0]["label"] == "Open ball.json"
    assert drop("broken.stl", b"solid nothing").status_code == 422
    assert drop("program", b"x").status_code == 422
    monkeypatch.setattr(server, "MOST_BYTES", 10)
    assert "larger than" in drop("large.stl", b"x" * 11).json()["message"]
    assert sorted(path.name for path in file.parent.iterdir()) == before
