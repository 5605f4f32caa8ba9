"""One quadric within a box as a closed mesh: its corners lie on the quadric, its chords within a tolerance.

Planes are exact. A surface that is a graph over a plane, as all nearly flat ones are, is a grid of heights;
one with two curvatures of a sign is an ellipse swept along its axis; the rest are cut from those.
"""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold, OpType

from partwright.fields import NormalForm, Quadric, normal_form
from partwright.meshing.manifolds import closed
from partwright.meshing.revolve import corners_of_circle, revolve, subdivided, under_graph

_ROOM = 1.05  # what is cut off beyond the box, in boxes
_CUBE = 1.5  # half the side of the cube in which graphs are sought, in half diagonals of the box
_MOST = 400  # cells of a graph along a side
_STEEPEST = 2.0  # slope of a graph


def quadric_solid(quadric: Quadric, box: np.ndarray, tolerance: float) -> Manifold:
    """A solid that is the quadric's within the box (2, 3), whatever it is outside.

    tolerance: how far the surface may lie from the quadric's.
    """
    centre, half = box.mean(axis=0), float(np.linalg.norm(np.ptp(box, axis=0)) / 2)
    local = quadric.moved(np.eye(3), -centre)  # around the origin no digits are lost
    return _solid(local, half, tolerance).translate(tuple(centre.tolist()))


def _solid(quadric: Quadric, half: float, tolerance: float) -> Manifold:
    """Within the ball of radius `half` about the origin."""
    form = normal_form(quadric, half)
    everything = _cube(half)
    if form.name == "none":
        return everything if form.complement else Manifold()
    if form.name == "hyperbolic cylinder" and form.level < 0:
        return everything - _solid(quadric.complement(), half, tolerance)
    if form.name in ("plane", "parallel planes", "crossing planes"):
        solid = _flat(form, everything)
    elif form.slope and form.curvature[1] <= 0:
        up = form.axes * (1, -1, -1) if form.complement else form.axes
        return _graph(quadric, up, half, tolerance)
    else:
        mean = quadric.gradient(np.zeros((1, 3)))[0]
        length = float(np.linalg.norm(mean))
        if length > 0 and _slope(quadric, frame := _frame(mean / length), half)[0] < _STEEPEST:
            return _graph(quadric, frame, half, tolerance)
        solid = _curved(form, half, tolerance)
    return everything - solid if form.complement else solid


def _cube(half: float) -> Manifold:
    return Manifold.cube((2 * _ROOM * half,) * 3, True)


def half_space(region: Manifold, normal: np.ndarray, point: np.ndarray) -> Manifold:
    """The region where normal . p <= normal . point, for a unit normal."""
    return region.trim_by_plane(tuple((-normal).tolist()), -float(normal @ point))


def _flat(form: NormalForm, region: Manifold) -> Manifold:
    u, v, w = form.axes.T
    if form.name == "plane":
        return half_space(region, w, form.centre)
    if form.name == "parallel planes":
        offset = form.radii[0] * u
        return half_space(half_space(region, u, form.centre + offset), -u, form.centre - offset)
    slope = np.array([np.sqrt(form.curvature[0]), np.sqrt(-form.curvature[1])])
    one, other = (np.stack([u, s * v]).T @ slope / np.linalg.norm(slope) for s in (1, -1))
    wedges = [half_space(half_space(region, s * one, form.centre), -s * other, form.centre) for s in (1, -1)]
    return Manifold.batch_boolean(wedges, OpType.Add)


def _slope(quadric: Quadric, frame: np.ndarray, half: float) -> tuple[float, float]:
    """The surface's steepest slope over the plane of a frame (3, 3) in the cube, and the least growth of f.

    The slope is infinite where the surface is no graph. The gradient is linear in p, so its extremes are at
    the cube's corners.
    """
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    gradient = quadric.gradient(signs * (_CUBE * half) @ frame.T) @ frame
    growth = float(gradient[:, 2].min())
    if growth <= 0:
        return np.inf, growth
    return float(np.linalg.norm(gradient[:, :2], axis=1).max()) / growth, growth


def _graph(quadric: Quadric, frame: np.ndarray, half: float, tolerance: float) -> Manifold:
    """The surface as heights over the plane of a frame (3, 3) along whose last column f grows."""
    slope, growth = _slope(quadric, frame, half)
    square, linear, constant = quadric.matrices()
    square, linear = frame.T @ square @ frame, linear @ frame
    side, own = _CUBE * half, float(np.abs(square[2]).max()) <= 1e-12 * float(np.abs(square).max())
    bend = 2 * np.abs(square[:2, :2]).sum(axis=1) / growth
    if not own:  # heights bend by the other terms, too, and the slope counts where they leave the cube
        bend = np.full(2, 2 * np.abs(np.linalg.eigvalsh(square)).max() * (1 + slope) ** 2 / growth)
    widest = 2 * side if own else half / 4 / max(slope, 1e-3)
    cells = np.minimum(np.sqrt(4 * tolerance / np.maximum(bend, 1e-300)), widest)
    counts = np.clip(np.ceil(2 * side / cells), 1, _MOST).astype(int)
    across, along = (np.linspace(-side, side, count + 1) for count in counts)
    height = _heights_over(square, linear, constant, *np.meshgrid(across, along, indexing="ij"))
    if not own:
        height = np.clip(height, -side, side)
    solid = under_graph(across, along, height, min(float(height.min()), -side) - half)
    return solid.transform(np.column_stack([frame, np.zeros(3)]))


