"""Triangle soup to a surface with an inside, and in plain words what had to be done.

Everything here works in the unit frame, so that its few tolerances mean the same for a ring and for a ship.
Geometry is moved only where it is open: closed thin walls come out as they went in.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from partwright.errors import EmptyShapeError, FlatShapeError, OpenShellError
from partwright.shapes.boolean import unite
from partwright.shapes.cleaning import counted, drop_doubles, merge_vertices, weld_boundary
from partwright.shapes.distance import MeshDistance
from partwright.shapes.frame import UnitFrame
from partwright.shapes.hidden_faces import Ground, close_hidden, drop_sheets, lift_from_ground
from partwright.shapes.holes import Openings, fill_holes, openings_of, with_what_stays_open
from partwright.shapes.orientation import orient
from partwright.shapes.outer_faces import facing, outer_faces
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.sealing import GAP, seal
from partwright.shapes.thickening import thicken
from partwright.shapes.topology import (
    EdgeTable,
    doubled_areas,
    is_plane,
    signed_volumes,
)
from partwright.shapes.winding import winding_grid

_SAME_FRAME = 1e-4  # of the scale, and unit lengths: vertices are welded and middles added within it
_NO_VOLUME = 1e-9
_LEAST_CONFIDENCE, _SURE = 0.5, 0.8  # of the winding number
_CLEAR = 0.2  # a winding number this near to 0 or 1 is clear
_CHECK = 64  # cells along a side in the search for overlaps
_THICKEN = "give its sheets a thickness (partwright fit --thickness 1%)"
_SAY_UP = " say which way is up if it is only open below (--up z),"
_PROBES = 8  # triangles of a patch that are looked at to see whether it is a wall


@dataclass(frozen=True)
class Surface:
    """A repaired surface in the unit frame.

    `faces` is the outer surface. `winding_faces` decide the inside and may hold sheets within the shape as
    well; with `closed` they have no open edge. `simple`: no point is enclosed twice, so volume is a sum over
    `faces`. `openings`: what of the surface was missing. `left_out`: share of the area that sheets took, and
    that is no part of it. `sealed`: it is not of the triangles given, but of the solid that is seen in them.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    winding_faces: NDArray[np.int64]
    closed: bool
    simple: bool
    repairs: tuple[str, ...]
    confidence: float
    openings: Openings = field(default_factory=Openings)
    left_out: float = 0.0
    sealed: bool = False

    def in_frame(self, old: UnitFrame) -> tuple[UnitFrame, Surface]:
        """The unit frame of the surface alone, where sheets were left out of the shape that had the old one;
        and the surface in it."""
        own = old.from_unit(self.vertices)
        new = UnitFrame.of(own)
        if np.isclose(new.scale, old.scale, rtol=_SAME_FRAME) and np.allclose(
            new.to_unit(old.centre), 0, atol=_SAME_FRAME
        ):
            return old, self
        openings = self.openings
        if openings.largest is not None:
            x, y, z = new.to_unit(old.from_unit(openings.largest)).tolist()
            openings = replace(openings, largest=(x, y, z))
        return new, replace(self, vertices=new.to_unit(own), openings=openings)

    def distance(self) -> MeshDistance:
        """The distance source of this surface."""
        return MeshDistance(self.vertices, self.faces, self.winding_faces, self.closed, embedded=self.simple)


