"""The shapes that stand for one link: as few as its tolerance asks for, each a native solid or a hull."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.balanced_hull import balanced_hulls
from partwright.approximation.convex_cover import (
    convex_cover,
    halved,
    simplified,
)
from partwright.approximation.convex_fit import ConvexFit, Mode, convex_fits
from partwright.approximation.convex_piece import Limits, Piece
from partwright.approximation.hull_faces import faces_of
from partwright.approximation.light_hull import light_hull, plain_hull
from partwright.meshing.hulls import file_grid, file_hull, hull_of
from partwright.meshing.manifolds import as_mesh, surface_of
from partwright.robots.containment import larger, shape_solid
from partwright.robots.enclosing import containing, outer_hull
from partwright.robots.inscribed import filled, inscribed
from partwright.robots.inside import largest_together, within
from partwright.robots.model import Shape
from partwright.robots.solids import Target

if TYPE_CHECKING:
    from manifold3d import Manifold

    from partwright.assembly import Part
    from partwright.fields import Field

NATIVE_FOR = 0.03  # of its volume, or `extra`: by how much a native solid may be worse than the hull it saves
_NATIVE_PIECE = 5e-4  # of the link's volume: the same for one of several, which are as near as this
_SAVED = 2e-3  # of the link's volume: what each native solid more has to save where there are no hulls
LIGHT = 0.1  # of the tolerance: what a hull may lose for fewer corners, or add for fewer faces
_LOST, _MOST_LOST = 1e-5, 0.01  # of the link's volume, and of its own: what a hull of fewer corners may lack
FLAWS = 1e-3  # of its volume: what a hull may add to a convex link
_ROUNDING = 1e-9  # of its volume: what a hull adds to a link without a dent
_CORNERS = 1024  # of a convex link's exact hull
_FACES = 64  # of an enclosing hull, and more as long as a corner is out by a share of the tolerance
_OUT = 0.9  # that share: a corner is a little farther from the hull than from its planes
_ROOM = 2e-6  # of the size: by how much an enclosing shape is larger than it need be, for rounding
_GRIDS = 2  # steps of the grid that files' hulls are moved to, likewise
_POINTS = 50_000  # of the triangles, for the hulls of wrapped pieces
_LEAST = 1e-3  # of a wrapped piece's volume: a hull of points below it is a sheet
_FILLS = 2e-3  # of the link's volume: what each shape more within it has to gain
_CHOICE, _MOST_CHOICE = 4, 24  # pieces for each shape that may be within it, and in all, to choose from


@dataclass(frozen=True)
class Wishes:
    """How a link is to be replaced.

    tolerance: largest deviation, as a length. kinds: native solids that may be used. hulls: whether convex
    meshes may. most: shapes a link. extra: volume that hulls may add, over the link's. mode: whether they
    contain the target, lie within it, or are nearest. worth: of `Limits`, what more shapes have to save.
    """

    tolerance: float
    kinds: tuple[type[Field], ...]
    hulls: bool
    most: int
    extra: float
    mode: Mode
    worth: float | None = None


def shapes_for(name: str, target: Target, wishes: Wishes) -> list[Shape]:
    """The shapes, named NAME_1, NAME_2 ..., or NAME for one."""
    if wishes.mode != "around" and (convex := _convex(target, wishes)) is not None:
        return [dataclasses.replace(convex, name=name)]
    if wishes.mode == "within":
        chosen = _inside(target, wishes)
    else:
        solid = simplified(target.wrap if wishes.mode == "around" else target.solid, wishes.tolerance)
        pieces = _pieces(solid, wishes)
        if wishes.mode == "around":
            hulls = _enclosing(pieces, target, wishes)
        else:
            hulls = balanced_hulls(pieces, solid, wishes.tolerance)
        chosen = [_chosen(hull, len(hulls) == 1, target, wishes) for hull in hulls]
    return numbered(name, chosen)


def numbered(name: str, shapes: Sequence[Shape]) -> list[Shape]:
    """The shapes, named NAME_1, NAME_2 ..., or NAME for one."""
    names = [name] if len(shapes) == 1 else [f"{name}_{i}" for i in range(1, len(shapes) + 1)]
    return [Shape(each, shape.part, shape.mesh) for each, shape in zip(names, shapes, strict=True)]


def _pieces(solid: Manifold, wishes: Wishes) -> list[Piece]:
    pieces = convex_cover(solid, Limits(wishes.tolerance, wishes.extra, wishes.most, wishes.worth))
    return pieces if wishes.hulls else _fit_for_natives(pieces, wishes)


def _inside(target: Target, wishes: Wishes) -> list[Shape]:
    """Of as many pieces as may be, and of more where these are few, those that have most of the link
    together: few pieces are large, but one that must not reach out of a bent piece loses most of it."""
    solid = simplified(target.solid, wishes.tolerance)
    counts = {wishes.most, max(wishes.most, min(_CHOICE * wishes.most, _MOST_CHOICE))}
    found: list[Shape] = []
    for count in sorted(counts):
        pieces = _pieces(solid, dataclasses.replace(wishes, most=count))
        hulls = [inscribed(piece.hull, target.solid) for piece in pieces]
        hulls = filled(hulls, target.solid, count, _FILLS * target.solid.volume())
        chosen = [_chosen(hull, len(hulls) == 1, target, wishes) for hull in hulls]
        found += [one for shape in chosen if (one := within(shape, target))]
    return largest_together(found, wishes.most)


def _convex(target: Target, wishes: Wishes) -> Shape | None:
    """A convex solid as a native one that is near, or its own hull, exact; None where it is not convex."""
    solid, whole = target.solid, Piece(target.solid)
    if not wishes.hulls or whole.extra > FLAWS * solid.volume() or whole.hull.num_vert() > _CORNERS:
        return None
    dented = whole.extra > _ROUNDING * solid.volume()
    if dented and not whole.within(wishes.tolerance):
        return None
    near = _near(plain_hull(whole.hull), wishes, NATIVE_FOR)
    shape = Shape("", near.part) if near is not None else _hull(whole.hull)
    if not dented or wishes.mode != "within":
        return shape
    # Dents of a face are shallow all over, and a little smaller is nearly all; a slot is deep.
    ways = (shape, _hull(inscribed(whole.hull, solid)))
    found = [one for way in ways if (one := within(way, target)) is not None]
    return max(found, key=lambda one: float(shape_solid(one).volume()), default=None)


def _near(hull: Manifold, wishes: Wishes, worse: float) -> ConvexFit | None:
    """The native solid that is near enough and worse than the hull by no more than a share of its volume."""
    if not wishes.kinds:
        return None
    worse = min(worse, wishes.extra)
    return next(iter(convex_fits(hull, wishes.kinds, wishes.mode, wishes.tolerance, worse)), None)


def _enclosing(pieces: list[Piece], target: Target, wishes: Wishes) -> list[Manifold]:
    """Hulls of the pieces, of few faces, and of all triangles that stick out of them: these contain every
    triangle."""
    fine, room = LIGHT * wishes.tolerance, _room(target)
    hulls = _tight(pieces, target, fine) if target.loose else [piece.hull for piece in pieces]

    def plain(hull: Manifold) -> Manifold:
        return outer_hull(hull, fine, _FACES, room, _OUT * wishes.tolerance)

    hulls = [plain(hull) for hull in hulls]
    more = containing(hulls, target.vertices[target.faces], fine)
    return [new if new is old else plain(new) for old, new in zip(hulls, more, strict=True)]


def _chosen(hull: Manifold, alone: bool, target: Target, wishes: Wishes) -> Shape:
    """By volume: a native solid where it is near enough and hardly worse than the hull. alone: whether it is
    all of the link."""
    if not wishes.hulls:
        return _native(convex_fits(hull, wishes.kinds, wishes.mode)[0].part, target, wishes)
    share = target.solid.volume() / hull.volume()
    if wishes.mode != "around":
        hull = light_hull(hull, LIGHT * wishes.tolerance, lost=min(_LOST * share, _MOST_LOST))[0]
    worse = NATIVE_FOR if alone else min(NATIVE_FOR, _NATIVE_PIECE * share)
    near = _near(hull, wishes, worse)
    return _native(near.part, target, wishes) if near is not None else _hull(hull)


def _native(part: Part, target: Target, wishes: Wishes) -> Shape:
    if wishes.mode != "around":
        return Shape("", part)
    return Shape("", dataclasses.replace(part, field=larger(part.field, _room(target))))


def _room(target: Target) -> float:
    return max(_ROOM * target.size, _GRIDS * file_grid(target.vertices))


def _hull(hull: Manifold) -> Shape:
    return Shape("", mesh=as_mesh(file_hull(surface_of(hull)[0])))


def _tight(pieces: list[Piece], target: Target, fine: float) -> list[Manifold]:
    """The hulls of the triangles' own points that lie in each piece of what wraps them."""
    from manifold3d import Manifold

    points, room = target.samples(_POINTS, seed=0), 1e-9 * target.size
    hulls = []
    for piece in pieces:
        plain = outer_hull(piece.hull, fine, _FACES, 0.0)  # a wrap's own hull has thousands of faces
        lower, upper = np.reshape(plain.bounding_box(), (2, 3))
        within = points[((points >= lower) & (points <= upper)).all(axis=1)]
        for normal, offset in zip(*faces_of(plain), strict=True):
            within = within[within @ normal <= offset + room]
        hull = hull_of(within) if len(within) > 3 else Manifold()
        sheet = hull.is_empty() or hull.volume() < _LEAST * piece.hull.volume()
        hulls.append(piece.hull if sheet else hull)
    return hulls


