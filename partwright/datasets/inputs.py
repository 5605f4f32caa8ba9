"""Shapes made of named parts, as they come: a family of our own, or a folder of yours.

A folder holds one shape an entry: a scene whose nodes are the parts (GLB, glTF, 3MF, COLLADA, STEP, OBJ with
groups), a folder of parts (meshes, or STEP files alone) with perhaps the whole as `_whole`, or a mesh with
`FILE.labels.json` beside it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from partwright.datasets.families.recipes import make_shape, recipe_of
from partwright.errors import EmptyShapeError, FamilyError, LabelError, NotFiniteError, UnreadableFileError
from partwright.shapes import MESH_SUFFIXES
from partwright.shapes.labels import labels_path, read_labels
from partwright.shapes.reading import read_source
from partwright.shapes.source import Piece, Source
from partwright.shapes.step_process import STEP_SUFFIXES

WHOLE = "_whole"
# Of programs that people model with. What is not listed may be anything: textures, notes.
_UNREAD = (
    ".3dm", ".3ds", ".abc", ".blend", ".brep", ".c4d", ".f3d", ".fbx", ".fcstd", ".iges", ".igs",
    ".ipt", ".ma", ".max", ".mb", ".skp", ".sldprt", ".usd", ".usda", ".usdc", ".usdz", ".wrl", ".x3d",
)  # fmt: skip
_NAMED = 5  # files, in a line


@dataclass(frozen=True)
class PartedShape:
    """Parts by name, and the pieces that make up the whole: one of its own, or all parts. Own units. up: the
    axis that its file says points up, if any. unread: what its files hold and could not be read, a sentence
    each."""

    name: str
    parts: Mapping[str, Piece]
    whole: tuple[Piece, ...]
    up: str | None = None
    unread: tuple[str, ...] = ()


class PartedSource(Protocol):
    """Where a parted shape comes from. It is small and can be sent to another process."""

    @property
    def name(self) -> str:
        """Of the shape, different from the other shapes' of the family."""

    def fingerprint(self) -> str:
        """Changes when the shape does."""

    def part_names(self) -> tuple[str, ...]:
        """The names of the parts, found as cheaply as can be. Raises as `read` does."""

    def read(self) -> PartedShape:
        """Read or make it.

        Raises UnreadableFileError and what `load_shape` raises, EmptyShapeError for a part without faces,
        NotFiniteError, LabelError.
        """


@dataclass(frozen=True)
class MadeShape:
    """Shape `number` of one of FAMILIES."""

    family: str
    seed: int
    number: int

    @property
    def name(self) -> str:
        return f"{self.family.removesuffix('s')}_{self.number:04d}"

    def fingerprint(self) -> str:
        shape = self.read()
        return _digest(*(array.tobytes() for p in shape.parts.values() for array in (p.vertices, p.faces)))

    def part_names(self) -> tuple[str, ...]:
        return recipe_of(self.family).parts

    def read(self) -> PartedShape:
        made = make_shape(self.family, recipe_of(self.family), self.seed, self.number)
        parts = {name: _piece(name, mesh.vertices, mesh.faces) for name, mesh in made.parts.items()}
        whole = _piece(self.name, made.whole.vertices, made.whole.faces)
        return PartedShape(self.name, parts, (whole,), "z")


@dataclass(frozen=True)
class SceneFile:
    """A file whose named nodes are the parts."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.stem

    def fingerprint(self) -> str:
        return _digest(_bytes(self.path))

    def part_names(self) -> tuple[str, ...]:
        return tuple(piece.name for piece in read_source(self.path).pieces)

    def read(self) -> PartedShape:
        source = read_source(self.path)
        parts = {piece.name: _checked(self.path, piece) for piece in source.pieces}
        return PartedShape(self.name, parts, tuple(parts.values()), source.up, source.repairs)


@dataclass(frozen=True)
class PartFolder:
    """A folder with a mesh a part, or a STEP file a part where there is none; `_whole` is the surface of all
    of them together, if it is there."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.name

    def fingerprint(self) -> str:
        return _digest(*(data for file in self._files() for data in (file.name.encode(), _bytes(file))))

    def part_names(self) -> tuple[str, ...]:
        return tuple(file.stem for file in self._files() if file.stem != WHOLE)

    def read(self) -> PartedShape:
        read = {file.stem: _joined(file) for file in self._files()}
        pieces = {name: piece for name, (piece, _) in read.items()}
        whole = pieces.pop(WHOLE, None)
        shown = tuple(pieces.values()) if whole is None else (whole,)
        ups = {source.up for _, source in read.values() if source.up is not None}  # formats may say nothing
        up = ups.pop() if len(ups) == 1 else None
        unread = tuple(f"{name}: {text}" for name, (_, source) in read.items() for text in source.repairs)
        return PartedShape(self.name, pieces, shown, up, unread)

    def _files(self) -> list[Path]:
        return _meshes(self.path)