def repair(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    ground: Ground | None = None,
    wall: float | None = None,
    *,
    sealing: bool = True,
) -> Surface:
    """Surface of the solid that the triangles mean; vertices (V, 3) in the unit frame, faces (F, 3).

    ground: where it is known, what opens onto it is closed. wall: the thickness, unit lengths, of what is
    still open then and of flat sheets; None: they are closed, or left out. sealing: whether what is open in
    many places is sealed, where a solid is seen in it.

    Raises EmptyShapeError when no triangle has area, FlatShapeError when nothing is enclosed, OpenShellError
    when the openings are so large that inside and outside cannot be told apart.
    """
    notes: list[str] = []
    if wall is None:
        _refuse_plane(vertices)
    vertices, faces = merge_vertices(vertices, faces, notes)
    faces, two_sided = drop_doubles(faces, notes)
    left_out = _area(vertices, two_sided)
    if wall is not None:
        faces = np.concatenate([faces, two_sided])
    if len(faces) == 0:
        raise EmptyShapeError("no triangle has any area; export the shape again with its surface")
    vertices, edges = weld_boundary(vertices, EdgeTable(faces), notes)
    edges = orient(vertices, edges, notes)
    if edges.balance.any():
        edges, lying = lift_from_ground(vertices, edges, ground)
        vertices, edges = close_hidden(vertices, edges, ground, notes)
    else:
        lying = edges.faces[:0]
    if wall is not None:
        edges = EdgeTable(np.concatenate([edges.faces, lying]))
        return _enclosed(*thicken(vertices, edges, wall, notes), ground, notes, sealing=sealing)
    if len(lying):
        notes.append("left out what lies flat on the ground")
    whole = left_out + _area(vertices, lying) + _area(vertices, edges.faces)
    vertices, edges = drop_sheets(vertices, edges, notes)
    surface = _enclosed(vertices, edges, ground, notes, sealing=sealing)
    return replace(surface, left_out=1 - _area(vertices, edges.faces) / whole)


def _area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Twice the area of all triangles."""
    return float(doubled_areas(vertices, faces).sum())


def _enclosed(
    vertices: NDArray[np.float64],
    edges: EdgeTable,
    ground: Ground | None,
    notes: list[str],
    *,
    sealing: bool,
) -> Surface:
    """What is inside, of triangles that are wound consistently."""
    if not edges.balance.any():
        return _surface_of_closed(vertices, edges, notes, 1.0)
    confidence = _confidence_of_open(vertices, edges.faces)
    if confidence is None or confidence < _LEAST_CONFIDENCE:
        sealed = _sealed(vertices, edges, ground, notes, Openings()) if sealing else None
        if sealed is None:
            raise _no_solid(confidence, ground)
        return sealed
    vertices, edges, openings = fill_holes(vertices, edges, notes)
    if not edges.balance.any():
        return replace(_surface_of_closed(vertices, edges, notes, confidence), openings=openings)
    # Where two half shells are a hair apart, much of what is between them has a winding number near a half.
    if sealing and confidence < _SURE:
        sealed = _sealed(vertices, edges, ground, notes, openings)
        if sealed is not None:
            return sealed
    notes.append(
        "the surface stays open; inside and outside are told apart by the generalised winding number"
    )
    openings = with_what_stays_open(openings, vertices, edges)
    surface = _surface_of_sheets(vertices, edges.faces, notes, confidence, closed=False)
    return replace(surface, openings=openings)


def _sealed(
    vertices: NDArray[np.float64],
    edges: EdgeTable,
    ground: Ground | None,
    notes: list[str],
    filled: Openings,
) -> Surface | None:
    """What is seen as a solid, where the winding number hardly tells; None where none is. filled: openings
    that have their lids."""
    found = seal(vertices, edges.faces, ground)
    if found is None:
        return None
    notes.append(
        f"the surface is open in many places; what is seen as a solid was taken for one, and gaps of up to "
        f"{GAP:.1%} of the longest side were bridged"
    )
    openings = filled.and_more(openings_of(found.vertices, found.faces, found.made_up))
    surface = Surface(found.vertices, found.faces, found.faces, True, True, tuple(notes), found.solid)
    return replace(surface, openings=openings, sealed=True)


def _no_solid(confidence: float | None, ground: Ground | None) -> FlatShapeError | OpenShellError:
    if confidence is None:
        return FlatShapeError(f"the surface is open and encloses no volume; close it, or {_THICKEN}")
    return OpenShellError(
        f"the surface is an open shell: only {confidence:.0%} of what it could enclose is clearly "
        f"inside. Close its openings,{_SAY_UP if ground is None else ''} or {_THICKEN}"
    )


def consistent(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3), in the unit frame, and triangles (F, 3): merged, welded and turned the same way."""
    notes: list[str] = []
    vertices, faces = merge_vertices(vertices, faces, notes)
    faces, _ = drop_doubles(faces, notes)
    if len(faces) == 0:
        return vertices, faces
    vertices, edges = weld_boundary(vertices, EdgeTable(faces), notes)
    return vertices, orient(vertices, edges, notes).faces


