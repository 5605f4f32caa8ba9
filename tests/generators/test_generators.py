"""A picture in front of the fit: commands and services that make meshes, and all the ways they fail."""

from __future__ import annotations

import base64
import json
import re
import shlex
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image

import partwright as pw
from partwright.cli.main import main
from partwright.errors import (
    CancelledError,
    GeneratorError,
    SettingError,
    UnreadableFileError,
)
from partwright.fitting import FILES
from partwright.generators import GENERATED
from tests.cli.conftest import BoxMethod
from tests.generators import stand_in

STAND_IN = Path(stand_in.__file__)


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    path = tmp_path / "photo of a box.png"
    Image.new("RGB", (30, 20), (200, 30, 30)).save(path)
    return path


def command(way: str, place: str = "{output}") -> str:
    return f"{shlex.quote(sys.executable)} {shlex.quote(str(STAND_IN))} {shlex.quote(way)} {{input}} {place}"


@pytest.mark.parametrize(
    ("way", "place"),
    [
        ("writes", "{output}"),
        ("leaves", "{folder}"),
        ("names it itself", "{output}"),
        ("makes a folder of it", "{output}"),
        ("names it itself", "{folder}/out.glb"),
    ],
)
def test_a_command_makes_the_shape(photo: Path, tmp_path: Path, way: str, place: str) -> None:
    kept = tmp_path / "new" / "mesh.glb"
    shape = pw.shape_from_image(photo, command(way, place), keep=kept)
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([30, 20, 3])
    assert (shape.name, shape.file, shape.unit, shape.up) == (photo.stem, photo.name, "m", "y")
    assert kept.read_bytes() == stand_in.glb_of(photo.read_bytes())
    assert shape.repairs[0] == f"a generator made this shape of {photo.name}"


def test_fit_keeps_the_mesh_beside_the_result(method: BoxMethod, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["fit", str(photo), "--via", command("writes"), "--unit", "mm", "-o", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == sorted((*FILES, GENERATED))
    report = json.loads((out / "report.json").read_text())
    assert report["input"]["file"] == photo.name
    assert pw.load_assembly(out / "assembly.json").unit == "mm"
    assert pw.load_shape(out / GENERATED).volume == pytest.approx(30 * 20 * 3)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (command("page"), r"HTML page \(Sign in\); expected a GLB"),
        (command("text"), "text: out of credits"),
        (command("empty"), "answered with nothing"),
        (command("cut"), "of which 200 are there"),
        (command("old"), "version 1; expected version 2"),
        (command("fails"), "failed with exit code 1: CUDA out of memory"),
        (command("nothing"), r"wrote no GLB: nothing is where \{output\} or \{folder\} said: all is well"),
        (command("leaves an OBJ"), r"wrote no GLB: where it was to be are mesh\.obj"),
        (command("leaves two", "{folder}"), r"2 GLB files \(a.glb, b.glb\)"),
        ("/no/such/program {input} {output}", "cannot be started: No such file"),
        ("program {input}", "{output} for the GLB"),
        ("program '{input} {output}", "No closing quotation"),
        ("ftp://there/generate", "expected an address as"),
        ("http://user:word@there/generate", "without a password"),
        ("http://there:none/generate", "is no address"),
    ],
)
def test_what_goes_wrong_is_one_line_and_leaves_nothing(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, said: str
) -> None:
    assert main(["fit", str(photo), "--via", line, "-o", str(tmp_path / "out")]) == 2
    errors = [text for text in capsys.readouterr().err.splitlines() if "error" in text]
    assert len(errors) == 1
    assert re.search(said, errors[0])
    assert not (tmp_path / "out").exists()