def _heights_over(
    square: np.ndarray, linear: np.ndarray, constant: float, s: np.ndarray, t: np.ndarray
) -> np.ndarray:
    """The root of f along the third axis at which f grows; far off, on the side it must be, where none is."""
    across = 2 * (square[0, 2] * s + square[1, 2] * t) + linear[2]
    rest = square[0, 0] * s * s + square[1, 1] * t * t + 2 * square[0, 1] * s * t
    rest = rest + linear[0] * s + linear[1] * t + constant
    inner = across**2 - 4 * square[2, 2] * rest
    root = across + np.sqrt(np.maximum(inner, 0.0))
    real = (inner >= 0) & (root > 0)
    return np.where(real, -2 * rest / np.where(real, root, 1.0), np.where(rest > 0, -np.inf, np.inf))


def _frame(normal: np.ndarray) -> np.ndarray:
    """A right-handed frame (3, 3) whose last column is the unit normal."""
    least = np.eye(3)[int(np.abs(normal).argmin())]
    first = np.cross(least, normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


def _curved(form: NormalForm, half: float, tolerance: float) -> Manifold:
    """The form's <= 0 side, about its own axes, then in its place."""
    along = form.axes.T @ -form.centre
    if form.curvature[1] < 0:
        own = _between_branches(form, half, along, tolerance)
    else:
        pieces = [_swept(form, a, b, tolerance) for a, b in _heights(form, along[2], _ROOM * half)]
        own = Manifold.batch_boolean(pieces, OpType.Add) if pieces else Manifold()
    return own.transform(np.column_stack([form.axes, form.centre]))


def _heights(form: NormalForm, middle: float, half: float) -> list[tuple[float, float]]:
    """The intervals of w within the ball in which the ellipses of the form are real."""
    low, high = middle - half, middle + half
    k, level = form.curvature[2], form.level
    if form.slope:
        intervals = [(low, min(high, 0.0))]
    elif k > 0:
        end = float(np.sqrt(level / k))
        # A little of an ellipsoid in the box: cut off what is far away, else keep the pole.
        intervals = [(max(low, -end), min(high, end))]
    elif k == 0 or level > 0:
        intervals = [(low, high)]
    else:
        waist = float(np.sqrt(level / k))
        intervals = [(low, min(high, -waist)), (max(low, waist), high)]
    return [(a, b) for a, b in intervals if b > a]


def _swept(form: NormalForm, low: float, high: float, tolerance: float) -> Manifold:
    """k1 u^2 + k2 v^2 <= level - k3 w^2 - slope w for w between two heights."""
    stretch = 1 / np.sqrt(form.curvature[:2])
    widest = float(stretch.max())

    def profile(parameter: np.ndarray) -> np.ndarray:
        w = (low + high) / 2 - (high - low) / 2 * np.cos(parameter)  # poles become smooth
        inside = form.level - form.curvature[2] * w**2 - form.slope * w
        return np.column_stack([widest * np.sqrt(np.maximum(inside, 0.0)), w])

    points = subdivided(profile, np.linspace(0, np.pi, 5), tolerance)
    small = 1e-6 * float(np.abs(points).max())
    ends = [[0.0, low], [0.0, high]]
    points = points[1 if points[0, 0] <= small else 0 : len(points) - (points[-1, 0] <= small)]
    points = np.concatenate([ends[:1], points, ends[1:]])
    return revolve(points, corners_of_circle(float(points[:, 0].max()), tolerance), tuple(stretch / widest))


def _between_branches(form: NormalForm, half: float, along: np.ndarray, tolerance: float) -> Manifold:
    """k1 u^2 - k2 v^2 <= level for a positive level."""
    room = _ROOM * half

    def branch(v: np.ndarray) -> np.ndarray:
        return np.column_stack([np.sqrt((form.level - form.curvature[1] * v**2) / form.curvature[0]), v])

    right = subdivided(branch, np.linspace(along[1] - room, along[1] + room, 5), tolerance)
    outline = np.concatenate([right, right[::-1] * (-1, 1)])
    return _prism(outline, len(right), along[2] - room, along[2] + room)


def _prism(outline: np.ndarray, side: int, low: float, high: float) -> Manifold:
    """Between two heights over an outline whose corner i is across from corner -1 - i."""
    count = len(outline)
    vertices = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in (low, high)])
    i = np.arange(count)
    after = np.roll(i, -1)
    wall = np.concatenate(
        [np.stack([i, after, after + count], 1), np.stack([i, after + count, i + count], 1)]
    )
    j = np.arange(side - 1)
    across = count - 1 - j
    lid = np.concatenate([np.stack([j, j + 1, across - 1], 1), np.stack([j, across - 1, across], 1)])
    return closed(vertices, np.concatenate([wall, lid + count, lid[:, ::-1]]))
