"""GLSL: one self-contained `float sdf(vec3 p)`, for GLSL 3.30, GLSL ES 3.00 and later.

The formulas (distance.glsl, by which the studio draws as well, superfrustum.glsl and, where there are
any, quadric.glsl, profile.glsl and pipe.glsl, beside this file) are followed by a table of the parts, one
constant each, or a function for what is swept of a profile or along a path, and by the tree of operations.
All lengths are in the assembly's own unit.
"""

from __future__ import annotations

from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.rows import as_superfrustum
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds
from partwright.export.glsl_pipes import pipe_function
from partwright.export.glsl_profiles import swept_function
from partwright.export.identifiers import comment, identifiers
from partwright.fields import Pipe, Swept
from partwright.shapes import canonical_unit

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the assembly's exact signed distance, blends and all.

    Raises:
        ParameterError: a part is no SuperFrustum, quadric, extrusion, revolution or pipe.
        OutputError: the file cannot be written.
    """
    write_bytes(path, to_glsl(assembly).encode())


def to_glsl(assembly: Assembly) -> str:
    """The text of the shader; each copy of a repeated part is a constant of its own."""
    assembly = assembly.expanded()
    constants = [name.upper() for name in identifiers([p.name for p in assembly.parts], ["half_pi"])]
    head = [
        f"// {comment(assembly.name) or 'Assembly'}: {len(assembly)} parts. "
        f"Lengths in {canonical_unit(assembly.unit) if assembly.unit else 'an unknown unit'}.",
        "// float sdf(vec3 p) is the signed distance, negative inside. Put it after `#version 330` or later,",
        "// or after `#version 300 es` and `precision highp float;`.",
        "",
        _formula("distance.glsl"),
        _formula("superfrustum.glsl"),
    ]
    if any(part.field.quadric() is not None for part in assembly.parts):
        head.append(_formula("quadric.glsl"))
    if any(isinstance(part.field, Swept) for part in assembly.parts):
        head.append(_formula("profile.glsl"))
    if any(isinstance(part.field, Pipe) for part in assembly.parts):
        head.append(_formula("pipe.glsl"))
    table, functions = [], []
    for name, part in zip(constants, assembly.parts, strict=True):
        if isinstance(part.field, Swept):
            functions += swept_function(name.lower(), part, _numbers)
        elif isinstance(part.field, Pipe):
            functions += pipe_function(name.lower(), part, _numbers)
        else:
            table.append(_constant(name, part))
    _function(assembly, "sdf", iter(constants), (f"group_{i}" for i in count(1)), functions)
    return "\n".join([*head, *table, "", *functions])


def _formula(file: str) -> str:
    return files("partwright.export").joinpath(file).read_text("utf-8")


def _constant(name: str, part: Part) -> str:
    """The part's row, in the order of its struct."""
    w, x, y, z = part.rotation
    vectors: list[tuple[str, Sequence[float]]] = [("vec3", part.translation), ("vec4", (x, y, z, w))]
    quadric = part.field.quadric()
    if quadric is not None:
        struct, terms = "Quadric", quadric.scaled_terms
        vectors += [("mat3", terms.square.ravel().tolist()), ("vec3", terms.linear.tolist())]
        numbers = [terms.constant, terms.fall, terms.rise]
    else:
        struct = "Part"
        sx, sy, sz, *numbers = as_superfrustum(part.field).parameters()
        vectors.append(("vec3", (sx, sy, sz)))
    values = [f"{kind}({_numbers(v)})" for kind, v in vectors]
    row = ", ".join((*values, _numbers((*numbers, part.blend))))
    return f"const {struct} {name} = {struct}({row});  // {comment(part.name)}"


def _numbers(values: Sequence[float]) -> str:
    """float32 literals in their shortest form."""
    return ", ".join(str(np.float32(value)) for value in values)


def _function(
    node: Assembly, name: str, constants: Iterator[str], groups: Iterator[str], functions: list[str]
) -> None:
    """Append the functions of the node, those it calls first; `constants` are used up leaf by leaf."""
    lines = [f"float {name}(vec3 p) {{" + (f"  // {comment(node.name)}" if node.name else "")]
    for i, child in enumerate(node.children):
        value, blend = _call(child, constants, groups, functions)
        if i == 0:
            lines.append(f"    float d = {value};")
        else:
            lines.append(f"    d = smooth_{node.operation}(d, {value}, {blend});")
    functions += [*lines, "    return d;", "}", ""]


def _call(
    child: Node, constants: Iterator[str], groups: Iterator[str], functions: list[str]
) -> tuple[str, str]:
    if child.is_part:
        constant = next(constants)
        if isinstance(child.field, Swept | Pipe):
            return f"{constant.lower()}_sdf(p)", _numbers([child.blend])
        function = "part_sdf" if child.field.quadric() is None else "quadric_sdf"
        return f"{function}(p, {constant})", f"{constant}.blend"
    group = next(groups)
    _function(child, group, constants, groups, functions)
    return f"{group}(p)", _numbers([child.blend])


FORMAT = Format(
    "GLSL", write, frozenset({Holds.NAMES, Holds.PARAMETERS, Holds.EXACT, Holds.SUBTRACTION, Holds.BLENDS})
)
