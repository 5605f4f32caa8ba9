"""A robot's file by its suffix, or a folder of meshes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

from partwright.errors import UnreadableFileError, UnsupportedFormatError
from partwright.robots.model import RobotFile

# suffix -> where its reader is
READERS = {
    ".urdf": "partwright.robots.urdf:Urdf",
    ".sdf": "partwright.robots.sdf:Sdf",
    ".xml": "partwright.robots.mjcf:Mjcf",
    ".mjcf": "partwright.robots.mjcf:Mjcf",
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), "partwright.robots.usd:Usd"),
}


def open_robot(path: str | Path, packages: Sequence[str | Path] = ()) -> RobotFile:
    """Read a robot.

    packages: folders in which the packages of `package://` and `model://` addresses lie.

    Raises:
        UnreadableFileError: it is not there or damaged, or one of its meshes is not there.
        UnsupportedFormatError: the suffix is none of a robot's.
        RobotError: it contradicts itself.
    """
    path = Path(path)
    if not path.exists():
        raise UnreadableFileError(f"{path}: there is no such file")
    where = "partwright.robots.mesh_folder:MeshFolder" if path.is_dir() else READERS.get(path.suffix.lower())
    if where is None:
        raise UnsupportedFormatError(
            f"{path}: {path.suffix!r} is no format of robots that is read; expected one of "
            f"{', '.join(READERS)}, or a folder of meshes"
        )
    module, _, name = where.partition(":")
    reader: Callable[[Path, Sequence[Path]], RobotFile] = getattr(import_module(module), name)
    return reader(path, [Path(folder) for folder in packages])
