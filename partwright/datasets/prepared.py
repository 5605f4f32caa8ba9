"""Prepared families on disk: what PartSDF trains on and is measured against.

A folder holds `family.json` and `shapes/NAME.safetensors`, one a shape. The manifest is written last, so a
folder that has one is complete.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.atomic_io import write_bytes
from partwright.datasets.poses import Poses
from partwright.errors import (
    FamilyError,
    NewerVersionError,
    OutputError,
    SettingError,
    UnreadableFileError,
)
from partwright.input_files import check_file
from partwright.shapes import UnitFrame
from partwright.shapes.units import canonical_up

FORMAT, VERSION = "partwright-family", 1
MANIFEST, SHAPES = "family.json", "shapes"
SPLITS = ("train", "validation", "test")
UP = "z"  # where nothing is said
_ABOUT = "partwright"
MOST_PARTS = 127  # the label of a sample is a signed byte

# Tensor -> its type and its axes: N samples, P parts, V vertices and F faces, or a number.
_TENSORS: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "points": ("f4", ("N", 3)),
    "sdf": ("f4", ("N",)),
    "part": ("i1", ("N",)),
    "translation": ("f4", ("P", 3)),
    "rotation": ("f4", ("P", 4)),
    "scale": ("f4", ("P", 3)),
    "present": ("u1", ("P",)),
    "vertices": ("f4", ("V", 3)),
    "faces": ("i4", ("F", 3)),
    "label": ("i1", ("F",)),
}


@dataclass(frozen=True)
class PreparedShape:
    """One shape of a family: N samples, P parts, V vertices, F faces; everything in the unit frame."""

    name: str
    """Of the shape, different from all others of the family."""
    points: NDArray[np.float32]
    """(N, 3) samples."""
    sdf: NDArray[np.float32]
    """(N,) signed distance of the whole shape, negative inside."""
    part: NDArray[np.int8]
    """(N,) the number of the part nearest to each sample (PartSDF, eq. 5)."""
    poses: Poses
    """Of the P parts; a missing part has the family's average."""
    present: NDArray[np.uint8]
    """(P,) 1 where the shape has the part."""
    vertices: NDArray[np.float32]
    """(V, 3) of the whole surface; empty in a family that is only trained on."""
    faces: NDArray[np.int32]
    """(F, 3) triangles of the whole surface."""
    label: NDArray[np.int8]
    """(F,) the number of each triangle's part."""
    frame: UnitFrame
    """From own units to the unit frame."""

    @property
    def translation(self) -> NDArray[np.float32]:
        """(P, 3) places of the parts."""
        return self.poses.translation

    @property
    def rotation(self) -> NDArray[np.float32]:
        """(P, 4) unit quaternions (w, x, y, z), local to world."""
        return self.poses.rotation

    @property
    def scale(self) -> NDArray[np.float32]:
        """(P, 3) half-lengths along the parts' own axes."""
        return self.poses.scale


@dataclass(frozen=True)
class Entry:
    """A line of the manifest."""

    name: str
    """Of the shape."""
    file: str
    """Relative to the folder."""
    split: str
    """One of SPLITS."""
    hash: str
    """SHA-256 of the file, hexadecimal."""