def _fit_for_natives(pieces: list[Piece], wishes: Wishes) -> list[Piece]:
    """Pieces cut in halves, the worst first, until a native solid is near to each or there are enough; where
    no tolerance was given also until a solid more saves little: a round end would be a stack of boxes."""
    least = 0.0 if wishes.worth is None else _SAVED * sum(piece.solid.volume() for piece in pieces)

    def fitted(piece: Piece) -> tuple[Piece, ConvexFit]:
        return piece, convex_fits(piece.hull, wishes.kinds, wishes.mode)[0]

    def error(entry: tuple[Piece, ConvexFit]) -> float:
        return entry[1].volume_error_ratio * entry[0].hull.volume()

    def cut(entry: tuple[Piece, ConvexFit]) -> list[tuple[Piece, ConvexFit]]:
        ways = [list(map(fitted, parts)) for parts in halved(entry[0])]
        return min(ways, key=lambda parts: sum(map(error, parts)), default=[])

    def pays(worst: tuple[Piece, ConvexFit], parts: list[tuple[Piece, ConvexFit]]) -> bool:
        return error(worst) - sum(map(error, parts)) > least * (len(parts) - 1)

    done: list[Piece] = []
    waiting = [fitted(piece) for piece in pieces]
    while waiting and len(done) + len(waiting) < wishes.most:
        worst = waiting.pop(max(range(len(waiting)), key=lambda i: error(waiting[i])))
        parts = [] if worst[1].deviation <= wishes.tolerance else cut(worst)
        ahead = wishes.mode != "within" and parts and not pays(worst, parts)
        if ahead:  # halves of a ball are no nearer to the cylinders around them than it is; quarters are
            parts = [part for half in parts for part in cut(half) or [half]]
            room = wishes.most - len(done) - len(waiting)
            parts = parts if len(parts) <= room else []
        if parts and pays(worst, parts):
            waiting += parts
        else:
            done.append(worst[0])
    return done + [piece for piece, _ in waiting]
