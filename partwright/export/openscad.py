"""OpenSCAD source to go on with by hand: parameters on top, one module a part with a loop over its copies,
the tree at the end.

Named solids and SuperFrusta are exact, to the facets of `$fn`, and so are extrusions, revolutions, planes,
cylinders, cones and spheres (of quadrics). Other quadrics, and extrusions with taper, are polyhedra, fillets
and chamfers of extrusions slices; what `drawn` refuses becomes the nearest solid, and blends sharp edges:
FILE.report.json lists them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.approximation.change import Change
from partwright.approximation.closed_quadrics import Ball
from partwright.approximation.nearest import Approximation
from partwright.approximation.solid_tree import solid_tree
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.euler_angles import fixed_axes_angles
from partwright.assembly.instance_patterns import Circle, Grid, Line, Poses, Ring, Row
from partwright.assembly.repeated_groups import parts_once
from partwright.atomic_io import write_bytes
from partwright.errors import ParameterError
from partwright.export.export_report import write_report
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import comment
from partwright.export.pipe_source import scad_pipe
from partwright.export.profile_source import SCAD, SCAD_RIMS, SCAD_SOURCE, draws_loops, loops
from partwright.export.quadric_facets import quadric_facets
from partwright.export.solid_source import (
    SourcePart,
    children_and_poses,
    drawn,
    helper_source,
    number,
    plain_unions,
    source_parts,
)
from partwright.fields import Extrusion, Field, Pipe, Profile, SuperFrustum, Swept
from partwright.fields.profile_offset import turn_between
from partwright.meshing.manifolds import surface_of
from partwright.meshing.named_solids import named_solid
from partwright.shapes import canonical_unit

if TYPE_CHECKING:
    from manifold3d import Manifold

_SOLIDS = {
    "box": "cube({size}, center = true);",
    "cylinder": "cylinder(r = {radius}, h = {height}, center = true);",
    "cone": "cylinder(r1 = {radius}, r2 = 0, h = {height}, center = true);",
    "frustum": "cylinder(r1 = {bottom_radius}, r2 = {top_radius}, h = {height}, center = true);",
    "sphere": "sphere(r = {radius});",
    "capsule": "hull() {{\n"
    "            translate([0, 0, {height} / 2]) sphere(r = {radius});\n"
    "            translate([0, 0, -{height} / 2]) sphere(r = {radius});\n"
    "        }}",
    "tube": "difference() {{\n"
    "            cylinder(r = {radius}, h = {height}, center = true);\n"
    "            cylinder(r = {radius} - {thickness}, h = 2 * {height}, center = true);\n"
    "        }}",
    "hollow_box": "linear_extrude(height = {size}[2], center = true) difference() {{\n"
    "            square([{size}[0], {size}[1]], center = true);\n"
    "            square([{size}[0] - 2 * {thickness}, {size}[1] - 2 * {thickness}], center = true);\n"
    "        }}",
    "hollow_frustum": "rotate_extrude() polygon([\n"
    "            [{bottom_radius} - {thickness}, -{height} / 2],\n"
    "            [{bottom_radius}, -{height} / 2],\n"
    "            [{top_radius}, {height} / 2],\n"
    "            [{top_radius} * (1 - {thickness} / {bottom_radius}), {height} / 2]\n"
    "        ]);",
    "torus": "rotate_extrude() translate([{major_radius}, 0]) circle(r = {minor_radius});",
    "superfrustum": "superfrustum({size}, {roundness}, {dilation}, {taper}, {bulge}, {onion});",
}
_RESERVED = (
    "module function if else for let assert echo each true false undef include use union difference "
    "intersection translate rotate scale mirror hull minkowski cube sphere cylinder polyhedron circle "
    "square polygon text color offset resize render children import projection surface linear_extrude "
    "rotate_extrude multmatrix intersection_for group version end superfrustum loop side_points "
    "extrude_with_rims rim_slices rim_point grid pipe_along"
)
_GRID = """\
// Places in rows along x, y and z about their middle: how many along each, and how far apart.
function grid(counts, spacing) = [
    for (i = [0 : counts[0] - 1], j = [0 : counts[1] - 1], k = [0 : counts[2] - 1])
        [for (axis = [0 : 2]) ([i, j, k][axis] - (counts[axis] - 1) / 2) * spacing[axis]]
];
"""


def write(assembly: Assembly, path: str | Path, facets: int = 96) -> None:
    """Write the source; `facets` is the number of facets of a full circle.

    Raises:
        NoSurfaceError: nothing to export.
        SettingError: the assembly's unit is unknown.
        ParameterError: fewer than 3 facets.
        OutputError: the file cannot be written.
    """
    if facets < 3:
        raise ParameterError(f"facets: expected at least 3 of a full circle, got {facets}")
    tree, changes = solid_tree(assembly, keep=_kept, source=True)
    ball = Ball.around(tree)
    polyhedra = [part for part in tree.parts if part.field.quadric() is not None or _leans(part.field)]
    changes += [Change((part.name,), "mesh", note=f"{facets} facets to a full turn") for part in polyhedra]
    sliced = [part for part in tree.parts if _has_rims(part.field)]
    changes += [Change((part.name,), "slices", note="its fillets and chamfers are slices") for part in sliced]
    plain = plain_unions(tree)
    parts = source_parts(parts_once(plain), fixed_axes_angles, _RESERVED.split())
    unit = canonical_unit(assembly.unit) if assembly.unit else None
    lines = [
        f"// {comment(assembly.name) or 'Assembly'}: {len(parts)} parts. "
        f"Lengths in {unit or 'an unknown unit'}, angles in degrees.",
        "",
        f"$fn = {facets};  // facets of a full circle",
        "",
        *(line for part in parts for line in _table(part, unit)),
        *_tree(plain, {p.part.name: p.function for p in parts}, ""),
        "",
        *(line for part in parts for line in _module(part, ball, facets)),
        *helper_source(parts, SuperFrustum, "superfrustum.scad"),
        *helper_source(parts, Pipe, "pipe.scad"),
        *(SCAD_RIMS.splitlines() if any(_has_rims(part.part.field) for part in parts) else []),
        *(_GRID.splitlines() if any(isinstance(part.copies, Grid) for part in parts) else []),
        *(SCAD_SOURCE.splitlines() if draws_loops(_drawn_swept(parts)) else []),
    ]
    write_bytes(path, ("\n".join(lines).rstrip() + "\n").encode())
    write_report(assembly, path, changes)


def _drawn_swept(parts: list[SourcePart]) -> list[Swept]:
    return [f for part in parts if isinstance(f := part.part.field, Swept) and not _leans(f)]


def _table(part: SourcePart, unit: str | None) -> Iterator[str]:
    yield f"// {part.title}: {part.part.field.kind}"
    for parameter in part.parameters:
        text, meaning = parameter.line("[]", unit)
        yield f"{parameter.variable} = {text};  // {meaning}"
    yield ""


def _kept(part: Part) -> Approximation | None:
    return drawn(part) if part.field.quadric() is None else Approximation(part.field, part, 0.0, 0.0)


def _module(part: SourcePart, ball: Ball, facets: int) -> Iterator[str]:
    names, field = part.variables(), part.part.field
    quadric = field.quadric()
    if quadric is not None:
        solid = _faces(quadric_facets(quadric, part.part, ball, facets))
    elif isinstance(field, Swept):
        solid = _swept(field, names, facets)
    elif isinstance(field, Pipe):
        solid = scad_pipe(names)
    else:
        solid = _SOLIDS[field.kind].format(**names)
    yield f"module {part.function}() {{  // {part.title}"
    yield from (f"    {line}" for line in _loop(part, names))
    yield f"        {solid}"
    yield "}"
    yield ""


def _loop(part: SourcePart, names: dict[str, str]) -> Iterator[str]:
    """What puts the solid, or each of its copies, in its place."""
    turned = f" rotate({names['turn']})" if "turn" in names else ""
    if isinstance(part.copies, Row):
        yield f"for (place = {names['places']}) translate(place){turned}"
    elif isinstance(part.copies, Line):
        yield f"for (i = [0 : {names['count']} - 1])"
        yield f"translate({names['place']} + i * {names['step']}){turned}"
    elif isinstance(part.copies, Grid):
        yield f"for (place = grid({names['counts']}, {names['spacing']}))"
        yield f"translate({names['middle']} + place){turned}"
    elif isinstance(part.copies, Circle):
        start = f"{names['start']} + " if "start" in names else ""
        yield f"translate({names['centre']}){turned} for (i = [0 : {names['count']} - 1])"
        yield f"rotate({start}360 / {names['count']} * i) translate([{names['circle']} / 2, 0, 0])"
    elif isinstance(part.copies, Poses):
        yield f"for (pose = {names['poses']}) translate(pose[0]) rotate(pose[1])"
    else:
        if isinstance(part.copies, Ring):
            angle = f"360 / {names['count']} * i"
            turn = f"rotate([{', '.join(angle if axis == part.copies.axis else '0' for axis in 'xyz')}])"
            centre = names.get("centre")
            turn = f"translate({centre}) {turn} translate(-{centre})" if centre else turn
            yield f"for (i = [0 : {names['count']} - 1]) {turn}"
        yield f"translate({names['place']}){turned}"


def _leans(field: Field) -> bool:
    """An extrusion with taper, which OpenSCAD has no word for."""
    return isinstance(field, Extrusion) and field.taper > 0


def _swept(field: Swept, names: dict[str, str], facets: int) -> str:
    if _leans(field):
        return _faces(named_solid(field, field.profile.size / 2 * (1 - math.cos(math.pi / facets))))
    outline, *holes = loops(field, names, SCAD)
    flat = outline
    if holes:
        flat = "difference() {\n" + "".join(f"            {one}\n" for one in (outline, *holes)) + "        }"
    if isinstance(field, Extrusion) and field.has_rims:
        bottom, top = (
            f"[{names.get(f'{end}_fillet', 0)}, {names.get(f'{end}_chamfer', 0)}]"
            for end in ("bottom", "top")
        )
        convex = "true" if _is_convex(field.profile) else "false"
        return f"extrude_with_rims({names['height']}, {bottom}, {top}, convex = {convex}) {flat}"
    if isinstance(field, Extrusion):
        return f"linear_extrude(height = {names['height']}, center = true) {flat}"
    angle = f"angle = {names['angle']}" if "angle" in names else ""
    return f"rotate_extrude({angle}) {flat}"


def _has_rims(field: Field) -> bool:
    return isinstance(field, Extrusion) and field.has_rims


def _is_convex(profile: Profile) -> bool:
    (sides, *holes) = profile.sides
    bends = (turn_between(before, after) for before, after in zip((sides[-1], *sides), sides, strict=False))
    return not holes and all(side.sweep >= 0 for side in sides) and all(bend > -1e-6 for bend in bends)


def _faces(solid: Manifold) -> str:
    vertices, faces = surface_of(solid)
    points = ", ".join(f"[{', '.join(map(number, p))}]" for p in vertices.tolist())
    clockwise = faces[:, ::-1].tolist()  # as OpenSCAD has them
    return f"polyhedron(points = [{points}], faces = {clockwise});"


def _tree(node: Node, modules: dict[str, str], indent: str) -> Iterator[str]:
    if isinstance(node, Part):
        yield f"{indent}{modules[node.name]}();"
        return
    yield f"{indent}{node.operation}() {{" + (f"  // {comment(node.name)}" if node.name else "")
    for child, poses, flips in children_and_poses(node, fixed_axes_angles, "[]"):
        inner = indent + "    "
        if poses:
            flip = " mirror([pose[2], 0, 0])" if flips else ""
            yield f"{inner}for (pose = {poses}) translate(pose[0]) rotate(pose[1]){flip}"
            inner += "    "
        yield from _tree(child, modules, inner)
    yield indent + "}"


FORMAT = Format(
    "OpenSCAD",
    write,
    frozenset({Holds.NAMES, Holds.COPIES, Holds.PARAMETERS, Holds.EXACT, Holds.SUBTRACTION, Holds.LEARNED}),
)
