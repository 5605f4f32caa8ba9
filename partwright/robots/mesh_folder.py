"""A folder of meshes: each file is a link, and is written again as its convex pieces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from partwright.errors import RobotError
from partwright.fields import Field
from partwright.robots.model import Files, Link, MeshUse, RobotFile, Shape

SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb")
_APART = (".obj", ".glb")  # that keep objects with names


class MeshFolder(RobotFile):
    """Meshes of a folder and the folders in it, in metres, each in its own frame, named by its path there.

    Pieces are hulls: a mesh holds nothing else.
    """

    kinds: ClassVar[tuple[type[Field], ...]] = ()

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        """Raises RobotError where no mesh is in it."""
        self.path, self.packages = path.resolve(), packages
        self._files = dict(sorted(_meshes(path)))
        if not self._files:
            raise RobotError(f"{path}: no mesh is in this folder; expected {', '.join(SUFFIXES)}")
        self.links = [
            Link(name, np.eye(4), (), (MeshUse(file, np.eye(4)),)) for name, file in self._files.items()
        ]

    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        files = Files()
        for name, file in self._files.items():
            if name in shapes:
                files.written[name] = _exported(shapes[name], file.suffix.lower())
        return files


def _meshes(folder: Path) -> Iterator[tuple[str, Path]]:
    """All meshes, and where they lie in the folder; left out is what is hidden, and what was made of the
    folder before, and written into it."""
    made = {report.parent for report in folder.rglob(f"{folder.resolve().name}.report.json")} - {folder}
    for file in folder.rglob("*"):
        within = file.relative_to(folder)
        hidden = any(part.startswith(".") for part in within.parts)
        if (
            file.suffix.lower() in SUFFIXES
            and file.is_file()
            and not hidden
            and made.isdisjoint(file.parents)
        ):
            yield within.as_posix(), file


def _exported(shapes: Sequence[Shape], suffix: str) -> bytes:
    """All hulls in one file: objects under their names where the format has them, else shells."""
    import trimesh

    meshes = {shape.name: shape.mesh for shape in shapes if shape.mesh is not None}
    if suffix in _APART:
        scene = trimesh.Scene()
        for name, mesh in meshes.items():
            scene.add_geometry(mesh, name, name)
        data: str | bytes = scene.export(file_type=suffix[1:])
    else:
        whole: Any = trimesh.util.concatenate(list(meshes.values()))
        data = whole.export(file_type=suffix[1:])
    return data.encode() if isinstance(data, str) else bytes(data)
