"""build123d source to go on with by hand: parameters on top, one function a part, the tree at the end.

Named solids are exact B-reps when the source runs; other parts become the nearest solid, and blends sharp
edges: FILE.report.json lists them.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterator
from pathlib import Path

from partwright.assembly import Assembly, Node, Part
from partwright.export.approximation import write_report
from partwright.export.identifiers import comment
from partwright.export.solid_source import (
    MEANING,
    SourcePart,
    number,
    own_axes_angles,
    plain_unions,
    source_parts,
)
from partwright.export.solid_tree import solid_tree
from partwright.shapes import canonical_unit
from partwright.writing import write_bytes

_SOLIDS = {
    "box": "bd.Box(*{size})",
    "cylinder": "bd.Cylinder({radius}, {height})",
    "cone": "bd.Cone({radius}, 0, {height})",
    "frustum": "bd.Cone({bottom_radius}, {top_radius}, {height})",
    "sphere": "bd.Sphere({radius})",
    "capsule": "bd.Cylinder({radius}, {height})"
    " + [bd.Pos(0, 0, end * {height} / 2) * bd.Sphere({radius}) for end in (-1, 1)]",
    "tube": "bd.Cylinder({radius}, {height}) - bd.Cylinder({radius} - {thickness}, {height})",
    "torus": "bd.Torus({major_radius}, {minor_radius})",
}
_OPERATORS = {"union": "+", "difference": "-", "intersection": "&"}
_RESERVED = (*keyword.kwlist, "bd", "path", "assembly", "print")


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the source. Run by itself it writes a STEP file beside it; `assembly` is the whole.

    Raises:
        NoSurfaceError: nothing to export.
        SettingError: the assembly's unit is unknown.
        OutputError: the file cannot be written.
    """
    tree, changes = solid_tree(assembly)
    parts = source_parts(tree.parts, own_axes_angles, _RESERVED)
    unit = canonical_unit(assembly.unit) if assembly.unit else "unknown unit"
    lines = [
        f"# {comment(assembly.name) or 'Assembly'}: {len(parts)} parts. "
        f"Lengths in {unit}, angles in degrees.",
        "",
        "from pathlib import Path",
        "",
        "import build123d as bd",
        "",
        *(line for part in parts for line in _table(part, unit)),
        "",
        *(line for part in parts for line in _function(part)),
        f"assembly = {_tree(plain_unions(tree), {p.part.name: p.function for p in parts}, '')}",
        "",
        'if __name__ == "__main__":',
        f'    bd.export_step(assembly, Path(__file__).with_suffix(".step"){_unit_argument(assembly)})',
    ]
    write_bytes(path, ("\n".join(lines) + "\n").encode())
    write_report(assembly, path, changes)


def _unit_argument(assembly: Assembly) -> str:
    names = {"um": "MC", "mm": "MM", "cm": "CM", "m": "M", "in": "IN", "ft": "FT"}
    name = names.get(canonical_unit(assembly.unit)) if assembly.unit else None
    return f", unit=bd.Unit.{name}" if name else ""


def _table(part: SourcePart, unit: str) -> Iterator[str]:
    yield f"# {comment(part.part.name)}: {part.part.field.kind}"
    for parameter in part.parameters:
        value = parameter.value
        text = f"({', '.join(map(number, value))})" if isinstance(value, tuple) else number(value)
        measure = "degrees" if parameter.name == "turn" else unit
        yield f"{parameter.variable.upper()} = {text}  # {measure}: {MEANING[parameter.name]}"
    yield ""


def _function(part: SourcePart) -> Iterator[str]:
    names = {name: variable.upper() for name, variable in part.variables().items()}
    yield f"def {part.function}():"
    yield f"    solid = {_SOLIDS[part.part.field.kind].format(**names)}"
    yield f"    return bd.Location({names['place']}, {names['turn']}) * solid"
    yield ""
    yield ""


def _tree(node: Node, functions: dict[str, str], indent: str) -> str:
    if isinstance(node, Part):
        return f"{functions[node.name]}()"
    inner = indent + "    "
    first, *others = (_tree(child, functions, inner) for child in node.children)
    operator = _OPERATORS[node.operation]
    rest = "".join(f"\n{inner}{operator} {other}" for other in others)
    return f"(\n{inner}{first}{rest}\n{indent})"
