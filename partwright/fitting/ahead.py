"""What takes longest to write of a result, meshes of its parts and its picture, made while it is scored."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.assembly import Assembly
from partwright.at_once import thread_count
from partwright.atomic_io import write_bytes
from partwright.shapes import Shape

if TYPE_CHECKING:
    import trimesh


class Ahead:
    """The contents of parts.glb, from now on, and of preview.png, from when the surface is known, by threads.

    They are the same as without. What fails is raised where it is written.
    """

    def __init__(self, shape: Shape, assembly: Assembly) -> None:
        self.shape, self.assembly = shape, assembly
        self.surface: trimesh.Trimesh | None = None
        self._pool = ThreadPoolExecutor(2)
        self._parts = self._pool.submit(_parts, assembly)
        self._picture: Future[bytes] | None = None

    @staticmethod
    def pays(threads: int) -> bool:
        """Whether there is a processor for it; threads: that may be used, 0 for one a core."""
        return min(thread_count(threads), thread_count(0)) > 1

    def draw(self, surface: trimesh.Trimesh) -> None:
        """Begin with the picture."""
        self.surface = surface
        self._picture = self._pool.submit(_picture, self.shape, self.assembly, surface)
        self._pool.shutdown(wait=False)  # which still does what it was given

    def is_of(self, shape: Shape, assembly: Assembly, surface: trimesh.Trimesh) -> bool:
        """Whether these are what it shows: a result may be another one's with something replaced."""
        return self.shape is shape and self.assembly is assembly and self.surface is surface

    def write(self, folder: Path) -> None:
        """Wait for both, and write them."""
        assert self._picture is not None
        write_bytes(folder / "parts.glb", self._parts.result())
        write_bytes(folder / "preview.png", self._picture.result())

    def give_up(self) -> None:
        """Begin nothing more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _parts(assembly: Assembly) -> bytes:
    from partwright.export.glb import document

    return document(assembly)


def _picture(shape: Shape, assembly: Assembly, surface: trimesh.Trimesh) -> bytes:
    from partwright.render import preview
    from partwright.render.output import png

    return png(preview(shape, assembly, surface, title=shape.name))
