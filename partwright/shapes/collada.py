"""COLLADA meshes (`.dae`): in metres by the unit that the file names, and by the names of its nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.errors import EmptyShapeError, MissingDependencyError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.cleaning import counted
from partwright.shapes.extent import check_extent
from partwright.shapes.loading import PARSER_ERRORS
from partwright.shapes.source import Piece, Source, in_utf8

if TYPE_CHECKING:
    from collada import Collada
    from lxml.etree import _Element

_BODIES = ("node", "instance_node", "instance_geometry", "instance_controller")
_TRANSFORMS = ("translate", "rotate", "scale", "matrix", "lookat", "skew")
# What bodies look like, and what is no body: where that is wrong, it would be told as if a body were.
_UNUSED = (
    "bind_material", "library_materials", "library_effects", "library_images", "library_animations",
    "library_lights", "library_cameras", "instance_light", "instance_camera",
)  # fmt: skip


def read_collada(path: Path) -> Source:
    """Its triangles in metres: a piece for each set of a node's, by the name of the nearest node that has
    one, so that several may have the same. They are not turned: `up` is what the file says. A body with a
    skeleton is as it was bound to it, one with morph targets as it is without them. `repairs` says what of
    the scene could not be read.

    Raises:
        MissingDependencyError: pycollada is not installed.
        UnreadableFileError: it is missing or damaged, or its nodes name one another beyond measure.
        EmptyShapeError: it has no triangles.
    """
    check_shape_file(path)
    try:
        import collada
    except ImportError as error:
        raise MissingDependencyError(
            "COLLADA meshes need pycollada; install it with: pip install 'partwright[collada]'"
        ) from error
    try:
        document = collada.Collada(BytesIO(_bodies_of(path)), ignore=[collada.common.DaeError])
        scene = _Scene(document)
        check_extent(path, *scene.extent())
        pieces = tuple(scene.pieces())
    except (collada.common.DaeError, SyntaxError, *PARSER_ERRORS) as error:
        raise UnreadableFileError(f"{path}: it cannot be read as COLLADA: {error}") from error
    if not pieces:
        if document.errors or scene.lost:
            why = document.errors[0] if document.errors else "none of its bodies could be read"
            raise UnreadableFileError(f"{path}: it cannot be read as COLLADA: {why}")
        raise EmptyShapeError(f"{path}: it has no triangles")
    up = (document.assetInfo.upaxis or "Y_UP")[0].lower()
    return Source(in_utf8(path.stem), pieces, unit="m", up=up, repairs=tuple(scene.told()))


def _bodies_of(path: Path) -> bytes:
    """The file without what is no body's."""
    from lxml import etree

    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, huge_tree=True, remove_comments=True, remove_pis=True
    )
    tree = etree.ElementTree(etree.fromstring(path.read_bytes(), parser))
    for tag in _UNUSED:
        for element in list(tree.iter(f"{{*}}{tag}")):
            element.getparent().remove(element)
    return bytes(etree.tostring(tree))


