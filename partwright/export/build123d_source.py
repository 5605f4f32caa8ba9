"""build123d source to go on with by hand: parameters on top, one function a part with a loop over its
copies, the tree at the end.

Named solids are exact B-reps when the source runs, and SuperFrusta lofts; quadrics without end that are no
such solid within the assembly are flat facets, what `drawn` refuses becomes the nearest solid, and blends
sharp edges: FILE.report.json lists them.
"""

from __future__ import annotations

import builtins
import dataclasses
import keyword
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.change import Change
from partwright.approximation.closed_quadrics import Ball
from partwright.approximation.nearest import Approximation, compared
from partwright.approximation.solid_tree import solid_tree
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.euler_angles import own_axes_angles
from partwright.assembly.instance_patterns import Circle, Grid, Line, Poses, Row
from partwright.assembly.repeated_groups import parts_once
from partwright.atomic_io import write_bytes
from partwright.export.export_report import write_report
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import comment
from partwright.export.pipe_source import build123d_pipe
from partwright.export.profile_source import BUILD123D, BUILD123D_SOURCE, draws_loops, loops
from partwright.export.quadric_facets import few_quadric_facets
from partwright.export.solid_source import (
    SourcePart,
    children_and_poses,
    drawn,
    helper_source,
    literal,
    plain_unions,
    source_parts,
)
from partwright.fields import Extrusion, Pipe, SuperFrustum, Swept
from partwright.fields.extrusion import RIMS
from partwright.meshing.manifolds import surface_of
from partwright.shapes import canonical_unit

if TYPE_CHECKING:
    from manifold3d import Manifold

