"""The local server: the page, a socket, the input as triangles, exports, and files that are dropped in."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import tempfile
import urllib.parse
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from partwright.assembly import load_assembly
from partwright.atomic_io import report_path
from partwright.errors import OutputError, PartwrightError, UnsupportedFormatError
from partwright.export import export
from partwright.export.formats import FORMATS
from partwright.export.html import check_size, data_script, page
from partwright.export.part_meshes import part_meshes
from partwright.shapes import load_shape
from partwright.studio.journal import Journal, state_folder
from partwright.studio.messages import Failed, read, written
from partwright.studio.security import HEADERS, App, Guard
from partwright.studio.session import Session
from partwright.textures import Colours, load_colours

LOOPBACK = "127.0.0.1"
PORT = 8765
MOST_BYTES = 256 * 1024 * 1024
"""Of a file that is dropped into the page."""
_MOST_TEXT = 64 * 1024 * 1024  # of a message
_MOST_TRIANGLES = 400_000  # of the input that the page draws
_POLICY = "frame-ancestors 'none'"


def application(session: Session, token: str, hosts: frozenset[str]) -> App:
    """The ASGI application; without the token in its path, nothing answers."""

    async def index(request: Request) -> Response:
        data = data_script("studio", json.dumps({"socket": "socket"}))
        return HTMLResponse(page().replace("<!--DATA-->", data, 1))

    async def talk(websocket: WebSocket) -> None:
        await websocket.accept()
        outbox: asyncio.Queue[Any] = asyncio.Queue()
        sender = asyncio.create_task(_pump(websocket, outbox))
        session.join(outbox.put_nowait)
        try:
            while True:
                text = await websocket.receive_text()
                try:
                    session.heard(read(text), outbox.put_nowait)
                except PartwrightError as error:
                    outbox.put_nowait(Failed(str(error)))
        except WebSocketDisconnect:
            pass
        finally:
            session.leave(outbox.put_nowait)
            sender.cancel()

    async def triangles(request: Request) -> Response:
        """Three counts, V, F and C, then places (V, 3) float32 and triangles (F, 3) uint32, own units, and
        colours (C, 3) of the vertices as bytes, sRGB: C is V, or 0."""
        if session.shape is None:
            return Response(status_code=404)
        return Response(await asyncio.to_thread(_triangles, session), media_type="application/octet-stream")

    async def learned(request: Request) -> Response:
        """Meshes of the learned parts of the assembly as it is now, and its revision."""
        revision = session.journal.revision
        try:
            meshes = await asyncio.to_thread(lambda: part_meshes(session.assembly()))
        except PartwrightError as error:
            return _refused(error)
        return Response(
            f'{{"revision": {revision}, "meshes": {meshes or "{}"}}}', media_type="application/json"
        )

    async def exported(request: Request) -> Response:
        suffix = request.query_params.get("format", "")
        if suffix not in FORMATS:
            return _refused(UnsupportedFormatError(f"{suffix!r:.40} names no format"))
        try:
            name, data, changed, bare = await asyncio.to_thread(_exported, session, suffix)
        except PartwrightError as error:
            return _refused(error)
        quoted = urllib.parse.quote(name)
        headers = {
            "content-disposition": f"attachment; filename*=UTF-8''{quoted}",
            "x-approximated": str(changed),
            "x-without-maps": str(bare),
        }
        return Response(data, media_type="application/octet-stream", headers=headers)

    async def dropped(request: Request) -> Response:
        try:
            return JSONResponse(await _dropped(request, session))
        except PartwrightError as error:
            return _refused(error)
        except ClientDisconnect:
            return Response(status_code=400)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        yield
        session.stop()
        session.journal.close()

    routes = [
        Route("/", index),
        WebSocketRoute("/socket", talk),
        Route("/input", triangles),
        Route("/learned", learned),
        Route("/export", exported),
        Route("/drop", dropped, methods=["POST"]),
    ]
    return Guard(_with_headers(Starlette(routes=routes, lifespan=lifespan)), token, hosts)


def serve(
    file: Path | None,
    shape: Path | None = None,
    *,
    host: str = LOOPBACK,
    port: int | None = None,
    ready: Callable[[str], None] = lambda url: None,
) -> None:
    """Serve until Ctrl-C. `ready` is told the address, token and all, as soon as it answers.

    file: an assembly (.json), or a shape to fit. shape: the input beside an assembly; if not given, the one
    that the assembly names as its source, where it is near. port: `PORT`, or any that is free, if not given.

    Raises:
        UnreadableFileError, AssemblyFileError: a file cannot be read.
        OutputError: edits cannot be kept, or the port is taken.
    """
    session = opened(file, shape)
    token = session.journal.token()
    listening = _bound(host, port)
    bound = listening.getsockname()[1]
    named = {LOOPBACK, "localhost"} if host in (LOOPBACK, "localhost") else {host, LOOPBACK, "localhost"}
    if host in ("0.0.0.0", "::"):
        named |= {socket.gethostname(), *_addresses()}
    hosts = frozenset(f"{_bracketed(name)}:{bound}" for name in named)
    config = uvicorn.Config(
        application(session, token, hosts), log_level="warning", access_log=False, ws_max_size=_MOST_TEXT,
        server_header=False, timeout_graceful_shutdown=2, ws="websockets-sansio",
    )  # fmt: skip
    shown = LOOPBACK if host in ("0.0.0.0", "::") else host
    ready(f"http://{_bracketed(shown)}:{bound}/{token}/")
    uvicorn.Server(config).run(sockets=[listening])


def opened(file: Path | None, shape: Path | None = None, state: Path | None = None) -> Session:
    """A session with what the files hold; state: the folder of the journal, the user's own if not given."""
    assembly = None
    if file is not None and file.suffix.lower() == ".json":
        assembly = load_assembly(file)
        check_size(assembly)
        shape = shape or _source(file, str(assembly.metadata.get("source", "")))
    elif file is not None:
        shape, file = file, file.with_name(f"{file.stem}-assembly.json")
    target = file or Path("assembly.json")
    unit, up = (assembly.unit, assembly.up) if assembly else (None, None)
    loaded = load_shape(shape, unit=unit, up=up) if shape is not None else None
    if assembly is None and target.exists():
        assembly = load_assembly(target)
        check_size(assembly)
    text = target.read_text("utf-8") if assembly is not None else ""
    colours = _colours(shape) if shape is not None else None
    return Session(Journal(state or state_folder(), target, text), target, loaded, colours)


