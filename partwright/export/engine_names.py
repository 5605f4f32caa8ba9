"""Names by which engines know a collider: siblings of what is shown, in Unreal's and in Godot's convention.

Unreal: beside the mesh `NAME`, `UBX_NAME_01` is a box, `USP_` a sphere, `UCP_` a capsule, `UCX_` any convex
mesh.
Godot: a mesh whose name ends in `-convcolonly` becomes a static convex collider that is not shown.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

from partwright.approximation.collision import Geometry
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere

KINDS: dict[str, tuple[type[Field], ...]] = {
    "unreal": (Box, Sphere, Capsule),
    "godot": (Box, Cylinder, Sphere, Capsule),
}
_PREFIXES = {"box": "UBX", "sphere": "USP", "capsule": "UCP"}


def plain_name(name: str) -> str:
    """The name in letters, digits, `_` and `-`: engines turn all else into something of their own."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name) or "part"


def collider_names(engine: str, of: Iterable[tuple[str, Geometry]]) -> list[str]:
    """A name a collider, beside the name of what it is of, as `plain_name` gives it."""
    counted: Counter[str] = Counter()
    result = []
    for shown, geometry in of:
        counted[shown] += 1
        number = f"{counted[shown]:02d}"
        if engine == "godot":
            result.append(f"{shown}_{number}-convcolonly")
            continue
        kind = geometry.part.field.kind if geometry.part is not None else ""
        result.append(f"{_PREFIXES.get(kind, 'UCX')}_{shown}_{number}")
    return result
