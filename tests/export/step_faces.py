"""What OpenCASCADE itself reads from a STEP file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

ANALYTIC = {"Plane", "Cylinder", "Cone", "Sphere", "Torus"}


def read_back(path: Path) -> tuple[float, Counter[str]]:
    """Volume in cubic millimetres and the kinds of faces, by OpenCASCADE's plain reader."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    assert BRepCheck_Analyzer(shape).IsValid()
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties, 1e-6)  # B-splines need it
    kinds: Counter[str] = Counter()
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        kinds[str(BRepAdaptor_Surface(TopoDS.Face(faces.Current())).GetType()).rsplit("_", 1)[-1]] += 1
        faces.Next()
    return properties.Mass(), kinds