class PreparedFamily:
    """A prepared family, opened. Shapes are read on demand.

    name; parts: their names, in the order of every P axis; shapes: the entries; samples: points a shape;
    seed; average_pose: P rows; up: the axis that points up in all shapes. Raises UnreadableFileError where
    there is no manifest, NewerVersionError, and FamilyError where it breaks the format.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        data = _read_manifest(self.folder / MANIFEST)
        try:
            self.name = str(data["name"])
            self.parts = tuple(str(name) for name in data["parts"])
            self.shapes = tuple(_entry(line) for line in data["shapes"])
            self.samples, self.seed = int(data["samples"]), int(data["seed"])
            self.average_pose = _average(data["average_pose"], len(self.parts))
            self.up = canonical_up(str(data.get("up", UP)))
        except (KeyError, TypeError, ValueError, SettingError) as error:
            raise FamilyError(
                f"{self.folder / MANIFEST}: breaks the format ({error!r}); prepare it again"
            ) from error

    def __len__(self) -> int:
        return len(self.shapes)

    def __repr__(self) -> str:
        return f"PreparedFamily({self.name!r}, {len(self.shapes)} shapes, parts={list(self.parts)})"

    def split(self, *names: str) -> list[int]:
        """Numbers of the shapes in these splits ("train", "validation", "test"), in order."""
        return [i for i, entry in enumerate(self.shapes) if entry.split in names]

    def load(self, index: int, verify: bool = True) -> PreparedShape:
        """Shape `index`. `verify` also compares the file's hash with the manifest's.

        Raises UnreadableFileError where the file is missing or damaged, FamilyError where its tensors are not
        those of this family.
        """
        entry = self.shapes[index]
        path = self.folder / entry.file
        data = _read_bytes(path)
        if verify and hashlib.sha256(data).hexdigest() != entry.hash:
            raise UnreadableFileError(f"{path}: is not the file that was prepared; prepare the family again")
        shape = read_shape(path, entry.name, data)
        if len(shape.present) != len(self.parts):
            raise FamilyError(
                f"{path}: holds {len(shape.present)} parts, but the family has {len(self.parts)}; "
                "prepare it again"
            )
        return shape


def write_shape(path: str | Path, shape: PreparedShape, about: dict[str, Any] | None = None) -> str:
    """Write a shape's file and return its SHA-256. about: what else the file shall say, for `read_about`.

    Raises FamilyError where the arrays do not fit together, OutputError where it cannot be written.
    """
    from safetensors.numpy import save

    tensors = {name: _tensor(shape, name) for name in _TENSORS}
    _check(shape.name, tensors)
    frame = {"centre": list(shape.frame.centre), "scale": shape.frame.scale}
    # One line, because several are written in any order: the same shape shall be the same bytes.
    data = save(tensors, {_ABOUT: json.dumps({"name": shape.name, **frame, **(about or {})})})
    write_bytes(path, data)
    return hashlib.sha256(data).hexdigest()


def read_shape(path: str | Path, name: str, data: bytes | None = None) -> PreparedShape:
    """Read and check a shape's file, or its bytes if they have been read already.

    Raises UnreadableFileError where it is missing or damaged, FamilyError where its tensors do not fit.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    data = _read_bytes(Path(path)) if data is None else data
    try:
        tensors = load(data)
        about = _metadata(data)
        x, y, z = (float(c) for c in about["centre"])
        frame = UnitFrame((x, y, z), float(about["scale"]))
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise UnreadableFileError(
            f"{path}: cannot be read as a prepared shape ({error}); prepare the family again"
        ) from error
    _check(str(path), tensors)
    poses = Poses(tensors["translation"], tensors["rotation"], tensors["scale"])
    rest = {key: tensors[key] for key in _TENSORS if key not in ("translation", "rotation", "scale")}
    return PreparedShape(name=name, poses=poses, frame=frame, **rest)


def read_about(path: str | Path) -> dict[str, Any]:
    """What a shape's file says beside its tensors, which are not read. Raises UnreadableFileError."""
    check_file(Path(path))
    try:
        with Path(path).open("rb") as file:
            head = file.read(8)
            return _metadata(head + file.read(int.from_bytes(head, "little")))
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise UnreadableFileError(f"{path}: cannot be read as a prepared shape ({error})") from error


def write_manifest(
    folder: str | Path,
    name: str,
    parts: Sequence[str],
    entries: Sequence[Entry],
    samples: int,
    average_pose: Poses,
    seed: int,
    up: str = UP,
) -> None:
    """Write `family.json`, which completes the folder. Raises OutputError."""
    average = {key: _rows(getattr(average_pose, key)) for key in ("translation", "rotation", "scale")}
    data = {
        "format": FORMAT,
        "version": VERSION,
        "name": name,
        "parts": list(parts),
        "shapes": [vars(entry) for entry in entries],
        "samples": samples,
        "average_pose": average,
        "seed": seed,
        "up": up,
    }
    write_bytes(Path(folder) / MANIFEST, (json.dumps(data, indent=1) + "\n").encode())


def write_family(
    folder: str | Path,
    name: str,
    parts: Sequence[str],
    shapes: Sequence[tuple[PreparedShape, str]],
    average_pose: Poses,
    seed: int = 0,
) -> PreparedFamily:
    """Write shapes, each with its split, and the manifest; then open the family.

    Raises FamilyError, OutputError.
    """
    folder = Path(folder)
    try:
        (folder / SHAPES).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror}; choose another place") from error
    entries = []
    for shape, split in shapes:
        file = f"{SHAPES}/{shape.name}.safetensors"
        entries.append(Entry(shape.name, file, split, write_shape(folder / file, shape)))
    samples = len(shapes[0][0].points) if shapes else 0
    write_manifest(folder, name, parts, entries, samples, average_pose, seed)
    return PreparedFamily(folder)


