"""Parts too thin for the cells of a whole: meshed along their own axes, and joined by booleans (manifold3d).

Marching cubes at any affordable resolution leaves holes in a plate of a five-hundredth of the longest side,
or nothing of it. Such a part is meshed alone, cut by what cuts it, and united with the mesh of the whole. A
blend adds to what it joins, so nothing comes in that does not belong there, but for what the blend of a
cut takes beyond the cut itself: of that, pieces by themselves are left out again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Part
from partwright.assembly.tree import Node
from partwright.errors import NoSurfaceError
from partwright.meshing.manifolds import as_manifold, surface_of
from partwright.meshing.small_components import without_small_components

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

_OF_WALL = 64  # a side of a thin part may move by this part of its wall where that takes fewer triangles

Mesher = Callable[[Node], "trimesh.Trimesh"]
Thin = Callable[[Part], bool]
Distance = Callable[[np.ndarray], np.ndarray]


def thin_solids(node: Node, thin: Thin, mesh: Mesher) -> list[Manifold]:
    """Thin parts of a node, each copy by itself, less what is subtracted from them.

    None that is subtracted, intersected with others, or cut by what does not end, however thin.

    mesh: of a part, or of what is subtracted from one.
    """
    if node.is_part:
        # Cells across its wall make a great many triangles of its flat sides.
        return [one.simplify(node.field.wall / _OF_WALL) for one in _solids(node, mesh)] if thin(node) else []
    cut = node.operation == "difference"
    if node.operation == "intersection" or (cut and not np.isfinite(_bounds(node.children[1:])).all()):
        return []
    found = [
        one
        for child in (node.children[:1] if cut else node.children)
        for one in thin_solids(child, thin, mesh)
    ]
    if not (found and cut):
        return found
    boxes = [_box(one) for one in found]
    cutters = [copy for cutter in node.children[1:] for copy in _copies(cutter)]
    reaching = [one for one in cutters if any(_meet(box, one.bounds()) for box in boxes)]
    taken = [one for cutter in reaching for one in _solids(cutter, mesh)]
    return [_without(solid, taken) for solid in found]


def without_scraps(solids: list[Manifold], distance: Distance, near: float) -> list[Manifold]:
    """The connected pieces of solids that come as near to the assembly, whose signed distance (n,) at points
    (n, 3) is given, or lie in it."""
    pieces = [piece for solid in solids for piece in solid.decompose()]
    return [piece for piece in pieces if distance(surface_of(piece)[0]).min() < near]


def united(mesh: trimesh.Trimesh | None, solids: list[Manifold], crumb: float) -> trimesh.Trimesh:
    """A closed mesh, if there is one, and solids as one closed mesh.

    crumb: where two surfaces are all but the same crumbs are left; those shorter than this are left out.

    Raises:
        NoSurfaceError: nothing is left of any.
    """
    import trimesh
    from manifold3d import Manifold, OpType

    thick = [] if mesh is None else [as_manifold(mesh)]
    whole = Manifold.batch_boolean(thick + solids, OpType.Add)
    if whole.is_empty():
        raise NoSurfaceError("Nothing is left of the assembly: what it subtracts takes all away.")
    vertices, faces = without_small_components(*surface_of(whole), crumb)
    return trimesh.Trimesh(vertices, faces, process=False)


def _solids(node: Node, mesh: Mesher) -> list[Manifold]:
    """A node as solids, each copy of a part by itself, as copies may overlap; none of what has no volume."""
    try:
        return [as_manifold(mesh(copy)) for copy in _copies(node)]
    except NoSurfaceError:
        return []


def _copies(node: Node) -> tuple[Node, ...]:
    return node.copies if node.is_part else (node,)


def _bounds(nodes: tuple[Node, ...]) -> np.ndarray:
    return np.array([node.bounds() for node in nodes])


def _without(solid: Manifold, taken: list[Manifold]) -> Manifold:
    """Less what reaches its box: manifold3d would unite all of it first."""
    from manifold3d import Manifold, OpType

    reaching = [one for one in taken if _meet(_box(solid), _box(one))]
    return Manifold.batch_boolean([solid, *reaching], OpType.Subtract) if reaching else solid


def _box(solid: Manifold) -> np.ndarray:
    """(2, 3) lowest and highest corner."""
    return np.reshape(solid.bounding_box(), (2, 3))


def _meet(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((one[0] <= other[1]).all() and (other[0] <= one[1]).all())
