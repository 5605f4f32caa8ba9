"""The page in a browser, and the server behind it."""

from __future__ import annotations

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.file_text import to_text
from partwright.cli.main import parser
from partwright.export import export
from partwright.fields import Sphere
from tests.browsers import PATIENCE

# Once at rest, a picture is drawn four times and smoothed: seconds of a processor, after every change.
UNSMOOTHED = """() => {
    Object.defineProperty(partwright.viewport.renderer, "passes", { get: () => 1 });
}"""

# As a page that has just been opened, but for its undo steps.
SHOW = """async (text) => {
    const { viewport } = partwright;
    viewport.forgetClick();
    viewport.setTool("select");
    viewport.clearMeasurements();
    Object.assign(viewport.camera, { azimuth: 32, elevation: 24 });
    document.activeElement.blur();
    for (const one of document.querySelectorAll(".toast, dialog")) one.remove();
    await partwright.openFile(new File([text], "shown.json"));
}"""


class Page:
    """A page of the studio, and the errors that it met."""

    def __init__(self, page: Any, smooth: bool) -> None:
        self.page = page
        self.smooth = smooth
        self.errors: list[str] = []
        self.requests: list[str] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def open(self, url: str) -> Page:
        self.page.goto(url)
        self.wait("() => !!window.partwright && (partwright.viewport.renderer?.ready ?? false)")
        if not self.smooth:
            self.ask(UNSMOOTHED)
        return self

    def ask(self, script: str, argument: Any = None) -> Any:
        return self.page.evaluate(script, argument)

    def wait(self, script: str, argument: Any = None) -> None:
        """Until the script gives true. The page allows no code from strings, so this asks from outside, less
        often as it takes longer: to ask costs three processes some milliseconds."""
        end, pause = time.monotonic() + PATIENCE, 0.02
        while not self.page.evaluate(script, argument):
            assert not self.errors, self.errors
            assert time.monotonic() < end, f"the page never said yes to {script}"
            time.sleep(pause)
            pause = min(1.3 * pause, 0.3)

    def settle(self) -> None:
        self.wait("() => partwright.viewport.renderer.settled")

    def middle(self, selector: str) -> tuple[float, float]:
        """Of an element, in pixels. One that is just drawn anew has no place: it is asked again."""
        end = time.monotonic() + PATIENCE
        element = self.page.locator(selector)
        box = element.bounding_box()
        while box is None:
            assert time.monotonic() < end, f"{selector} has no place in the page"
            box = element.bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def assembly(self) -> str:
        """The text of the file that the page would save."""
        return str(self.ask("() => partwright.text()"))


@pytest.fixture
def new_page(browser: Any) -> Iterator[Callable[..., Page]]:
    contexts = []

    def make(width: int = 900, height: int = 400, smooth: bool = False, **options: Any) -> Page:
        # A quarter as many pixels each way: a processor draws them here, and the page is as large.
        few = {"device_scale_factor": 0.25, **options}
        context = browser.new_context(viewport={"width": width, "height": height}, **few)
        contexts.append(context)
        return Page(context.new_page(), smooth)

    yield make
    for context in contexts:
        context.close()


@pytest.fixture
def shared(new_page: Callable[..., Page], tmp_path: Path) -> Callable[..., Page]:
    """Opens an assembly as a file that has everything in it."""

    def make(assembly: Assembly, **options: Any) -> Page:
        path = tmp_path / "shared.html"
        export(assembly, path)
        return new_page(**options).open(path.as_uri())

    return make


@pytest.fixture(scope="session")
def page_of_a_file(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    path = tmp_path_factory.mktemp("page") / "page.html"
    export(Assembly((Part(Sphere(1.0)),)), path)
    with browser.new_context(viewport={"width": 900, "height": 400}, device_scale_factor=0.25) as context:
        yield Page(context.new_page(), smooth=False).open(path.as_uri())


@pytest.fixture
def shown(page_of_a_file: Page) -> Callable[[Assembly], Page]:
    """Shows an assembly in a page that others had before: a new one compiles its shaders, for seconds."""

    def make(assembly: Assembly) -> Page:
        page_of_a_file.errors.clear()
        page_of_a_file.requests.clear()
        page_of_a_file.ask(SHOW, to_text(assembly))
        return page_of_a_file

    return make


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Server:
    """`partwright studio` in a thread of this process, which has all imports; it ends as by Ctrl-C."""

    running: ClassVar[dict[threading.Thread, Any]] = {}
    """uvicorn's server in each thread."""

    def __init__(self, *arguments: str) -> None:
        self.options = parser().parse_args(["studio", *arguments, f"--port={free_port()}"])
        self.start()

    def start(self) -> None:
        from partwright.studio.server import serve

        address: queue.Queue[str] = queue.Queue()
        files, told = (
            (self.options.file, self.options.shape),
            {"port": self.options.port, "ready": address.put},
        )
        self.thread = threading.Thread(target=serve, args=files, kwargs=told, daemon=True)
        self.thread.start()
        self.url = address.get(timeout=PATIENCE)

    def stop(self) -> None:
        self.running.pop(self.thread).should_exit = True
        self.thread.join(PATIENCE)
        assert not self.thread.is_alive()


@pytest.fixture
def serve(
    tmp_path: Path, browser: object, coarse_scores: None, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Server]]:
    import uvicorn

    run, servers = uvicorn.Server.run, []

    def known(server: uvicorn.Server, *arguments: Any, **options: Any) -> None:
        Server.running[threading.current_thread()] = server
        run(server, *arguments, **options)

    def make(*arguments: str) -> Server:
        servers.append(Server(*arguments))
        return servers[-1]

    monkeypatch.setattr(uvicorn.Server, "run", known)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    yield make
    for server in servers:
        server.stop()


class ServerProcess:
    """`partwright studio` as a process of its own, which can be killed."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        port = free_port()
        self.command = [
            sys.executable,
            "-m",
            "partwright",
            "studio",
            *arguments,
            f"--port={port}",
            "--no-browser",
        ]
        self.process = self.start()

    def start(self) -> subprocess.Popen[str]:
        environment = {**os.environ, "XDG_STATE_HOME": str(self.folder / "state")}
        self.process = subprocess.Popen(
            self.command, cwd=self.folder, env=environment, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.url = self.process.stdout.readline().split()[-1]
        return self.process

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def serve_apart(tmp_path: Path, browser: object) -> Iterator[Callable[..., ServerProcess]]:
    servers = []

    def make(*arguments: str) -> ServerProcess:
        servers.append(ServerProcess(tmp_path, *arguments))
        return servers[-1]

    yield make
    for server in servers:
        server.kill()
