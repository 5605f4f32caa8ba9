"""STEP files to triangles, by OpenCASCADE of the `cad` extra: a named piece a solid, the file's own unit.

OpenCASCADE follows wrong references into memory that is not its own, so `step_process` has it run by itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import EmptyShapeError, SettingError, UnreadableFileError
from partwright.shapes.source import Piece, Source
from partwright.shapes.units import METRES, canonical_unit

if TYPE_CHECKING:
    from OCP.TDF import TDF_Label
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Shape

TOLERANCE = 5e-4  # of the diagonal of the bounding box: how far triangles may lie off the surface
NO_NAMES = ("", "SOLID", "COMPOUND", "SHELL", "FACE")  # what CAD programs write where there is no name
ANGLE = 0.3  # radians between neighbouring triangles of a curved face
_TRIED = (1.0, 2.0, 0.5, 4.0)  # of the tolerance: OpenCASCADE leaves out faces though they are valid


def source_of_step(path: Path) -> Source:
    """What `read_step` gives, in this process: damaged references may end it."""
    document, unit = _read(path)
    solids = list(_named_solids(document))
    meshes = _meshes([solid for _, solid in solids])  # none, where nothing has a size
    scale = METRES["mm"] / METRES[unit]  # OpenCASCADE converts to millimetres
    taken: set[str] = set()
    pieces = tuple(
        Piece(_free(name, taken), scale * vertices, faces)
        for (name, _), (vertices, faces) in zip(solids, meshes, strict=False)
        if len(faces)
    )
    if not pieces:
        raise EmptyShapeError(f"{path}: holds no faces; export the solid again as AP214 or AP242")
    return Source(path.stem, pieces, unit)


def _read(path: Path) -> tuple[TDocStd_Document, str]:
    """The document, in millimetres, and the unit that the file is written in."""
    from OCP.collections import Sequence_TCollection_AsciiString as Strings
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Message import Message, Message_Gravity
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone or not reader.Transfer(document):
        raise UnreadableFileError(f"{path}: cannot be read as STEP; the file is damaged or of another format")
    lengths, angles, solid_angles = Strings(), Strings(), Strings()
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles)
    return document, _unit(lengths.Value(1).ToCString() if lengths.Length() else "mm")


def _unit(stated: str) -> str:
    """One of `METRES`; a unit that is none of them is read as the millimetres it was converted to."""
    try:
        return canonical_unit(stated)
    except SettingError:
        return "mm"


def _named_solids(document: TDocStd_Document) -> Iterator[tuple[str, TopoDS_Shape]]:
    from OCP.collections import Sequence_TDF_Label
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    free = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(free)
    for label in free:
        yield from _solids_below(label, TopLoc_Location(), "")


def _solids_below(label: TDF_Label, place: TopLoc_Location, name: str) -> Iterator[tuple[str, TopoDS_Shape]]:
    """Solids of a label and of the components of an assembly, each moved to its place."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.TDF import TDF_Label
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    name = _name(label, name)
    if XCAFDoc_ShapeTool.IsAssembly_s(label):
        components = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        for component in components:
            product = TDF_Label()
            XCAFDoc_ShapeTool.GetReferredShape_s(component, product)
            there = place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(component))
            yield from _solids_below(product, there, _name(component, name))
        return
    shape = XCAFDoc_ShapeTool.GetShape_s(label).Moved(place)
    solids = list(parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID))
    for solid in solids or [shape]:
        yield name or "solid", solid


def parts_of(shape: TopoDS_Shape, kind: object) -> Iterator[TopoDS_Shape]:
    """Of one kind of OpenCASCADE's `TopAbs_ShapeEnum`."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _name(label: TDF_Label, otherwise: str) -> str:
    from OCP.TCollection import TCollection_AsciiString
    from OCP.TDataStd import TDataStd_Name

    attribute = TDataStd_Name()
    if not label.FindAttribute(TDataStd_Name.GetID_s(), attribute):
        return otherwise
    name = TCollection_AsciiString(attribute.Get()).ToCString().strip()
    return otherwise if name in NO_NAMES else name


def _free(name: str, taken: set[str]) -> str:
    free = next(n for i in count(1) if (n := name if i == 1 else f"{name}_{i:02d}") not in taken)
    taken.add(free)
    return free


def _meshes(solids: list[TopoDS_Shape]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Vertices (V, 3) and faces (F, 3) of each; what is placed several times is tessellated once."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.TopLoc import TopLoc_Location

    box = Bnd_Box()
    for solid in solids:
        BRepBndLib.Add_s(solid, box)
    if box.IsVoid():
        return
    deflection = TOLERANCE * float(np.sqrt(box.SquareExtent()))
    made: dict[object, tuple[np.ndarray, np.ndarray]] = {}
    for solid in solids:
        key = solid.TShape(), solid.Orientation()
        if key not in made:
            made[key] = _mesh(solid.Located(TopLoc_Location()), deflection)
        (vertices, faces), move = made[key], solid.Location().Transformation()
        matrix = np.array([[move.Value(i, j) for j in range(1, 5)] for i in range(1, 4)])
        yield vertices @ matrix[:, :3].T + matrix[:, 3], faces


def _mesh(solid: TopoDS_Shape, deflection: float) -> tuple[np.ndarray, np.ndarray]:
    """At the first tolerance that leaves no face without triangles, or that leaves the fewest. All faces
    are made each time: one that another solid has, too, may be there at another tolerance."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools

    best, least = (np.zeros((0, 3)), np.zeros((0, 3), np.int64)), math.inf
    for share in _TRIED:
        BRepTools.Clean_s(solid)
        BRepMesh_IncrementalMesh(solid, share * deflection, False, ANGLE, False)
        left_out = _left_out(solid)
        if left_out < least:
            best, least = _triangles(solid), left_out
        if not left_out:
            break
    return best


def _left_out(solid: TopoDS_Shape) -> int:
    """How many of its faces have no triangles."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    faces = parts_of(solid, TopAbs_ShapeEnum.TopAbs_FACE)
    meshes = (BRep_Tool.Triangulation_s(TopoDS.Face(face), TopLoc_Location()) for face in faces)
    return sum(mesh is None or not mesh.NbTriangles() for mesh in meshes)


def _triangles(shape: TopoDS_Shape) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and faces (F, 3) of a tessellated shape; neighbouring faces share the edge's points."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    vertices: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    for face in parts_of(shape, TopAbs_ShapeEnum.TopAbs_FACE):
        place = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(TopoDS.Face(face), place)
        if mesh is None:
            continue
        move, first = place.Transformation(), len(vertices) - 1
        for i in range(1, mesh.NbNodes() + 1):
            point = mesh.Node(i).Transformed(move)
            vertices.append((point.X(), point.Y(), point.Z()))
        flipped = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        for i in range(1, mesh.NbTriangles() + 1):
            a, b, c = mesh.Triangle(i).Get()
            faces.append((a + first, c + first, b + first) if flipped else (a + first, b + first, c + first))
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    return points, np.array(faces, dtype=np.int64).reshape(-1, 3)
