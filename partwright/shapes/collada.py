"""COLLADA meshes (`.dae`): in metres by the unit that the file names, and by the names of its nodes."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.errors import EmptyShapeError, MissingDependencyError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.cleaning import counted
from partwright.shapes.loading import PARSER_ERRORS
from partwright.shapes.source import Piece, Source, in_utf8

if TYPE_CHECKING:
    from collada import Collada


def read_collada(path: Path) -> Source:
    """Its triangles in metres: a piece for each set of a node's, by the name of the nearest node that has
    one, so that several may have the same. They are not turned: `up` is what the file says. A body with a
    skeleton is as it was bound to it.

    Raises:
        MissingDependencyError: pycollada is not installed.
        UnreadableFileError: it is missing or damaged. EmptyShapeError: it has no triangles.
    """
    check_shape_file(path)
    try:
        import collada
    except ImportError as error:
        raise MissingDependencyError(
            "COLLADA meshes need pycollada; install it with: pip install 'partwright[collada]'"
        ) from error
    try:
        document = collada.Collada(BytesIO(_without_materials(path)), ignore=[collada.common.DaeError])
        pieces = tuple(_placed(document))
    except (collada.common.DaeError, SyntaxError, *PARSER_ERRORS) as error:
        raise UnreadableFileError(f"{path}: it cannot be read as COLLADA: {error}") from error
    if not pieces:
        if document.errors:
            raise UnreadableFileError(f"{path}: it cannot be read as COLLADA: {document.errors[0]}")
        raise EmptyShapeError(f"{path}: it has no triangles")
    lost = [
        e for e in document.errors if isinstance(e, collada.common.DaeBrokenRefError) and "Geometry" in str(e)
    ]
    left_out = (
        f"left out {counted(len(lost), 'damaged or missing geometry', 'damaged or missing geometries')}"
    )
    up = (document.assetInfo.upaxis or "Y_UP")[0].lower()
    return Source(in_utf8(path.stem), pieces, unit="m", up=up, repairs=(left_out,) if lost else ())


def _without_materials(path: Path) -> bytes:
    """The file without what its surfaces look like: where that is wrong, the surfaces would be left out."""
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
    tree = etree.ElementTree(etree.fromstring(path.read_bytes(), parser))
    for tag in ("bind_material", "library_materials", "library_effects", "library_images"):
        for element in list(tree.iter(f"{{*}}{tag}")):
            element.getparent().remove(element)
    return bytes(etree.tostring(tree))


def _placed(document: Collada) -> Iterator[Piece]:
    metres = float(document.assetInfo.unitmeter or 1.0)
    if not 0 < metres < np.inf:
        raise ValueError(f"its unit is {metres} metres long")
    for node in document.scene.nodes if document.scene is not None else ():
        yield from _of(node, np.diag([metres, metres, metres, 1.0]), "")


def _of(node: Any, above: np.ndarray, name: str) -> Iterator[Piece]:
    """What is in a node. above: (4, 4) of what it is in, to metres. name: of the nearest that has one."""
    from collada.controller import Skin
    from collada.polylist import Polylist
    from collada.scene import ControllerNode, GeometryNode, Node, NodeNode
    from collada.triangleset import TriangleSet

    if isinstance(node, Node):
        named = node.node if isinstance(node, NodeNode) else node  # a reference has the name of what it means
        for child in node.children:
            yield from _of(child, above @ node.matrix, named.xmlnode.get("name") or name)
    if isinstance(node, ControllerNode) and isinstance(node.controller, Skin):
        geometry, above = (
            node.controller.geometry,
            above @ np.reshape(node.controller.bind_shape_matrix, (4, 4)),
        )
    elif isinstance(node, GeometryNode):
        geometry = node.geometry
    else:
        return
    for primitive in geometry.primitives:
        triangles = primitive.triangleset() if isinstance(primitive, Polylist) else primitive
        if (
            isinstance(triangles, TriangleSet)
            and triangles.vertex is not None
            and len(triangles.vertex_index)
        ):
            used, faces = np.unique(triangles.vertex_index, return_inverse=True)  # sets share all corners
            corners = np.asarray(triangles.vertex, np.float64)[used] @ above[:3, :3].T + above[:3, 3]
            faces = faces.reshape(-1, 3).astype(np.int64)
            yield Piece(name, corners, faces[:, ::-1] if np.linalg.det(above[:3, :3]) < 0 else faces)
