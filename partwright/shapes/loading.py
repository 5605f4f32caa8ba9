"""Mesh files to triangles: named pieces with their transforms applied, and what the file says of units."""

from __future__ import annotations

import io
import re
import struct
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import EmptyShapeError, NotFiniteError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.cleaning import counted
from partwright.shapes.gltf_tree import check_gltf
from partwright.shapes.point_cloud import source_of_points
from partwright.shapes.source import Piece, Source, in_utf8, unique_names

if TYPE_CHECKING:
    import trimesh

_NO_MESH = "holds no triangles; export the shape again with its mesh"
# A PLY may be a scan, too.
_NOTHING = {".ply": "holds neither triangles nor points; export the shape again, or the scan with its points"}
READ_BY_TRIMESH = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")

# What trimesh, numpy and json raise on bytes that are not what the suffix says. A parser fails
# wherever the bytes first stop making sense, so the families are wide; none of them can come from our own
# code here, because nothing but the parser runs inside the try.
PARSER_ERRORS = (
    OSError,
    EOFError,
    ValueError,  # includes UnicodeDecodeError and json.JSONDecodeError
    TypeError,
    AttributeError,
    LookupError,
    ArithmeticError,
    AssertionError,
    MemoryError,  # a header that claims more elements than memory holds
    RuntimeError,  # includes RecursionError and NotImplementedError
    NameError,  # includes UnboundLocalError, of a branch that was not taken
    ImportError,  # a compressed glTF extension whose decoder is not installed
    struct.error,
    zlib.error,
)


def read_mesh(path: Path) -> Source:
    """Read a mesh file; an instanced geometry gives one piece an instance. A PLY without faces is points.

    Raises UnreadableFileError, EmptyShapeError, or what `source_of_points` raises.
    """
    suffix = path.suffix.lower()
    stem = in_utf8(path.stem)
    scene = load_scene(path, suffix)
    pieces = tuple(unique_names(_pieces(scene, stem)))
    clouds = _clouds(scene, stem)
    if pieces:
        points = counted(sum(map(len, clouds)), "point")
        note = f"left out {points} that came without faces beside the mesh"
        source = Source(stem, pieces, repairs=(note,) if clouds else ())
    elif clouds:
        normals = _ply_normals(next(iter(scene.geometry.values()))) if len(scene.geometry) == 1 else None
        source = source_of_points(stem, np.concatenate(clouds), normals)
    else:
        raise EmptyShapeError(f"{stem}: {_NOTHING.get(suffix, _NO_MESH)}")
    is_gltf = suffix in (".glb", ".gltf")
    return replace(source, unit="m", up="y") if is_gltf else source


def _clouds(scene: trimesh.Scene, stem: str) -> list[NDArray[np.float64]]:
    """Points (N, 3) in world space of each node that has vertices and no faces, as a scan has."""
    clouds = []
    for node in scene.graph.nodes_geometry:
        geometry = str(scene.graph[node][1])
        if not _has_faces(scene.geometry[geometry]):
            points, _ = _placed(scene, node, geometry, stem)
            if len(points):
                clouds.append(points)
    return clouds


def _ply_normals(cloud: Any) -> NDArray[np.float64] | None:
    """Normals (N, 3) of a PLY's vertices; trimesh keeps them only with the elements as they were read."""
    elements = cloud.metadata.get("_ply_raw", {}).get("vertex", {}).get("data")
    try:
        return np.stack([np.ravel(elements[axis]) for axis in ("nx", "ny", "nz")], axis=1).astype(np.float64)
    except (TypeError, KeyError, ValueError):  # no such columns
        return None


def source_of_mesh(mesh: trimesh.Trimesh | tuple[Any, Any]) -> Source:
    """A Trimesh or (vertices (V, 3), faces (F, 3)) as a source; without faces, as points.

    Raises UnreadableFileError for arrays of another form, EmptyShapeError, or what `source_of_points` raises.
    """
    vertices, faces = mesh if isinstance(mesh, tuple) else (mesh.vertices, getattr(mesh, "faces", ()))
    try:
        v = np.array(vertices, dtype=np.float64)
        f = np.array(faces, dtype=np.int64)
    except (ValueError, TypeError, OverflowError) as error:
        raise UnreadableFileError(f"vertices and faces must be arrays of numbers: {error}") from error
    if v.size == 0 and f.size == 0:
        raise EmptyShapeError("the mesh has no vertices and no faces")
    if f.size == 0 and v.ndim == 2 and v.shape[1] == 3:
        return source_of_points("points", v)
    if v.ndim != 2 or v.shape[1] != 3 or f.ndim != 2 or f.shape[1] != 3:
        raise UnreadableFileError(
            f"vertices {v.shape} and faces {f.shape} were given; "
            "expected (V, 3) coordinates and (F, 3) triangles"
        )
    return Source("mesh", (Piece("mesh", v, _valid(f, len(v), "the mesh")),))


