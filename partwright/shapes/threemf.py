"""3MF packages: objects of triangles, objects made of others, and what of them is built.

The XML is read as a stream, so that memory holds its numbers and not its text. Objects may be made of objects
without end: what that comes to is counted before anything of that size is made.
"""

from __future__ import annotations

import posixpath
import struct
import zipfile
import zlib
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from partwright.errors import EmptyShapeError, NotFiniteError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.extent import check_extent
from partwright.shapes.source import Piece, Source, in_utf8, unique_names
from partwright.shapes.units import canonical_unit

# A 3MF is a zip archive, and a small one can claim terabytes.
_LARGEST_UNPACKED = 1 << 29  # bytes
_SURELY_FINE = 1 << 26  # bytes
_TIGHTEST = 25  # times smaller; the XML of real meshes packs to a fifth or a tenth
_CHUNK = 1 << 20  # bytes of XML at once
_MODEL = "3dmodel"  # how the type of the relation to the first model ends
# What zipfile, expat, array and float raise on bytes that are not what the suffix says.
_ERRORS = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    OverflowError,
    RuntimeError,  # includes NotImplementedError
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
    expat.ExpatError,
)
_Key = tuple[str, str]  # the file within the package, and the object's id there


class _Use(NamedTuple):
    """An object in its place: matrix (4, 3), which a row of coordinates and a 1 is multiplied with."""

    key: _Key
    matrix: NDArray[np.float64]
    name: str = ""


@dataclass
class _Object:
    name: str
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    components: list[_Use] = field(default_factory=list)


def read_threemf(path: Path) -> Source:
    """Read a 3MF file: one piece for each place of each object that has triangles and is built.

    Raises UnreadableFileError for what is no such file, objects that contain themselves, and those that come
    to too much; EmptyShapeError where nothing is built.
    """
    check_shape_file(path)
    package = _Package()
    try:
        with zipfile.ZipFile(path) as archive:
            _refuse_bomb(path, archive)
            package.read(archive)
        pieces = tuple(unique_names(_pieces(package, path)))
    except _ERRORS as error:
        raise UnreadableFileError(
            f"{path}: cannot be read as 3MF ({type(error).__name__}: {error}); the file is truncated or not "
            "what its suffix says. Export it again"
        ) from error
    if not pieces:
        raise EmptyShapeError(f"{path}: builds no triangles; export the shape again with its mesh")
    return Source(in_utf8(path.stem), pieces, canonical_unit(package.unit))


def _refuse_bomb(path: Path, archive: zipfile.ZipFile) -> None:
    unpacked = sum(entry.file_size for entry in archive.infolist())
    most = min(_LARGEST_UNPACKED, max(_SURELY_FINE, _TIGHTEST * path.stat().st_size))
    if unpacked > most:
        raise UnreadableFileError(
            f"{path}: would unpack to {unpacked >> 20} MiB; at most {most >> 20} are accepted of a file of "
            "this size. Export it as GLB, STL or PLY"
        )


class _Package:
    """The objects of all models that the first one names, and what it builds."""

    def __init__(self) -> None:
        self.unit = "millimeter"
        self.objects: dict[_Key, _Object] = {}
        self.items: list[_Use] = []

    def read(self, archive: zipfile.ZipFile) -> None:
        entries = {name.lower(): name for name in archive.namelist()}
        first = _first_model(archive, entries)
        waiting, seen = [first], set()
        while waiting:
            name = waiting.pop()
            if name in seen:
                continue
            seen.add(name)
            if name not in entries:
                raise ValueError(f"it names the model {name!r:.80}, which it does not hold")
            model = _Model(name)
            with archive.open(entries[name]) as file:
                model.read(iter(lambda: file.read(_CHUNK), b""))
            self.objects |= model.objects
            if name == first:
                self.unit, self.items = model.unit, model.items
            uses = [*model.items, *(use for one in model.objects.values() for use in one.components)]
            waiting += {use.key[0] for use in uses} - seen


