"""STEP (AP214): exact B-rep solids with analytic faces, one named product in the assembly's own unit.

Straight parts are exact, whatever their taper, hole, rounding and dilation, and so are bent ones without
taper, and quadrics (saddles and their like are refused). Bent ones with taper are surfaces through sections;
what cannot be built becomes the nearest solid, and where a boolean operation goes wrong, or the file does not
read as a valid solid of its volume, flat facets of the exact mesh stand for it. Further tries have a budget
(brep_booleans). Blends become sharp edges. FILE.report.json lists all but the exact.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright import __version__
from partwright.approximation.change import Change
from partwright.approximation.closed_quadrics import Ball
from partwright.approximation.solid_tree import solid_tree
from partwright.assembly import Assembly, Node
from partwright.atomic_io import replacing
from partwright.errors import NoSurfaceError, OutputError
from partwright.export.brep import built
from partwright.export.brep_facets import FacetsWarning, faceted
from partwright.export.brep_healing import SHORT, without_short_edges
from partwright.export.brep_rims import SHALLOW
from partwright.export.brep_swept_profile import has_common_rims
from partwright.export.brep_topology import faces_of, volume_of
from partwright.export.brep_tree import Compromises, combined, volume_off
from partwright.export.export_report import write_report
from partwright.export.formats import Format, Holds
from partwright.fields import Extrusion, Field
from partwright.meshing import has_exact_mesh
from partwright.shapes import METRES, canonical_unit

if TYPE_CHECKING:
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopoDS import TopoDS_Shape

_MOST_AGAIN = 30  # parts: more would take minutes
_RESORTED = (
    "what OpenCASCADE makes of its surfaces does not read as a valid solid, so flat facets stand for all"
)
_RESORTED_VOLUME = (
    "what OpenCASCADE makes of its surfaces reads as a solid of another volume, so flat facets stand for all"
)
_OTHER_VOLUME = (
    "the file reads as a solid whose volume is off by {:+.1f} %; move parts a little that nearly touch, or "
    "export a mesh"
)
_NOT_VALID = (
    "the file does not read as a valid solid; move parts a little that nearly touch, or export a mesh"
)
_SPENT = "boolean operations that went wrong were tried again only until the budget for that was spent"
# OpenCASCADE works in millimetres with an absolute tolerance of 1e-7, so all lengths are brought to it. What
# is smaller than this is made larger by a power of ten until it is written: unions of shapes that are one or
# two long went wrong, and the same right when they were a hundred.
_WORKING, _LARGE = METRES["mm"], 100.0
_UNITS = {"um": "UM", "mm": "MM", "cm": "CM", "m": "M", "km": "KM", "in": "INCH", "ft": "FT"}


def write(assembly: Assembly, path: str | Path, separate: bool = False) -> None:
    """Write the assembly as one product; with `separate`, each child of its union as one of its own.

    Raises:
        NoSurfaceError: nothing to export, or a part is too thin for a B-rep.
        OutputError: the file cannot be written.

    Warns:
        FacetsWarning: facets stand for all of a product, or the file does not read as a valid solid
            of its volume.
    """
    unit = canonical_unit(assembly.unit) if assembly.unit else None
    larger = _enlargement(assembly, METRES[unit] / _WORKING if unit else 1.0)
    scale = larger * (METRES[unit] / _WORKING if unit else 1.0)
    scaled, changes = solid_tree(assembly.scaled(scale), built, 1 / scale)
    changes = [_with_note(change, assembly.scaled(scale), scaled) for change in changes]
    mitred = [part.name for part in scaled.parts if _is_mitred(part.field)]
    if mitred:
        note = "about sharp inner corners its fillets and chamfers meet in a mitre"
        changes.append(Change(tuple(mitred), "extrusion", note=note))
    children = scaled.children if separate and scaled.operation == "union" else (scaled,)
    names = [child.name or f"assembly_{i:02d}" for i, child in enumerate(children, 1)]
    if children == (scaled,):
        names = [assembly.name or Path(path).stem]
    ball = Ball.around(scaled)

    def save(solids: list[TopoDS_Shape], file: Path) -> float | None:
        _write(_document(list(zip(names, solids, strict=True)), larger), file, unit or "mm", Path(path))
        volume = _volume_read(file)
        return None if volume is None else volume * larger**3

    with replacing(path) as temporary:
        made, resorted = _saved(children, ball, temporary, save, len(scaled) <= _MOST_AGAIN)
    changes += resorted
    for change in resorted:
        warnings.warn(f"{', '.join(names)}: {change.note}", FacetsWarning, stacklevel=2)
    notes = [] if unit else ["the length unit is unknown: the file says millimetres"]
    if made.repairs.spent:
        notes.append(_SPENT)
    if made.apart:
        overlap = "it stands beside the rest: the union failed"
        changes.append(Change(tuple(made.apart), "a solid of its own", note=overlap))
    for moved, distance in made.moved:
        note = "they nearly touch: some are moved by this much to be joined"
        changes.append(Change(tuple(moved), "the same, moved", max_deviation=distance / scale, note=note))
    if made.faceted:
        wrong = "OpenCASCADE gets their boolean operations wrong"
        changes.append(Change(tuple(made.faceted), "flat facets", note=wrong))
    write_report(assembly, path, changes, notes)


def _saved(
    products: Sequence[Node],
    ball: Ball,
    path: Path,
    save: Callable[[list[TopoDS_Shape], Path], float | None],
    again: bool,
) -> tuple[Compromises, list[Change]]:
    """Saves the products so that the file reads as valid solids of their volumes: as they are, without edges
    that are too short, with wider tolerances (again: whether to try those), as facets; and what that cost. As
    they are where nothing helps, which is told. save: it returns the volume that the file reads as."""
    made = Compromises()
    solids = [combined(product, ball, made) for product in products]
    off = _off(save(solids, path), products, solids, made)
    if off == 0:
        return made, []
    spare = path.with_name(f"{path.name}.again")
    try:
        for share in SHORT if off is None else ():
            healed = [without_short_edges(solid, share) for solid in solids]
            if _off(save(healed, spare), products, solids, made) == 0:
                spare.replace(path)
                return made, []
        if again and not made.repairs.spent:  # slivers that the file's digits lose
            rough = Compromises(rough=True, repairs=made.repairs)
            solids = [combined(product, ball, rough) for product in products]
            if _off(save(solids, spare), products, solids, rough) == 0:
                spare.replace(path)
                return rough, []
        parts = tuple(part.name for product in products for part in product.parts)
        if all(has_exact_mesh(product) and np.isfinite(product.bounds()).all() for product in products):
            with contextlib.suppress(NoSurfaceError):  # of facets that are too small; told below
                solids = [faceted(product, fine=True) for product in products]
                if _off(save(solids, spare), products, solids, Compromises(faceted=list(parts))) == 0:
                    spare.replace(path)
                    note = _RESORTED if off is None else _RESORTED_VOLUME
                    return Compromises(repairs=made.repairs), [Change(parts, "flat facets", note=note)]
        if off is not None:
            note = _OTHER_VOLUME.format(100 * off)
            return made, [Change(parts, "a solid of another volume", note=note)]
        return made, [Change(parts, "a solid that is not valid", note=_NOT_VALID)]
    finally:
        spare.unlink(missing_ok=True)


def _off(
    volume: float | None, products: Sequence[Node], solids: Sequence[TopoDS_Shape], made: Compromises
) -> float | None:
    """By which share a volume that these solids' file reads as is off, 0 as far as it may be.

    None where it does not read as valid solids."""
    return None if volume is None else volume_off(products, volume, solids, made)


def _volume_read(path: Path) -> float | None:
    """That of the solids that OpenCASCADE reads from a STEP file; None where it does not find them valid.

    Valid says little of the volume: a face may bound the wrong side of its edges."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape.IsNull() or not BRepCheck_Analyzer(shape).IsValid():
        return None
    return volume_of(shape)


