"""The text of an assembly file, reproducible to the byte. `files` reads it.

Numbers are written in the shortest form that reads back to the same bits, so that `load_assembly` of a saved
assembly equals it; copies of groups come back where their moves take them, the same but for rounding.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright.assembly.group_copies import GroupCopy, in_runs
from partwright.assembly.similarity import Similarity
from partwright.atomic_io import write_bytes

if TYPE_CHECKING:
    from partwright.assembly.tree import Assembly, Part

FORMAT = "partwright-assembly"
VERSION = 1


def save(assembly: Assembly, path: str | Path) -> None:
    """Write the assembly file; see `Assembly.save`."""
    write_bytes(path, to_text(assembly).encode("utf-8"))


def to_text(assembly: Assembly) -> str:
    """The text of the assembly file, one part a line, copies of groups as moves."""
    head = f'"format": "{FORMAT}",\n "version": {VERSION},\n '
    return "{" + head + _assembly_text(assembly, 1)[1:] + "\n"


def _assembly_text(node: Assembly, depth: int, copies: Sequence[GroupCopy] = ()) -> str:
    pad = " " * depth
    lines = []
    if depth == 1 or node.unit is not None:
        lines.append(f'"unit": {_json(node.unit)}')
    if depth == 1 or node.up is not None:
        lines.append(f'"up": {_json(node.up)}')
    lines += [
        f'"name": {_json(node.name)}',
        f'"operation": "{node.operation}"',
        f'"blend": {_json(node.blend)}',
    ]
    if node.metadata:
        lines.append(f'"metadata": {_json(_sorted(node.metadata))}')
    if copies:
        moves = f",\n{pad} ".join(_json(_copy_dict(copy)) for copy in copies)
        lines.append(f'"instances": [\n{pad} {moves}\n{pad}]')
    children = (
        _part_text(child) if child.is_part else _assembly_text(child, depth + 2, own)
        for child, own in in_runs(node)
    )
    inner = f",\n{pad} ".join(children)
    lines.append(f'"children": [\n{pad} {inner}\n{pad}]')
    return "{" + f",\n{pad}".join(lines) + "}"


def _part_text(part: Part) -> str:
    data: dict[str, Any] = {
        "name": part.name,
        "field": part.field.to_dict(),
        "translation": part.translation,
        "rotation": part.rotation,
        "blend": part.blend,
    }
    if part.instances:
        data["instances"] = [instance_dict(move) for move in part.instances]
    if part.metadata:
        data["metadata"] = _sorted(part.metadata)
    return _json(data)


def _copy_dict(copy: GroupCopy) -> dict[str, Any]:
    mirror = {"mirror": copy.mirror} if copy.mirror is not None else {}
    names = {"names": list(copy.names)} if copy.names else {}
    return {**mirror, **instance_dict(copy.move), **names}


def instance_dict(move: Similarity) -> dict[str, list[float]]:
    """A rigid move as assembly files have it."""
    return {"translation": list(move.translation), "rotation": list(move.rotation)}


def _sorted(metadata: Mapping[str, str | float]) -> dict[str, str | float]:
    return dict(sorted(metadata.items()))


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