def test_a_mesh_that_cannot_be_fitted_is_kept_and_named(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "out" / GENERATED
    assert main(["fit", str(photo), "--via", command("flat"), "-o", str(kept.parent)]) == 2
    assert f"made, kept as {kept}: photo of a box: " in capsys.readouterr().err
    assert kept.read_bytes() == stand_in.box_glb(3, 2, 0)
    assert list(kept.parent.iterdir()) == [kept]


def test_waiting_is_told(
    photo: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("partwright.cli.progress._PATIENT", 0.2)
    assert main(["fit", str(photo), "--via", command("sleeps"), "--via-timeout", "0.7"]) == 2
    assert capsys.readouterr().err.count("generating: ") > 1


def test_a_command_that_takes_too_long_is_ended_with_its_children(photo: Path) -> None:
    inner = command("sleeps").replace("{input} {output}", "a b")
    line = f"sh -c {shlex.quote(f'{inner} & wait')} {{input}} {{output}}"
    started = time.monotonic()
    with pytest.raises(GeneratorError, match=r"not done after 0\.5 s"):
        pw.shape_from_image(photo, line, time_limit=0.5)
    assert time.monotonic() - started < 10
    assert not [p for p in psutil.Process().children(recursive=True) if _runs_stand_in(p)]


def _runs_stand_in(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return str(STAND_IN) in process.cmdline() and process.status() != psutil.STATUS_ZOMBIE
    return False


def test_cancelling_ends_the_generator(photo: Path) -> None:
    cancel = pw.Cancellation()
    threading.Timer(0.3, cancel.request).start()
    started = time.monotonic()
    with pytest.raises(CancelledError):
        pw.shape_from_image(photo, command("sleeps"), cancel=cancel)
    assert time.monotonic() - started < 10


@pytest.mark.parametrize("content", [None, b"", b"\x89PNG\r\n\x1a\n cut", b"solid block"])
def test_what_is_no_picture_is_refused_before_the_generator_runs(
    tmp_path: Path, content: bytes | None
) -> None:
    path = tmp_path / "photo.png"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UnreadableFileError, match=r"photo\.png"):
        pw.shape_from_image(path, command("fails"))


def test_a_picture_alone_says_what_it_needs(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", str(photo)]) == 2
    assert "--via GENERATOR" in capsys.readouterr().err
    assert main(["fit", str(photo), "--via-timeout", "5"]) == 2
    assert "it needs --via" in capsys.readouterr().err
    with pytest.raises(SettingError, match="time limit"):
        pw.shape_from_image(photo, command("writes"), time_limit=0)


class Handler(BaseHTTPRequestHandler):
    """Answers after the request's path; `/generate` as Hunyuan3D's server does."""

    def do_POST(self) -> None:
        posted = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        picture = base64.b64decode(posted["image"])
        kind, status = "application/octet-stream", 200
        match self.path:
            case "/generate":
                body = stand_in.glb_of(picture)
            case "/page":
                kind, body = "text/html", b"<html><title>Welcome</title></html>"
            case "/refuses":
                kind, status, body = "application/json", 404, b'{"text": "NETWORK ERROR", "error_code": 1}'
            case "/json":
                kind, body = "application/json", b'{"uid": "7"}'
            case "/empty":
                body = b""
            case "/moved":
                self.send_response(302)
                self.send_header("Location", "/generate")
                self.end_headers()
                return
            case "/slow":
                time.sleep(3)
                return
            case "/cut":
                self.send_response(200)
                self.send_header("Content-Length", "5000")
                self.end_headers()
                self.wfile.write(b"glTF" + bytes(100))
                return
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def service() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


def test_a_service_makes_the_shape(service: str, photo: Path) -> None:
    assert pw.shape_from_image(photo, f"{service}/generate").volume == pytest.approx(30 * 20 * 3)


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("page", r"an HTML page \(Welcome\)"),
        ("refuses", r"answered 404 Not Found: .*NETWORK ERROR"),
        ("moved", "answered 302 Found: it sends to /generate"),
        ("json", r'JSON: \{"uid": "7"\}'),
        ("empty", "answered with nothing"),
        ("slow", r"not done after 0\.5 s"),
        ("cut", "broke off, 4896 bytes"),
    ],
)
def test_what_a_service_answers_wrongly_is_told(service: str, photo: Path, target: str, said: str) -> None:
    with pytest.raises(GeneratorError, match=said):
        pw.shape_from_image(photo, f"{service}/{target}", time_limit=0.5 if target == "slow" else 20)


def test_a_service_that_is_not_there(photo: Path) -> None:
    with pytest.raises(GeneratorError, match=r"127\.0\.0\.1:9 cannot be asked: Connection refused"):
        pw.shape_from_image(photo, "http://127.0.0.1:9/generate")