class _Model:
    """One XML file of a package."""

    def __init__(self, name: str) -> None:
        self.unit, self._file = "millimeter", name
        self.objects: dict[_Key, _Object] = {}
        self.items: list[_Use] = []
        self._object = _Object("")
        self._vertex, self._triangle = self._object.vertices.extend, self._object.triangles.extend

    def read(self, chunks: Iterator[bytes]) -> None:
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler = self._start
        parser.EntityDeclHandler = _refuse_entity
        for chunk in chunks:
            parser.Parse(chunk)
        parser.Parse(b"", True)

    def _start(self, tag: str, about: dict[str, str]) -> None:
        kind = tag[tag.find(" ") + 1 :]  # behind its namespace
        if kind == "triangle":
            self._triangle((int(about["v1"]), int(about["v2"]), int(about["v3"])))
        elif kind == "vertex":
            self._vertex((float(about["x"]), float(about["y"]), float(about["z"])))
        elif kind == "object":
            one = self.objects[self._file, about["id"]] = self._object = _Object(about.get("name", ""))
            self._vertex, self._triangle = one.vertices.extend, one.triangles.extend
        elif kind == "component":
            self._object.components.append(self._use(about))
        elif kind == "item":
            self.items.append(self._use(about))
        elif kind == "model":
            self.unit = about.get("unit", self.unit)

    def _use(self, about: dict[str, str]) -> _Use:
        path = next((value for key, value in about.items() if key.rpartition(" ")[2] == "path"), None)
        file = self._file if path is None else _entry(path)
        matrix = np.eye(4, 3)
        if "transform" in about:
            matrix = np.array([float(n) for n in about["transform"].split()]).reshape(4, 3)
        return _Use((file, about["objectid"]), matrix, about.get("partnumber", ""))


def _refuse_entity(*_: object) -> None:
    raise ValueError("it defines entities")


def _entry(path: str) -> str:
    """The name in the archive, lower case, of a part of the package."""
    return posixpath.normpath(path.lstrip("/")).lower()


def _first_model(archive: zipfile.ZipFile, entries: dict[str, str]) -> str:
    """The model that the package begins with, as it says, or where it usually is."""
    found: list[str] = []

    def start(_: str, about: dict[str, str]) -> None:
        if about.get("Type", "").endswith(_MODEL) and "Target" in about:
            found.append(_entry(about["Target"]))

    if "_rels/.rels" in entries:
        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EntityDeclHandler = start, _refuse_entity
        parser.Parse(archive.read(entries["_rels/.rels"]), True)
    found += [name for name in entries if "3d/3dmodel.model" in name]
    known = [name for name in found if name in entries]
    if not known:
        raise ValueError("it holds no model (3D/3dmodel.model)")
    return known[0]


def _pieces(package: _Package, path: Path) -> Iterator[Piece]:
    _refuse_many(package, path)
    for item in package.items:
        waiting = [(item.key, item.matrix, item.name)]
        while waiting:
            key, matrix, name = waiting.pop()
            one = package.objects[key]
            if one.triangles:
                yield _placed(one, matrix, name or one.name or key[1], path)
            for use in reversed(one.components):
                placed = use.matrix @ matrix[:3]
                placed[3] += matrix[3]
                waiting.append((use.key, placed, use.name))


def _refuse_many(package: _Package, path: Path) -> None:
    """Count what is built, and raise where that has no end or is too much."""
    total: dict[_Key, tuple[int, int]] = {}  # places and triangles below
    for key in [item.key for item in package.items]:
        open_keys: dict[_Key, None] = {}
        waiting = [key]
        while waiting:
            key = waiting[-1]
            if key in total:
                waiting.pop()
                continue
            if key not in package.objects:
                raise UnreadableFileError(f"{path}: names object {key[1]!r:.40}, which it does not hold")
            one = package.objects[key]
            below = [use.key for use in one.components]
            if key in open_keys:  # all below it are counted
                own = len(one.triangles) // 3
                places = (own > 0) + sum(total[k][0] for k in below)
                total[key] = places, own + sum(total[k][1] for k in below)
                del open_keys[key]
                waiting.pop()
                continue
            open_keys[key] = None
            if any(k in open_keys for k in below):
                raise UnreadableFileError(f"{path}: object {key[1]!r:.40} contains itself; export it again")
            waiting += [k for k in below if k not in total]
    places, triangles = (sum(total[item.key][i] for item in package.items) for i in (0, 1))
    check_extent(path, places, triangles)


def _placed(one: _Object, matrix: NDArray[np.float64], name: str, path: Path) -> Piece:
    vertices = np.frombuffer(one.vertices, np.float64).reshape(-1, 3)
    faces = np.frombuffer(one.triangles, np.int64).reshape(-1, 3)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise UnreadableFileError(
            f"{path}: a triangle of {name!r:.80} names vertex {int(faces.max())} of {len(vertices)}. Export "
            "the shape again"
        )
    if not np.isfinite(matrix).all():
        raise NotFiniteError(f"{path}: the transform of {name!r:.80} holds NaN or infinity; export it again")
    with np.errstate(all="ignore"):  # a NaN vertex that no face uses may pass through here
        placed = vertices @ matrix[:3] + matrix[3]
    mirrored = np.linalg.det(matrix[:3]) < 0
    return Piece(name, placed, np.ascontiguousarray(faces[:, ::-1]) if mirrored else faces.copy())