def _refuse_plane(vertices: NDArray[np.float64]) -> None:
    """Raise FlatShapeError when all vertices lie in one plane, whichever way it is turned."""
    if is_plane(vertices):
        raise FlatShapeError(f"all triangles lie in one plane, so there is no inside to fit; {_THICKEN}")


def _surface_of_closed(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str], confidence: float
) -> Surface:
    vertices, edges = unite(vertices, edges, notes)
    faces = edges.faces
    if abs(signed_volumes(vertices, faces, np.zeros(len(faces), np.int64))[0]) < _NO_VOLUME:
        raise FlatShapeError(f"the surface is closed but encloses no volume; {_THICKEN}")
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    spacing = float((upper - lower).max()) / _CHECK
    shape = tuple(int(n) for n in np.maximum(np.ceil((upper - lower) / spacing), 1))
    winding = winding_grid(vertices, faces, lower + spacing / 2, spacing, (shape[0], shape[1], shape[2]))
    enclosed = winding[winding != 0]
    odd = float((enclosed != 1).mean()) if enclosed.size else 0.0
    if odd == 0.0:
        faces = _drop_shared_walls(vertices, edges, notes)
        return Surface(vertices, faces, faces, True, True, tuple(notes), confidence)
    notes.append(
        f"the surface passes through itself ({odd:.1%} of what it encloses is enclosed twice or inside out); "
        "whatever it winds around at least once counts as inside"
    )
    return _surface_of_sheets(vertices, faces, notes, min(confidence, 1.0 - odd), closed=True)


def _drop_shared_walls(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> NDArray[np.int64]:
    """Drop walls within the shape, where two bodies meet along common edges.

    Edges with more than two triangles cut the surface into patches; a patch is a wall when the inside is on
    both sides of its largest triangles.
    """
    faces = edges.faces
    if edges.valence.max() == 2:
        return faces
    patch = edges.patches
    area = doubled_areas(vertices, faces)
    order = np.lexsort((-area, patch))
    rank = np.arange(len(order)) - np.searchsorted(patch[order], patch[order])
    probe = order[rank < _PROBES]
    parts = facing(MeshDistance(vertices, faces, faces, closed=True), vertices[faces[probe]]) != 0
    kept = faces[(np.bincount(patch[probe], parts) > 0)[patch]]
    if len(kept) in (0, len(faces)) or EdgeTable(kept).balance.any():
        return faces
    notes.append(f"dropped {len(faces) - len(kept)} triangles of walls between bodies")
    return kept


def _surface_of_sheets(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    notes: list[str],
    confidence: float,
    closed: bool,
) -> Surface:
    """Keep only triangles with the inside on one side and the outside on the other as the surface."""
    outer = outer_faces(MeshDistance(vertices, faces, faces, closed), vertices, faces)
    if not len(outer.faces):
        raise FlatShapeError(f"the surface is open and encloses no volume; close it, or {_THICKEN}")
    if outer.hidden:
        notes.append(f"{outer.hidden} triangles lie within the shape and are no part of its surface")
    if outer.cut:
        notes.append(f"of {counted(outer.cut, 'triangle')} only pieces are outside of the shape")
    return Surface(outer.vertices, outer.faces, faces, closed, False, tuple(notes), confidence)


def _confidence_of_open(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float | None:
    """Share of points near and around the surface whose winding number is clearly 0 or 1; None where none is
    inside."""
    rng = np.random.default_rng(0)
    source = MeshDistance(vertices, faces, faces, closed=False)
    near = sample_triangles(vertices, faces, 4000, 0)[0] + 0.02 * rng.standard_normal((4000, 3))
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    around = lower + (upper - lower) * rng.random((4000, 3))
    winding = source.winding(np.concatenate([near, around]))
    inside = winding > 0.5
    if not inside.any():
        return None
    # Only what may be inside is in question: the wide outside must not make an open shell look sure.
    unsure = np.minimum(np.abs(winding), np.abs(winding - 1)) > _CLEAR
    return 1.0 - float(np.count_nonzero(unsure) / np.count_nonzero(inside | unsure))