_SOLIDS = {
    "box": "bd.Box(*{size})",
    "cylinder": "bd.Cylinder({radius}, {height})",
    "cone": "bd.Cone({radius}, 0, {height})",
    "frustum": "bd.Cone({bottom_radius}, {top_radius}, {height})",
    "sphere": "bd.Sphere({radius})",
    "capsule": "bd.Cylinder({radius}, {height})"
    " + [bd.Pos(0, 0, end * {height} / 2) * bd.Sphere({radius}) for end in (-1, 1)]",
    "tube": "bd.Cylinder({radius}, {height}) - bd.Cylinder({radius} - {thickness}, {height})",
    "hollow_box": "bd.Box(*{size})"
    " - bd.Box({size}[0] - 2 * {thickness}, {size}[1] - 2 * {thickness}, {size}[2])",
    "hollow_frustum": "bd.Cone({bottom_radius}, {top_radius}, {height})"
    " - bd.Cone({bottom_radius} - {thickness}, {top_radius} * (1 - {thickness} / {bottom_radius}), {height})",
    "torus": "bd.Torus({major_radius}, {minor_radius})",
    "superfrustum": "superfrustum({size}, {roundness}, {dilation}, {taper}, {bulge}, {onion})",
}
_OPERATORS = {"union": "+", "difference": "-", "intersection": "&"}
_LOOPS = ("pose", "flip")  # variables of loops in which functions of parts are called
_RESERVED = (
    *keyword.kwlist,
    *dir(builtins),
    *_LOOPS,
    "bd",
    "math",
    "path",
    "assembly",
    "superfrustum",
    "loop",
    "grid",
    "polyhedron",
    "bent_path",
)
_TRIANGLES = 800  # for a quadric, at most: OpenCASCADE takes minutes for thousands of faces
_TIGHT = 0.99999  # of a rim's depth, where nothing else would be left between rims
_REACHED = 0.999  # of the way to where a side vanishes, that rims go
_NEARLY = 0.01  # of a frame's width
_GRID = """\
def grid(counts, spacing):
    \"\"\"Places in rows along x, y and z about their middle: how many along each, and how far apart.\"\"\"
    x, y, z = ([(i - (n - 1) / 2) * step for i in range(n)] for n, step in zip(counts, spacing))
    return [(a, b, c) for a in x for b in y for c in z]
"""
_POLYHEDRON = '''\
def polyhedron(points, faces):
    """A solid of flat faces, each the numbers of its corners."""
    return bd.Solid(bd.Shell([bd.Face(bd.Wire.make_polygon([points[i] for i in face])) for face in faces]))
'''


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the source. Run by itself it writes a STEP file beside it; `assembly` is the whole.

    Raises:
        NoSurfaceError: nothing to export.
        SettingError: the assembly's unit is unknown.
        OutputError: the file cannot be written.
    """
    tree, changes = solid_tree(assembly, keep=_kept, source=True)
    facets = _facets(tree)
    for name, (_, off) in facets.items():
        changes.append(Change((name,), "flat facets", max_deviation=off, note="it is no solid of build123d"))
    changes += _sharpened(tree.parts)
    plain = plain_unions(tree)
    parts = source_parts(parts_once(plain), own_axes_angles, _RESERVED)
    unit = canonical_unit(assembly.unit) if assembly.unit else None
    drawing = helper_source(parts, SuperFrustum, "build123d_superfrustum.txt")
    bending = helper_source(parts, Pipe, "build123d_pipe.txt")
    swept = [field for part in parts if isinstance(field := part.part.field, Swept)]
    lines = [
        f"# {comment(assembly.name) or 'Assembly'}: {len(parts)} parts. "
        f"Lengths in {unit or 'an unknown unit'}, angles in degrees.",
        "",
        *(["import math"] if drawing or bending else []),
        "from pathlib import Path",
        "",
        "import build123d as bd",
        "",
        *(line for part in parts for line in _table(part, unit)),
        "",
        *([*drawing, "", ""] if drawing else []),
        *([*bending, "", ""] if bending else []),
        *([*_GRID.splitlines(), "", ""] if any(isinstance(part.copies, Grid) for part in parts) else []),
        *([*BUILD123D_SOURCE.splitlines(), "", ""] if draws_loops(swept) else []),
        *([*_POLYHEDRON.splitlines(), "", ""] if facets else []),
        *(line for part in parts for line in _function(part, facets)),
        f"assembly = {_tree(plain, {p.part.name: p.function for p in parts}, '')}",
        "",
        'if __name__ == "__main__":',
        f'    bd.export_step(assembly, Path(__file__).with_suffix(".step"){_unit_argument(assembly)})',
    ]
    write_bytes(path, ("\n".join(lines) + "\n").encode())
    write_report(assembly, path, changes)


def _facets(tree: Assembly) -> dict[str, tuple[Manifold, float]]:
    """The quadrics without end by their names, as solids, and how far these are off."""
    quadrics = [(part, own) for part in tree.parts if (own := part.field.quadric()) is not None]
    ball = Ball.around(tree) if quadrics else None
    return {part.name: few_quadric_facets(own, part, ball, _TRIANGLES) for part, own in quadrics if ball}


def _kept(part: Part) -> Approximation | None:
    """A quadric without end as it is, what can be lofted, and rims no deeper than all sides of the profile
    reach: OpenCASCADE makes few others by itself."""
    field = part.field
    if field.quadric() is not None and not np.isfinite(field.bounds()).all():
        return Approximation(field, part, 0.0, 0.0)
    if isinstance(field, Extrusion) and field.has_rims and field.collapses:
        most = _REACHED * field.collapses[0]
        less = {name: min(getattr(field, name), most) for name in RIMS}
        return compared(part, dataclasses.replace(field, **less))
    return _lofted(part)


def _lofted(part: Part) -> Approximation | None:
    """As `drawn`; round where it nearly is, because OpenCASCADE fails at unions of thread-like faces."""
    near, f = drawn(part), part.field
    if near is None or not isinstance(f, SuperFrustum) or (f.size[0] == f.size[1] and f.roundness == 1):
        return near
    x, y, z = f.size
    if abs(x - y) > _NEARLY * max(x, y) or f.roundness < 1 - _NEARLY:
        return near
    turned = dataclasses.replace(f, size=((x + y) / 2, (x + y) / 2, z), roundness=1.0)
    return compared(part, turned)


def _unit_argument(assembly: Assembly) -> str:
    names = {"um": "MC", "mm": "MM", "cm": "CM", "m": "M", "in": "IN", "ft": "FT"}
    name = names.get(canonical_unit(assembly.unit)) if assembly.unit else None
    return f", unit=bd.Unit.{name}" if name else ""


def _table(part: SourcePart, unit: str | None) -> Iterator[str]:
    yield f"# {part.title}: {part.part.field.kind}"
    for parameter in part.parameters:
        text, meaning = parameter.line("()", unit)
        text = parameter.same_as.upper() if parameter.same_as else text
        yield f"{parameter.variable.upper()} = {text}  # {meaning}"
    yield ""


def _function(part: SourcePart, facets: Mapping[str, tuple[Manifold, float]]) -> Iterator[str]:
    names = {name: variable.upper() for name, variable in part.variables().items()}
    yield f"def {part.function}():"
    field = part.part.field
    if part.part.name in facets:
        corners, faces = surface_of(facets[part.part.name][0])
        points = literal(tuple(map(tuple, corners.tolist())), "()")
        solid = f"polyhedron({points}, {faces.tolist()})"
    elif isinstance(field, Pipe):
        path, solid = build123d_pipe(names)
        yield f"    path = {path}"
    else:
        solid = _swept(field, names) if isinstance(field, Swept) else _SOLIDS[field.kind].format(**names)
    yield f"    solid = {solid}"
    if isinstance(field, Extrusion) and field.has_rims:
        yield from _rims(field, names)
    yield f"    return {_placed(part, names)}"
    yield ""
    yield ""


def _swept(field: Swept, names: dict[str, str]) -> str:
    flat = " - ".join(loops(field, names, BUILD123D))
    if isinstance(field, Extrusion):
        taper = f", taper={names['taper']}" if "taper" in names else ""
        return f"bd.Pos(0, 0, -{names['height']} / 2) * bd.extrude({flat}, {names['height']}{taper})"
    angle = f", {names['angle']}" if "angle" in names else ""
    return f"bd.revolve(bd.Plane.XZ * ({flat}), bd.Axis.Z{angle})"


def _rims(field: Extrusion, names: dict[str, str]) -> Iterator[str]:
    """Statements that round or cut off the edges at the ends."""
    share = f"{_TIGHT} * " if _is_tight(field) else ""
    for name in RIMS:
        if name in names:
            end, operation = name.split("_")
            edges = f"solid.edges().group_by(bd.Axis.Z)[{-1 if end == 'top' else 0}]"
            yield f"    solid = bd.{operation}({edges}, {share}{names[name]})"


def _is_tight(field: Extrusion) -> bool:
    """Whether rims leave nothing of a wall or a side, which OpenCASCADE cannot do."""
    left = field.height - sum(rim.depth for rim in field.rims)
    sides = field.within(max(rim.depth for rim in field.rims))[0].sides
    shortest = min(math.dist(side.start, side.end) for loop in sides for side in loop)
    return min(left, shortest) < (1 - _TIGHT) * field.profile.size


def _sharpened(parts: Sequence[Part]) -> list[Change]:
    """Extrusions with taper or rims that round inner corners on their way up, which build123d keeps sharp."""
    extruded = ((p.name, p.field) for p in parts if isinstance(p.field, Extrusion))
    rounded = (name for name, f in extruded if (f.taper or f.has_rims) and f.rounds_inner_corners)
    return [Change((name,), "extrusion", note="its inner corners stay sharp") for name in rounded]


def _placed(part: SourcePart, names: dict[str, str]) -> str:
    """The solid in its place, or all of its copies in theirs."""
    turned = f", {names['turn']}" if "turn" in names else ""
    if isinstance(part.copies, Row):
        return f"bd.Part() + [bd.Location(place{turned}) * solid for place in {names['places']}]"
    if isinstance(part.copies, Poses):
        return f"bd.Part() + [bd.Location(*pose) * solid for pose in {names['poses']}]"
    if isinstance(part.copies, Grid):
        one = f"bd.Pos(*{names['middle']}) * bd.Location(place{turned}) * solid"
        return f"bd.Part() + [{one} for place in grid({names['counts']}, {names['spacing']})]"
    if isinstance(part.copies, Circle):
        start = f"{names['start']} + " if "start" in names else ""
        one = f"bd.Rot(Z={start}360 / {names['count']} * i) * bd.Pos(X={names['circle']} / 2) * solid"
        return (
            f"bd.Location({names['centre']}{turned}) * (bd.Part() + [{one} for i in range({names['count']})])"
        )
    first = f"bd.Location({names['place']}{turned}) * solid"
    if part.copies is None:
        return first
    if isinstance(part.copies, Line):
        further = f"bd.Pos(*(i * along for along in {names['step']}))"
        return f"bd.Part() + [{further} * {first} for i in range({names['count']})]"
    turn = f"bd.Rot({part.copies.axis.upper()}=360 / {names['count']} * i)"
    if "centre" in names:
        centre = f"bd.Pos({names['centre']})"
        turn = f"{centre} * {turn} * {centre}.inverse()"
    return f"bd.Part() + [{turn} * {first} for i in range({names['count']})]"


def _tree(node: Node, functions: dict[str, str], indent: str) -> str:
    if isinstance(node, Part):
        return f"{functions[node.name]}()"
    inner = indent + "    "
    first, *others = (
        _repeated(_tree(child, functions, inner), poses, flips)
        for child, poses, flips in children_and_poses(node, own_axes_angles, "()")
    )
    operator = _OPERATORS[node.operation]
    rest = "".join(f"\n{inner}{operator} {other}" for other in others)
    return f"(\n{inner}{first}{rest}\n{indent})"


def _repeated(solid: str, poses: str, flips: bool) -> str:
    if not poses:
        return solid
    if not flips:
        return f"(bd.Part() + [bd.Location(*pose) * {solid} for pose in {poses}])"
    image = "(bd.mirror(solid, about=bd.Plane.YZ) if flip else solid)"
    return f"(bd.Part() + [bd.Location(*pose) * {image} for solid in [{solid}] for *pose, flip in {poses}])"


FORMAT = Format(
    "build123d",
    write,
    frozenset({Holds.NAMES, Holds.COPIES, Holds.PARAMETERS, Holds.EXACT, Holds.SUBTRACTION, Holds.LEARNED}),
)