def _colours(shape: Path) -> Colours | None:
    try:
        return load_colours(shape)
    except PartwrightError:
        return None


def _source(file: Path, name: str) -> Path | None:
    """The shape that an assembly was made from: beside it, in the folder above, or in the working folder."""
    if not name or Path(name).name != name:
        return None
    for folder in (file.parent, file.absolute().parent.parent, Path.cwd()):
        if (folder / name).is_file():
            return folder / name
    return None


async def _pump(websocket: WebSocket, outbox: asyncio.Queue[Any]) -> None:
    while True:
        message = await outbox.get()
        await websocket.send_text(written(message))


def _triangles(session: Session) -> bytes:
    shape = session.shape
    assert shape is not None
    vertices, faces = shape.vertices, shape.faces
    if len(faces) > _MOST_TRIANGLES:
        import trimesh

        mesh = trimesh.Trimesh(vertices, faces, process=False)
        # By merging what falls into one cell: the picture needs no more.
        pitch = float(np.ptp(vertices, axis=0).max()) / 400
        cells = np.unique(np.round(mesh.vertices / pitch).astype(np.int64), axis=0, return_inverse=True)[
            1
        ].ravel()
        first = np.full(cells.max() + 1, -1)
        first[cells[::-1]] = np.arange(len(cells))[::-1]
        faces = first[cells][mesh.faces]
        faces = faces[
            (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
        ]
    colours = np.zeros((0, 3), np.uint8)
    if session.colours is not None:
        colours = np.round(session.colours.at(vertices)).astype(np.uint8)
    counts = np.array([len(vertices), len(faces), len(colours)], "<u4")
    arrays = (counts, vertices.astype("<f4"), faces.astype("<u4"), colours)
    return b"".join(array.tobytes() for array in arrays)


def _exported(session: Session, suffix: str) -> tuple[str, bytes, int, int]:
    """Name, content, how many parts had to be approximated, and how many lost their maps; what is beside the
    file is left out."""
    from partwright.export.export_report import approximated_parts

    stem = re.sub(r"[^\w.-]+", "_", session.file.stem).strip(".") or "assembly"
    with tempfile.TemporaryDirectory(prefix="partwright-") as folder:
        path = Path(folder) / f"{stem}{suffix}"
        assembly = session.assembly()
        export(assembly, path)
        changed = len(approximated_parts(path)) if report_path(path).exists() else 0
        return path.name, path.read_bytes(), changed, len(FORMATS[suffix].lost_maps(assembly))


async def _dropped(request: Request, session: Session) -> dict[str, str]:
    """An assembly takes the place of the present one, which undo brings back; a shape that of the input."""
    name = Path(request.query_params.get("name", "")).name
    suffix = Path(name).suffix.lower()
    if not re.fullmatch(r"\.[a-z0-9]{1,8}", suffix):
        raise UnsupportedFormatError(f"{name!r:.60} has no suffix that says what it is")
    with tempfile.TemporaryDirectory(prefix="partwright-") as folder:
        path = Path(folder) / f"{re.sub(r'[^A-Za-z0-9._-]+', '_', Path(name).stem)[:80] or 'shape'}{suffix}"
        size = 0
        with path.open("wb") as out:
            async for chunk in request.stream():
                size += len(chunk)
                if size > MOST_BYTES:
                    raise OutputError(
                        f"{name} is larger than {MOST_BYTES // 1024**2} MB; open it by its path instead"
                    )
                out.write(chunk)
        if suffix == ".json":
            assembly = await asyncio.to_thread(load_assembly, path)
            check_size(assembly)
            session.commit(f"Open {name}", assembly)
            return {"kind": "assembly"}
        shape = await asyncio.to_thread(load_shape, path)
        session.replace_shape(shape, await asyncio.to_thread(_colours, path))
        return {"kind": "shape"}


def _refused(error: PartwrightError) -> Response:
    return JSONResponse({"message": str(error)}, 422)


def _with_headers(app: App) -> App:
    async def wrapped(scope: Any, receive: Any, send: Any) -> None:
        async def sending(message: Any) -> None:
            if message["type"] == "http.response.start":
                own = {**HEADERS, "content-security-policy": _POLICY}
                message["headers"] = [
                    *message["headers"],
                    *((k.encode(), v.encode()) for k, v in own.items()),
                ]
            await send(message)

        await app(scope, receive, sending if scope["type"] == "http" else send)

    return wrapped


def _bound(host: str, port: int | None) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for tried in [port] if port is not None else [PORT, 0]:
        listening = socket.socket(family, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, tried))
            listening.listen(128)  # who is told the address before the server is up is not turned away
        except (OSError, OverflowError) as error:
            listening.close()
            if tried in (port, 0):
                raise OutputError(
                    f"cannot listen on {host}, port {tried}: {error}; choose another --port"
                ) from error
        else:
            return listening
    raise AssertionError("a port was tried, or an error raised")


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _addresses() -> set[str]:
    """This machine's own, as others may call it."""
    try:
        return {str(entry[4][0]) for entry in socket.getaddrinfo(socket.gethostname(), None)}
    except OSError:
        return set()