def _tensor(shape: PreparedShape, name: str) -> NDArray[Any]:
    return np.ascontiguousarray(getattr(shape, name), dtype=_TENSORS[name][0])


def _check(where: str, tensors: dict[str, NDArray[Any]]) -> None:
    """Raise FamilyError unless all tensors are there, fit together, and hold what they may."""
    missing = [name for name in _TENSORS if name not in tensors]
    if missing:
        raise FamilyError(f"{where}: holds no {', '.join(missing)}; prepare the family again")
    length: dict[str, int] = {}
    for name, (kind, axes) in _TENSORS.items():
        array = tensors[name]
        expected = [length.setdefault(a, n) if isinstance(a, str) else a
                    for a, n in zip(axes, array.shape, strict=False)]  # fmt: skip
        if array.dtype != np.dtype(kind) or array.ndim != len(axes) or list(array.shape) != expected:
            raise FamilyError(
                f"{where}: {name} is {array.dtype} of shape {array.shape}; expected {np.dtype(kind)} of "
                f"({', '.join(map(str, axes))}), the same lengths for all tensors. Prepare the family again"
            )
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise FamilyError(f"{where}: {name} holds NaN or infinite numbers; prepare the family again")
    if (tensors["scale"] <= 0).any():
        raise FamilyError(f"{where}: a half-length is not above 0; prepare the family again")
    for name, limit in (("part", length["P"]), ("label", length["P"]), ("faces", length["V"])):
        if tensors[name].size and not 0 <= tensors[name].min() <= tensors[name].max() < limit:
            raise FamilyError(f"{where}: {name} goes beyond 0 to {limit - 1}; prepare the family again")


def _read_manifest(path: Path) -> dict[str, Any]:
    if path.parent.is_dir() and not path.exists():
        raise UnreadableFileError(
            f"{path}: no such file; check the path, or make a family of a folder of shapes with named parts: "
            f"parts prepare {path.parent} -o FAMILY"
        )
    try:
        data = json.loads(_read_bytes(path))
    except (ValueError, RecursionError) as error:
        raise FamilyError(f"{path}: not complete JSON ({error}); prepare the family again") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise FamilyError(f'{path}: not a prepared family: expected an object with "format": "{FORMAT}"')
    version = data.get("version")
    if not isinstance(version, int) or version < 1:
        raise FamilyError(f"{path}: version {version!r}; expected a number from 1 to {VERSION}")
    if version > VERSION:
        raise NewerVersionError(
            f"{path}: version {version}; this Partwright reads up to {VERSION}: upgrade it to open the family"
        )
    return data


def _entry(line: dict[str, Any]) -> Entry:
    entry = Entry(str(line["name"]), str(line["file"]), str(line["split"]), str(line["hash"]))
    if entry.split not in SPLITS:
        raise ValueError(f"{entry.name} is in split {entry.split!r}")
    if Path(entry.file).is_absolute() or ".." in Path(entry.file).parts:
        raise ValueError(f"{entry.name} lies outside the folder: {entry.file}")
    return entry


def _average(data: dict[str, Any], parts: int) -> Poses:
    poses = Poses(*(np.array(data[key], dtype=np.float32) for key in ("translation", "rotation", "scale")))
    shapes = (poses.translation.shape, poses.rotation.shape, poses.scale.shape)
    if shapes != ((parts, 3), (parts, 4), (parts, 3)):
        raise ValueError(f"average_pose has arrays of {shapes}")
    return poses


def _read_bytes(path: Path) -> bytes:
    check_file(path)
    try:
        return path.read_bytes()
    except OSError as error:
        raise UnreadableFileError(f"{path}: cannot be read ({error.strerror}); check the path") from error


def _metadata(data: bytes) -> dict[str, Any]:
    """What a safetensors file says of itself: its header is JSON behind eight bytes of length."""
    size = int.from_bytes(data[:8], "little")
    return json.loads(json.loads(data[8 : 8 + size])["__metadata__"][_ABOUT])


def _rows(array: NDArray[np.float32]) -> list[list[float]]:
    return [[float(x) for x in row] for row in array]