@dataclass(frozen=True)
class LabelledMesh:
    """A mesh with a label for each face in `FILE.labels.json`, as `partwright segment` writes them."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.stem

    def fingerprint(self) -> str:
        return _digest(_bytes(self.path), _bytes(labels_path(self.path)))

    def part_names(self) -> tuple[str, ...]:
        return tuple(_named(label) for label in np.unique(read_labels(labels_path(self.path))))

    def read(self) -> PartedShape:
        whole, source = _joined(self.path)
        labels = read_labels(labels_path(self.path))
        if len(labels) != len(whole.faces):
            raise LabelError(
                f"{labels_path(self.path)}: {len(labels)} labels for the {len(whole.faces)} faces of "
                f"{self.path.name}; expected one a face, in the mesh's order. Segment it again"
            )
        parts = {
            _named(label): Piece(_named(label), whole.vertices, whole.faces[labels == label])
            for label in np.unique(labels)
        }
        return PartedShape(self.name, parts, (whole,), source.up, source.repairs)


def find_shapes(folder: str | Path) -> list[PartedSource]:
    """The shapes of a folder by name. Raises FamilyError where there are none, or two of one name."""
    folder = Path(folder)
    if not folder.is_dir():
        raise FamilyError(f"{folder}: no such folder; give a folder of shapes, or the name of a family")
    found = sorted(_sources(folder), key=lambda source: source.name)
    if not found:
        others = "; ".join(" ".join(told) for told in unread_files(folder, ()))
        raise FamilyError(
            f"{folder}: holds no shapes; expected scenes with named nodes, a folder of part meshes a shape, "
            f"or meshes with FILE.labels.json{'; ' if others else ''}{others}"
        )
    for first, second in pairwise(found):
        if first.name == second.name:
            raise FamilyError(f"{folder}: two shapes are called {first.name!r}; rename one of them")
    return found


def unread_files(folder: Path, names: Collection[str]) -> list[tuple[str, str]]:
    """Files of formats that nothing here reads, also in shapes' own folders, all in one line: which they are,
    and what to do; nothing where there are none. names: of shapes that are read; a file called so, or as a
    part beside it, is where that came from."""
    unread = [entry.name for entry in _unread(folder) if entry.stem not in names]
    for within in (entry for entry in folder.iterdir() if _is_shapes_folder(entry)):
        parts = {file.stem for file in _meshes(within)}
        unread += [f"{within.name}/{entry.name}" for entry in _unread(within) if entry.stem not in parts]
    unread.sort()
    if not unread:
        return []
    rest = f" and {len(unread) - _NAMED} more" if len(unread) > _NAMED else ""
    return [(", ".join(unread[:_NAMED]) + rest, "of a format that is not read; export as GLB or STEP")]


def _unread(folder: Path) -> Iterator[Path]:
    return (entry for entry in folder.iterdir() if entry.suffix.lower() in _UNREAD and not entry.is_dir())


def _is_shapes_folder(entry: Path) -> bool:
    return entry.is_dir() and not entry.name.startswith(".") and bool(_meshes(entry))


def _sources(folder: Path) -> Iterator[PartedSource]:
    for entry in folder.iterdir():
        if entry.name.startswith("."):
            continue
        if _is_shapes_folder(entry):
            yield PartFolder(entry)
        elif entry.suffix.lower() in (*MESH_SUFFIXES, *STEP_SUFFIXES):
            # A scene that `segment` wrote has labels too, but in another order: its nodes say the same.
            is_labelled = labels_path(entry).exists() and entry.suffix.lower() not in (".glb", ".gltf")
            yield LabelledMesh(entry) if is_labelled else SceneFile(entry)


def _meshes(folder: Path) -> list[Path]:
    """Files of parts; STEP files where there are no meshes, which may be made of the whole in one."""
    files = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    meshes = [path for path in files if path.suffix.lower() in MESH_SUFFIXES]
    return meshes or [path for path in files if path.suffix.lower() in STEP_SUFFIXES]


def _joined(path: Path) -> tuple[Piece, Source]:
    """A file as one piece, and as it was read."""
    source = read_source(path)
    if source.points is not None:  # a surface was laid through points
        raise EmptyShapeError(f"{path}: has points but no faces; export the part with its surface")
    pieces = source.pieces
    offsets = np.cumsum([0] + [len(p.vertices) for p in pieces])[:-1]
    vertices = np.concatenate([p.vertices for p in pieces])
    faces = np.concatenate([p.faces + o for p, o in zip(pieces, offsets, strict=True)])
    return _checked(path, Piece(path.stem, vertices, faces)), source


def _checked(path: Path, piece: Piece) -> Piece:
    """Raise EmptyShapeError or NotFiniteError, by the part's name."""
    if len(piece.faces) == 0:
        raise EmptyShapeError(f"{path}: part {piece.name!r} has no faces; export it again")
    if not np.isfinite(piece.vertices[piece.faces]).all():
        raise NotFiniteError(
            f"{path}: part {piece.name!r} has NaN or infinite coordinates; all must be finite. "
            "Export it again"
        )
    return piece


def _piece(name: str, vertices: Any, faces: Any) -> Piece:
    return Piece(name, np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64))


def _named(label: NDArray[Any]) -> str:
    """A part's name from its label: strings as they are, numbers with a word before them."""
    return str(label) if label.dtype.kind == "U" else f"part_{int(label)}"


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UnreadableFileError(f"{path}: cannot be read ({error.strerror}); check the path") from error


def _digest(*chunks: bytes) -> str:
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(chunk)
    return digest.hexdigest()