@dataclass
class _Scene:
    """What the scene of a document shows. lost, misplaced: bodies and transforms that could not be read.
    morphed: bodies that are shown without the morph targets that they have. Each counts once a place."""

    document: Collada
    lost: int = 0
    misplaced: int = 0
    morphed: int = 0
    _extents: dict[int, tuple[int, int]] = field(default_factory=dict)

    def extent(self) -> tuple[int, int]:
        """How many pieces there are in all, and of how many triangles: nodes may name one node often, which
        names another often, so that a small file shows more than any memory holds."""
        return _added([self._extent(node) for node in self._nodes()])

    def pieces(self) -> Iterator[Piece]:
        """All of them, in metres."""
        metres = float(self.document.assetInfo.unitmeter or 1.0)
        if not 0 < metres < np.inf:
            raise ValueError(f"its unit is {metres} metres long")
        for node in self._nodes():
            yield from self._of(node, np.diag([metres, metres, metres, 1.0]), "")

    def told(self) -> Iterator[str]:
        """A sentence for each kind of what was not read."""
        if self.lost:
            yield f"left out {counted(self.lost, 'body', 'bodies')} that could not be read"
        if self.misplaced:
            yield (
                f"left out {counted(self.misplaced, 'transform')} of nodes that cannot be read, so that what "
                "they place may lie elsewhere"
            )
        if self.morphed:
            bodies = counted(self.morphed, "body", "bodies")
            yield f"took {bodies} with morph targets without them"

    def _nodes(self) -> Sequence[Any]:
        return () if self.document.scene is None else self.document.scene.nodes

    def _extent(self, node: Any) -> tuple[int, int]:
        """Of a node; a body that was lost counts as one without triangles."""
        from collada.scene import Node, NodeNode

        node = node.node if isinstance(node, NodeNode) else node
        if id(node) not in self._extents:
            if isinstance(node, Node):
                bodies, lost = _bodies(node)
                self._extents[id(node)] = _added([(lost, 0), *map(self._extent, bodies)])
            else:
                sets = _triangle_sets(_geometry(node))
                self._extents[id(node)] = len(sets), sum(len(one.vertex_index) for one in sets)
        return self._extents[id(node)]

    def _of(self, node: Any, above: np.ndarray, name: str) -> Iterator[Piece]:
        """What is in a node. above: (4, 4) of what it is in, to metres. name: of the nearest that has one."""
        from collada.controller import Morph, Skin
        from collada.scene import ControllerNode, Node, NodeNode

        node = node.node if isinstance(node, NodeNode) else node  # a reference has the name of what it means
        if isinstance(node, Node):
            bodies, lost = _bodies(node)
            self.lost += lost
            self.misplaced += _count(node.xmlnode, _TRANSFORMS) - len(node.transforms)
            for child in bodies:
                if self._extent(child)[0]:
                    yield from self._of(child, above @ node.matrix, node.xmlnode.get("name") or name)
            return
        if isinstance(node, ControllerNode):
            if isinstance(node.controller, Skin):
                above = above @ np.reshape(node.controller.bind_shape_matrix, (4, 4))
            elif isinstance(node.controller, Morph):
                self.morphed += any(weight for _, weight in node.controller.target_list)
        for triangles in _triangle_sets(_geometry(node)):
            if triangles.vertex_index.min() < 0:  # the library minds only those that are too large
                self.lost += 1
                continue
            used, faces = np.unique(triangles.vertex_index, return_inverse=True)  # sets share all corners
            corners = np.asarray(triangles.vertex, np.float64)[used] @ above[:3, :3].T + above[:3, 3]
            faces = faces.reshape(-1, 3).astype(np.int64)
            yield Piece(name, corners, faces[:, ::-1] if np.linalg.det(above[:3, :3]) < 0 else faces)


def _added(extents: Sequence[tuple[int, int]]) -> tuple[int, int]:
    return sum(pieces for pieces, _ in extents), sum(triangles for _, triangles in extents)


def _count(node: _Element, tags: Sequence[str]) -> int:
    """How many children of a node of the document have one of these tags, in any namespace."""
    return sum(str(child.tag).rpartition("}")[2] in tags for child in node)


def _bodies(node: Any) -> tuple[list[Any], int]:
    """What a node holds that may show something, and how much of it could not be read."""
    from collada.scene import Node

    bodies = [one for one in node.children if isinstance(one, Node) or _geometry(one) is not None]
    return bodies, _count(node.xmlnode, _BODIES) - len(bodies)


def _geometry(node: Any) -> Any:
    """What a node shows; None where it shows none."""
    from collada.controller import Morph, Skin
    from collada.scene import ControllerNode, GeometryNode

    if isinstance(node, GeometryNode):
        return node.geometry
    if isinstance(node, ControllerNode) and isinstance(node.controller, Skin):
        return node.controller.geometry
    if isinstance(node, ControllerNode) and isinstance(node.controller, Morph):
        return node.controller.source_geometry
    return None


def _triangle_sets(geometry: Any) -> list[Any]:
    from collada.polylist import Polylist
    from collada.triangleset import TriangleSet

    if geometry is None:
        return []
    sets = [one.triangleset() if isinstance(one, Polylist) else one for one in geometry.primitives]
    return [one for one in sets if isinstance(one, TriangleSet) and one.vertex is not None]
