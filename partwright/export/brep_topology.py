"""What a B-rep shape consists of, and several as one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from partwright.shapes.step import parts_of

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Solid

_INTEGRATED = 1e-6  # relative error of volumes; without it B-splines are integrated to 1 %


def faces_of(shape: TopoDS_Shape) -> Iterator[TopoDS_Face]:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    yield from map(TopoDS.Face, parts_of(shape, TopAbs_ShapeEnum.TopAbs_FACE))


def edges_of(shape: TopoDS_Shape) -> Iterator[TopoDS_Edge]:
    """Each once for every face that it bounds."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    yield from map(TopoDS.Edge, parts_of(shape, TopAbs_ShapeEnum.TopAbs_EDGE))


def solids_of(shape: TopoDS_Shape) -> Iterator[TopoDS_Solid]:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    yield from map(TopoDS.Solid, parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID))


def side_by_side(shapes: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    """As a compound, unless there is but one."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    if len(shapes) == 1:
        return shapes[0]
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def volume_and_area(shape: TopoDS_Shape) -> tuple[float, float]:
    return volume_of(shape), area_of(shape)


@lru_cache(maxsize=128)
def volume_of(shape: TopoDS_Shape) -> float:
    """Kept: it takes long, and is asked for as an operation's result, as the next one's operand, and at the
    end."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    volume = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume, _INTEGRATED)
    return float(volume.Mass())


@lru_cache(maxsize=128)
def area_of(shape: TopoDS_Shape) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    area = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, area)
    return float(area.Mass())
