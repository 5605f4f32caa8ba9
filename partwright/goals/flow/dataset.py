"""A data set of simulated bodies: one file each, made one after the other, and gone on with where it stopped.

A file holds the body, also as the simulation meshed it, the pressure on that, and the drag area. Its name is
made of the body's content, the air and this format's version: what was simulated before is not simulated
again, and what was simulated otherwise is not mixed in.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import trimesh

from partwright.atomic_io import replacing
from partwright.errors import SettingError, SimulationError, SimulationLimitError, UnreadableFileError
from partwright.goals.flow.air import Air
from partwright.goals.flow.programs import drop_log, keep_log
from partwright.goals.flow.simulation import PRESSURE, simulate
from partwright.goals.flow.skin import Skin

VERSION = 2
_ARRAYS = ("vertices", "faces", "pressure", "body_vertices", "body_faces")


@dataclass(frozen=True)
class Sample:
    """A simulated body, in metres. drag_area, swing: m2. skin: as the simulation meshed it, with the pressure
    coefficient of each face. vertices (V, 3), faces (F, 3): as it was given."""

    name: str
    drag_area: float
    swing: float
    air: Air
    skin: Skin
    vertices: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True)
class Done:
    """One body of the queue: its drag area (m2), or the reason why it has none. made: just now."""

    number: int
    of: int
    name: str
    path: Path
    drag_area: float | None
    reason: str
    made: bool


def simulate_all(
    bodies: Iterable[tuple[str, trimesh.Trimesh]],
    output: Path,
    air: Air,
    told: Callable[[Done], None] | None = None,
    count: int = 0,
) -> list[Done]:
    """Simulate named bodies (in metres) into files of a folder, which may hold some of them already.

    A body that fails is written down with its reason (NAME.failed.json, NAME.failed.log) and not tried again
    while that file is there; one that ran out of time or disk is. told: after each. count: of the bodies,
    where known.

    Raises:
        MissingDependencyError: OpenFOAM is not installed.
        SettingError: parts are to turn, and these bodies have none.
    """
    if air.turning:
        raise SettingError("turning: these bodies are simulated as one; parts turn in partwright optimise")
    output.mkdir(parents=True, exist_ok=True)
    done = []
    for number, (name, body) in enumerate(bodies, 1):
        path = output / f"{key(body, air)}.npz"
        failed = path.with_suffix(".failed.json")
        area, reason, made = None, "", False
        if path.exists():
            area = read(path).drag_area
        elif failed.exists():
            reason = str(json.loads(failed.read_text(encoding="utf-8")).get("reason", ""))
        else:
            made = True
            try:
                area = _simulated(name, body, path, air)
            except SimulationLimitError as error:
                reason = str(error)
            except SimulationError as error:
                reason = str(error)
                with replacing(failed) as staging:
                    staging.write_text(json.dumps({"name": name, "reason": reason}) + "\n", encoding="utf-8")
        done.append(Done(number, count, name, path, area, reason, made))
        if told is not None:
            told(done[-1])
    return done


def key(body: trimesh.Trimesh, air: Air) -> str:
    """Of a body's content, the air around it, and the version of the format."""
    about = {**asdict(air), "time_limit": None, "version": VERSION}
    del about["turning"]  # "" for bodies without parts
    digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    digest.update(np.ascontiguousarray(body.vertices, np.float64).tobytes())
    digest.update(np.ascontiguousarray(body.faces, np.int64).tobytes())
    return digest.hexdigest()[:16]


def _simulated(name: str, body: trimesh.Trimesh, path: Path, air: Air) -> float:
    drop_log(path.with_suffix(".failed.log"))
    with tempfile.TemporaryDirectory(prefix="partwright-") as folder:
        try:
            found = simulate(body, Path(folder, "case"), air)
        except SimulationError as error:
            raise keep_log(error, path.with_suffix(".failed.log")) from error
    about = {
        "version": VERSION,
        "name": name,
        "drag_area": found.drag_area,
        "swing": found.swing,
        "air": air.to_dict(),
    }
    with replacing(path) as staging, staging.open("wb") as file:
        np.savez_compressed(
            file,
            about=np.frombuffer(json.dumps(about).encode(), np.uint8),
            vertices=found.skin.vertices.astype(np.float32),
            faces=found.skin.faces.astype(np.int32),
            pressure=found.skin.fields[PRESSURE].astype(np.float32),
            body_vertices=np.asarray(body.vertices, np.float32),
            body_faces=np.asarray(body.faces, np.int32),
        )
    return found.drag_area


def read(path: Path) -> Sample:
    """Of one file.

    Raises:
        UnreadableFileError: it is none, or of another version.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            about = json.loads(data["about"].tobytes())
            vertices, faces, pressure, body, body_faces = (data[name] for name in _ARRAYS)
        if about["version"] != VERSION:
            raise ValueError(f"its version is {about['version']}, expected {VERSION}")
        for points, triangles in ((vertices, faces), (body, body_faces)):
            if triangles.ndim != 2 or triangles.max() >= len(points) or triangles.min() < 0:
                raise ValueError("its faces do not fit its vertices")
        if len(faces) != len(pressure):
            raise ValueError("its pressures do not fit its faces")
        if not all(np.isfinite(one).all() for one in (vertices, pressure, body)):
            raise ValueError("it holds numbers that are not finite")
        fields = {PRESSURE: pressure.astype(np.float64)}
        return Sample(
            str(about["name"]),
            float(about["drag_area"]),
            float(about["swing"]),
            Air(**about["air"]),
            Skin(vertices.astype(np.float64), faces.astype(np.int64), fields),
            body.astype(np.float64),
            body_faces.astype(np.int64),
        )
    except (OSError, ValueError, KeyError, TypeError, IndexError, BadZipFile) as error:
        raise UnreadableFileError(f"{path}: expected a simulated body: {error}") from error


def read_all(folder: Path) -> Iterator[Sample]:
    """Of all files of a folder, by name.

    Raises:
        UnreadableFileError: there is none, one cannot be read, or they are of different airs.
    """
    paths = sorted(folder.glob("*.npz"))
    if not paths:
        raise UnreadableFileError(
            f"{folder}: expected files of simulated bodies (parts simulate); there is none"
        )
    first = None
    for path in paths:
        sample = read(path)
        first = first or sample.air
        if asdict(sample.air) | {"time_limit": 0} != asdict(first) | {"time_limit": 0}:
            raise UnreadableFileError(
                f"{path}: simulated in another air than the files before it: keep them apart"
            )
        yield sample
