"""An assembly to start from: its surface, on which quadrics are detected beside the shape's own."""

from __future__ import annotations

from dataclasses import replace

from partwright.assembly import Assembly
from partwright.capri import oriented_points
from partwright.capri.oriented_points import OrientedPoints
from partwright.shapes import Shape, load_shape


def start_surface(start: Assembly, shape: Shape, count: int, seed: int) -> OrientedPoints:
    """`count` points of an assembly's surface, in the unit frame of the shape that it stands for.

    Raises NoSurfaceError where the assembly has none.
    """
    from partwright.meshing import mesh_assembly

    own = load_shape(mesh_assembly(start))
    drawn = oriented_points.sample_surface(own, count, seed)
    ratio = shape.frame.scale / own.frame.scale
    points = shape.frame.to_unit(own.frame.from_unit(drawn.points))
    return replace(drawn, points=points, area=drawn.area * ratio**2)