def load_scene(
    path: Path, suffix: str, colours: bool = False, document: bytes | None = None
) -> trimesh.Scene:
    """A mesh file as trimesh reads it; colours: with materials and their images; document: what is read in
    its place, beside the same files.

    Raises UnreadableFileError.
    """
    import trimesh

    check_shape_file(path)
    if suffix == ".stl":
        _refuse_cut_stl(path)
    if suffix in (".glb", ".gltf"):
        check_gltf(path)
    # A fit uses neither textures nor colours, so they are not decoded: that is faster and safer.
    options: dict[str, Any] = {"process": False}
    if suffix in (".obj", ".glb", ".gltf") and not colours:
        options["skip_materials"] = True
    if suffix == ".obj":
        options |= {"split_objects": not colours, "group_material": colours}
    try:
        with np.errstate(all="ignore"), _named_in_utf8(path) as readable:
            if document is not None:
                beside = trimesh.resolvers.FilePathResolver(str(path))
                options |= {"file_type": suffix[1:], "resolver": beside}
            scene = trimesh.load_scene(readable if document is None else io.BytesIO(document), **options)
    except PARSER_ERRORS as error:
        raise UnreadableFileError(
            f"{path}: cannot be read as {suffix[1:].upper()} ({type(error).__name__}: {error}); the file is "
            "truncated or not what its suffix says. Export it again"
        ) from error
    return scene


@contextmanager
def _named_in_utf8(path: Path) -> Iterator[Path]:
    """The file under a name that trimesh can encode: it names nodes after files, and hashes them.

    Of glTF, which names its nodes itself, the file stays beside those that it refers to.
    """
    if in_utf8(path.name) == path.name or path.suffix.lower() in (".glb", ".gltf"):
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        alias = Path(folder) / in_utf8(path.name)
        alias.symlink_to(path.absolute())
        yield alias


def _refuse_cut_stl(path: Path) -> None:
    """A binary STL says how many triangles it has; fewer bytes are a file that was cut."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(1000)
    if len(head) < 84 or (head.lstrip()[:5].lower() == b"solid" and b"facet" in head):
        return
    (count,) = struct.unpack("<I", head[80:84])
    there = (size - 84) // 50
    if there < count:
        raise UnreadableFileError(
            f"{path}: says that it has {count} triangles and holds {there}: the file is cut, or no STL. "
            "Export or download it again"
        )


def _pieces(scene: trimesh.Scene, stem: str) -> Iterator[Piece]:
    """World-space pieces in the scene's order; the primitives of one glTF mesh are joined into one piece."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for node in scene.graph.nodes_geometry:
        geometry = scene.graph[node][1]
        is_primitive = scene.geometry[geometry].metadata.get("from_gltf_primitive", False)
        owner = scene.graph.transforms.parents.get(node, node) if is_primitive else node
        groups.setdefault(owner, []).append((node, str(geometry)))
    for owner, members in groups.items():
        placed = [
            _placed(scene, node, geometry, stem)
            for node, geometry in members
            if _has_faces(scene.geometry[geometry])
        ]
        if not placed:
            continue
        offsets = np.cumsum([0] + [len(v) for v, _ in placed])
        # glTF nodes without a name come as their number; the mesh's own name says more.
        first = members[0][1]
        name = (re.sub(r"_\d+$", "", first) if len(members) > 1 else first) if owner.isdigit() else owner
        yield Piece(
            stem if Path(name).stem == stem and "." in name else name,
            np.concatenate([v for v, _ in placed]),
            np.concatenate([f + o for (_, f), o in zip(placed, offsets[:-1], strict=True)]),
        )


def _has_faces(geometry: Any) -> bool:
    """Points and lines have none."""
    return len(getattr(geometry, "faces", ())) > 0


def _placed(
    scene: trimesh.Scene, node: str, geometry: str, where: str
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    mesh = scene.geometry[geometry]
    vertices = _in_threes(getattr(mesh, "vertices", ()), np.float64, where)
    faces = _valid(_in_threes(getattr(mesh, "faces", ()), np.int64, where), len(vertices), where)
    matrix = np.asarray(scene.graph[node][0], dtype=np.float64)
    if not np.isfinite(matrix).all():
        raise NotFiniteError(f"{where}: the transform of node {node} holds NaN or infinity; export it again")
    if not np.array_equal(matrix, np.eye(4)):
        with np.errstate(all="ignore"):  # a NaN vertex that no face uses may pass through here
            vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror turns every triangle inside out
            faces = faces[:, ::-1]
    return vertices, np.ascontiguousarray(faces)


def _in_threes(rows: Any, kind: type, where: str) -> NDArray[Any]:
    """Rows (N, 3); parsers hand on what they found, which in a file that was cut may be less."""
    array: NDArray[Any] = np.array(rows, dtype=kind)
    if array.size and (array.ndim != 2 or array.shape[1] != 3):
        raise UnreadableFileError(
            f"{where}: vertices or triangles come with {array.shape[-1]} numbers, not three; the file is cut "
            "or damaged. Export it again"
        )
    return array.reshape(-1, 3)


def _valid(faces: NDArray[np.int64], vertex_count: int, where: str) -> NDArray[np.int64]:
    if faces.size and (faces.min() < 0 or faces.max() >= vertex_count):
        wrong = int(faces.min() if faces.min() < 0 else faces.max())
        raise UnreadableFileError(
            f"{where}: a triangle names vertex {wrong} of {vertex_count}; "
            "the face indices must lie within the vertices. Export the shape again"
        )
    return faces
