"""What a glTF file claims, looked at before it is read: its tree of nodes, its counts, the files it names."""

from __future__ import annotations

import json
import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from partwright.errors import UnreadableFileError
from partwright.input_files import check_file

_DEEPEST = 500  # nodes below one another; a robot's chain has tens
_LARGEST_CLAIM = 1 << 26  # numbers that accessors without data may make up
_MOST_DRAWN = 1 << 28  # corners of triangles of all nodes together
_DRACO = "KHR_draco_mesh_compression"  # read where DracoPy is; else trimesh takes zeros for all vertices
_JSON_CHUNK = 0x4E4F534A
_WIDEST = 16  # numbers of one element of an accessor: a matrix


def check_gltf(path: Path) -> None:
    """Refuse what would take for ever, or all memory, to read; other nonsense is left to the parser.

    Raises:
        UnreadableFileError: glTF 1.0, nodes in a circle, with two parents or very deep below one another,
            elements without data or instances beyond measure, compressed buffers, or a buffer that is no
            file.
    """
    version, tree = _read(path)
    if version == 1 or (version is None and _is_first_version(tree)):
        raise UnreadableFileError(
            f"{path}: is glTF 1.0, which 2.0 has replaced; convert it (gltf-pipeline does) or export it again"
        )
    if not isinstance(tree, dict):
        return
    compressed = {"EXT_meshopt_compression", "KHR_meshopt_compression"} & set(
        _list(tree, "extensionsRequired", str)
    )
    if compressed:
        raise UnreadableFileError(
            f"{path}: its buffers are compressed ({compressed.pop()}), which is not read; export it without"
        )
    if _DRACO in _list(tree, "extensionsRequired", str) and find_spec("DracoPy") is None:
        raise UnreadableFileError(
            f"{path}: its meshes are compressed ({_DRACO}), which takes another package to read: pip install "
            "DracoPy, or export it without"
        )
    nodes, accessors = _list(tree, "nodes", dict), _list(tree, "accessors", dict)
    _check_nodes(path, nodes)
    claimed = sum(_count(a.get("count")) for a in accessors if "bufferView" not in a)
    if claimed * _WIDEST > _LARGEST_CLAIM:
        raise UnreadableFileError(
            f"{path}: {claimed} elements have no data (accessors without bufferView); export it again"
        )
    drawn = [_drawn(mesh, accessors) for mesh in _list(tree, "meshes", dict)]
    total = sum(drawn[node["mesh"]] for node in nodes if _index(node.get("mesh"), len(drawn)))
    if total > _MOST_DRAWN:
        raise UnreadableFileError(
            f"{path}: its nodes together have {total} corners of triangles; at most {_MOST_DRAWN} are read"
        )
    for buffer in _list(tree, "buffers", dict):
        uri = buffer.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            check_file(path.parent / unquote(uri))


def _is_first_version(tree: Any) -> bool:
    """By what a glTF says of itself."""
    asset = tree.get("asset") if isinstance(tree, dict) else None
    version = asset.get("version") if isinstance(asset, dict) else None
    return isinstance(version, (str, int, float)) and str(version).split(".")[0] == "1"


def gltf_tree(path: Path) -> Any:
    """The JSON of a GLB or glTF file; None where there is none.

    Raises:
        UnreadableFileError: it is nested too deep.
    """
    return _read(path)[1]


def _read(path: Path) -> tuple[int | None, Any]:
    """The version that the head of a GLB names, None for others; and what `gltf_tree` gives. Raises as it."""
    version = None
    try:
        with path.open("rb") as file:
            data = file.read(20)
            if data[:4] == b"glTF":
                (version,) = struct.unpack("<I", data[4:8])
                length, kind = struct.unpack("<II", data[12:20])
                data = file.read(length) if kind == _JSON_CHUNK else b""
            else:
                data += file.read()
        return version, json.loads(data)
    except (OSError, ValueError, struct.error):
        return version, None
    except RecursionError as error:
        raise UnreadableFileError(f"{path}: its JSON is nested too deep; export it again") from error


def _check_nodes(path: Path, nodes: list[dict[str, Any]]) -> None:
    depth: list[int | None] = [None] * len(nodes)
    children = [[c for c in _list(node, "children", int) if _index(c, len(nodes))] for node in nodes]
    parents = [0] * len(nodes)
    for below in children:
        for child in below:
            parents[child] += 1
    if any(count > 1 for count in parents):
        raise UnreadableFileError(f"{path}: a node has two parents, or one twice; export the scene again")
    front, level = [i for i, count in enumerate(parents) if count == 0], 0
    while front:
        if level == _DEEPEST:
            raise UnreadableFileError(
                f"{path}: its nodes lie more than {_DEEPEST} deep below one another; flatten the scene"
            )
        for i in front:
            depth[i] = level
        front, level = [child for i in front for child in children[i]], level + 1
    if None in depth:
        raise UnreadableFileError(f"{path}: nodes are their own ancestors; export the scene again")


def _drawn(mesh: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    """Corners of a mesh's triangles."""
    total = 0
    for primitive in _list(mesh, "primitives", dict):
        attributes = primitive.get("attributes")
        named = primitive.get("indices", attributes.get("POSITION") if isinstance(attributes, dict) else None)
        if _index(named, len(accessors)):
            total += _count(accessors[named].get("count"))
    return total


def _list(owner: dict[str, Any], key: str, kind: type) -> list[Any]:
    """The list under `key`; empty where it is none, or holds something else, which the parser will say."""
    found = owner.get(key)
    return found if isinstance(found, list) and all(isinstance(one, kind) for one in found) else []


def _index(value: Any, count: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < count


def _count(value: Any) -> int:
    return max(0, value) if isinstance(value, int) else 0