def _enlargement(assembly: Assembly, working: float) -> float:
    """Power of ten by which an assembly is made larger. working: the length of its unit in those it is built
    in."""
    longest = working * float(np.ptp(np.array(assembly.bounds()), axis=0).max(initial=0.0))
    if not math.isfinite(longest) or longest <= 0:
        return 1.0
    return 10.0 ** max(0, math.ceil(math.log10(_LARGE / longest)))


def _with_note(change: Change, assembly: Assembly, made: Assembly) -> Change:
    """Which says so where rims are less deep."""
    given, own = ({part.name: part.field for part in one.parts} for one in (assembly, made))
    for name in change.what:
        before, after = given.get(name), own.get(name)
        if isinstance(before, Extrusion) and isinstance(after, Extrusion) and before.rims != after.rims:
            return dataclasses.replace(change, note=SHALLOW)
    return change


def _is_mitred(field: Field) -> bool:
    """Whether OpenCASCADE makes its rims by itself, another way than the field has them."""
    if not isinstance(field, Extrusion) or not field.has_rims:
        return False
    return field.rounds_inner_corners and has_common_rims(field)


def _document(products: list[tuple[str, TopoDS_Shape]], larger: float) -> TDocStd_Document:
    """larger: times that shapes are as large as they are to be read."""
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, _WORKING / larger)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for name, shape in products:
        label = shapes.AddShape(_readable(shape), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))
    return document


def _readable(shape: TopoDS_Shape) -> TopoDS_Shape:
    """With faces of at most half a turn where some are arcs turned whose circle would cross the axis.

    OpenCASCADE's own reader loses one that closes in itself and has a tip."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_CurveType, GeomAbs_SurfaceType
    from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideAngle

    for face in faces_of(shape):
        surface = BRepAdaptor_Surface(face)
        turned = surface.GetType() == GeomAbs_SurfaceType.GeomAbs_SurfaceOfRevolution
        if turned and surface.BasisCurve().GetType() == GeomAbs_CurveType.GeomAbs_BSplineCurve:
            divided = ShapeUpgrade_ShapeDivideAngle(math.pi, shape)
            return divided.Result() if divided.Perform() else shape
    return shape


def _write(document: TDocStd_Document, path: Path, unit: str, wanted: Path) -> None:
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.Message import Message, Message_Gravity
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_HAsciiString

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    Interface_Static.SetCVal_s("write.step.unit", _UNITS[unit])
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(TCollection_HAsciiString(wanted.name.encode("ascii", "replace").decode()))
    header.SetTimeStamp(TCollection_HAsciiString("1970-01-01T00:00:00"))  # same assembly, same bytes
    header.SetOriginatingSystem(TCollection_HAsciiString(f"Partwright {__version__}"))
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise OutputError(f"cannot write {wanted}; choose another place with -o")


FORMAT = Format(
    "STEP",
    write,
    frozenset({Holds.EXACT, Holds.LEARNED}),
    units=tuple(_UNITS),
    most=1000,  # the time of OpenCASCADE's unions grows with the square
    needs=("OCP.TopoDS", "cad"),
)
