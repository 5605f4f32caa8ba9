"""One CAD part by its number: a recipe with random sizes, its exact mesh, and checks of both."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node
from partwright.atomic_io import check_folder, write_bytes
from partwright.datasets.cad_parts import prismatic, rotational
from partwright.datasets.making import to_mesh, write_ply
from partwright.errors import NoSurfaceError, SettingError
from partwright.meshing.csg import solid_of
from partwright.render.raycast import Scene
from partwright.shapes.sampling import sample_triangles

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

KINDS: dict[str, Callable[[np.random.Generator], Node]] = {
    recipe.__name__: recipe for recipe in (*prismatic.RECIPES, *rotational.RECIPES)
}
_TRIES = 50
_TOLERANCE = 5e-4  # of the longest side: chords of curved faces
_FLATTEST = 0.1  # of the longest side, the shortest (CAPRI-Net, section 4.1)
_THINNEST = 0.012  # of the longest side: what 95 % of the surface has at least behind it
_EMPTIEST = 0.03  # share of the bounding box that is filled
_RAYS = 400


@dataclass(frozen=True)
class CadPart:
    """A part in millimetres with Z up.

    kind: its recipe's name. seed, number: what it is drawn by. assembly: the tree that it is made by, of
    named solids and quadrics. mesh: its surface, closed and in one piece. genus: of the surface.
    """

    kind: str
    seed: int
    number: int
    assembly: Assembly
    mesh: trimesh.Trimesh
    genus: int

    @property
    def name(self) -> str:
        return self.assembly.name


def cad_part(number: int, seed: int = 0, kind: str | None = None) -> CadPart:
    """The part of a number: the same every time, whichever others are drawn.

    kind: one of `KINDS`; they take turns if None. Sizes that fail a check (not in one piece, too flat, too
    thin, next to empty) are drawn again.

    Raises SettingError for an unknown kind or a negative number or seed.
    """
    if kind is not None and kind not in KINDS:
        raise SettingError(f"kind {kind!r} is unknown; choose one of {', '.join(KINDS)}")
    if number < 0 or seed < 0:
        raise SettingError(f"part {number} of seed {seed}: both start at 0")
    kind = kind or list(KINDS)[number % len(KINDS)]
    rng = np.random.default_rng([seed, number, list(KINDS).index(kind)])
    for _ in range(_TRIES):
        tree = KINDS[kind](rng)
        children = tree.children if isinstance(tree, Assembly) else (tree,)
        operation = tree.operation if isinstance(tree, Assembly) else "union"
        assembly = Assembly(children, operation, name=f"{kind}_{number:05d}", unit="mm", up="z")
        box = assembly.bounds()
        try:
            solid = solid_of(assembly, _TOLERANCE * float(np.ptp(box, axis=0).max()))
        except NoSurfaceError:
            continue
        mesh = to_mesh(solid)
        if _one_piece(solid) and _stout(solid, mesh):
            return CadPart(kind, seed, number, assembly, mesh, solid.genus())
    raise RuntimeError(f"the recipe {kind} fails its checks for every size drawn; seed {seed}, part {number}")


def cad_parts(count: int, seed: int = 0, kind: str | None = None) -> Iterator[CadPart]:
    """The parts of the numbers 0 to count - 1, as `cad_part`."""
    for number in range(count):
        yield cad_part(number, seed, kind)


def write_cad_parts(folder: str | Path, count: int, seed: int = 0, kind: str | None = None) -> None:
    """Write NAME.ply and NAME.json (the assembly) for each part, and index.json, into a folder.

    Raises OutputError where it cannot be written.
    """
    check_folder(folder)
    Path(folder).mkdir(parents=True, exist_ok=True)
    index = []
    for part in cad_parts(count, seed, kind):
        write_ply(part.mesh, Path(folder) / f"{part.name}.ply")
        part.assembly.save(Path(folder) / f"{part.name}.json")
        index.append(
            {
                "name": part.name,
                "kind": part.kind,
                "leaves": len(part.assembly),
                "faces": len(part.mesh.faces),
                "volume": round(float(part.mesh.volume), 6),
                "genus": part.genus,
            }
        )
    about = {"unit": "mm", "up": "z", "seed": seed, "parts": index}
    write_bytes(Path(folder) / "index.json", (json.dumps(about, indent=1) + "\n").encode())


def _one_piece(solid: Manifold) -> bool:
    return len(solid.decompose()) == 1


def _stout(solid: Manifold, mesh: trimesh.Trimesh) -> bool:
    """Not flat, not next to empty, and with enough material behind nearly all of its surface."""
    sides = np.ptp(mesh.vertices, axis=0)
    if sides.min() < _FLATTEST * sides.max() or solid.volume() < _EMPTIEST * float(np.prod(sides)):
        return False
    points, face = sample_triangles(mesh.vertices, mesh.faces, _RAYS, 0)
    scene = Scene(mesh.vertices, mesh.faces)
    inward = -scene.face_normals[face].astype(np.float64)
    start = points + 1e-4 * sides.max() * inward
    thickness = scene.first_hit(start, inward)[1]
    return bool(np.quantile(thickness, 0.05) >= _THINNEST * sides.max())
