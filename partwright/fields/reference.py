"""The SuperFrustum in differentiable PyTorch: slow, readable, and what the compiled kernel has to equal.

SuperFrusta, section 3.2; the formula is written out in docs/superfrustum.md. Works in float32 and float64,
batched over parts (leading dimensions) and points (the dimension before last). Values and gradients are
finite for every allowed parameter at every point. Each guard below replaces the argument *before* a
singular function and the result after it ("double where"), because a gradient of zero times infinity is NaN.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from partwright.fields.columns import PROPORTIONS, ROTATION, SIZE, TRANSLATION, WIDTH, Column
from partwright.fields.operations import smooth_difference, smooth_union

# Added to the half height: the chord of the bend and the edges of the profile never have length zero.
HEIGHT_FLOOR = 1e-12
# The fold of no parts: farther than any point.
FAR = 1e6
# Squared lengths below this count as zero (its inverse and its root are finite in float32).
SQUARE_FLOOR = 1e-30
# Where sin(x)/x and atan(x)/x turn into their series: 0/0 at zero, and cancellation in the gradient near it.
SERIES_BELOW = 0.02


def superfrustum(
    points: Tensor,
    size: Tensor,
    roundness: Tensor,
    dilation: Tensor,
    taper: Tensor,
    bulge: Tensor,
    onion: Tensor,
) -> Tensor:
    """Signed distance (..., N) of local points (..., N, 3) to SuperFrusta.

    size (..., 3) and dilation (...) are lengths >= 0; roundness, bulge and onion (...) are in 0..1, taper
    (...) in 0..2.
    """
    x, y, z = points.unbind(-1)
    sx, sy, sz = size.unsqueeze(-2).unbind(-1)
    roundness, dilation, taper, bulge, onion = (
        value.unsqueeze(-1) for value in (roundness, dilation, taper, bulge, onion)
    )
    half_width = torch.minimum(sx, sy) / 2
    half_height = sz / 2 + HEIGHT_FLOOR
    across, along = bend(x, z, half_height, bulge)
    section = cross_section(across, y, sx / 2, sy / 2, roundness * half_width)
    return profile(section, along, half_width, half_height, dilation, taper, onion) - dilation


def bend(x: Tensor, z: Tensor, half_height: Tensor, bulge: Tensor) -> tuple[Tensor, Tensor]:
    """Coordinates across and along the axis, an arc of half angle bulge * pi/2 whose chord is the height.

    Beyond the arc's ends the axis runs on straight. With s, k = sine and cosine of the half angle and the
    chord's half h, lengths are measured times s: the arc's centre is (h k, 0) / s, so that nothing grows
    without bound as the arc straightens or its chord vanishes.
    """
    angle = bulge * (math.pi / 2)
    s, k, h = torch.sin(angle), torch.cos(angle), half_height
    over = x * s + (z.abs() - h) * k  # how far beyond the end, along the tangent there
    on_arc = over <= 0
    sign = torch.where(z < 0, -1.0, 1.0).to(z)

    # From the arc's centre towards the axis, and along z. At the centre itself the angle is undefined: it
    # reads 0. Off the arc neither is used.
    towards, up = k * h - x * s, z * s
    radius = _root(towards * towards + up * up)
    across_arc = ((x * x + z * z - h * h) * s - 2 * x * k * h) / (radius + h)
    usable = on_arc & (radius > 0)
    towards, up = torch.where(usable, towards, 1.0), torch.where(usable, up, 0.0)
    along_arc = z * h * _sine_ratio(angle) * _angle_ratio(up, towards)

    across_end = (z.abs() - h) * s - x * k
    along_end = sign * (h + over)
    return torch.where(on_arc, across_arc, across_end), torch.where(on_arc, along_arc, along_end)


def cross_section(x: Tensor, y: Tensor, half_x: Tensor, half_y: Tensor, radius: Tensor) -> Tensor:
    """Signed distance in the plane to the rectangle of these half extents with rounded corners."""
    dx, dy = x.abs() - half_x + radius, y.abs() - half_y + radius
    corner = _root(dx.clamp(min=0) ** 2 + dy.clamp(min=0) ** 2)
    return corner + torch.maximum(dx, dy).clamp(max=0) - radius


def profile(
    q: Tensor,
    z: Tensor,
    half_width: Tensor,
    half_height: Tensor,
    dilation: Tensor,
    taper: Tensor,
    onion: Tensor,
) -> Tensor:
    """Signed distance in the (q, z) plane to the quad between the outer and the inner edge.

    Where the dilation closes the hole along its whole length, the inner edge is left out and the ends reach
    the axis, so that the depth inside a solid is right.
    """
    m, h = half_width, half_height
    closed = taper.clamp(min=1) * m * onion <= dilation
    inner_bottom, inner_top, outer_top = m * (onion - 1), m * (taper * onion - 1), m * (taper - 1)
    outer, outer_square = _edge(q, z, torch.zeros_like(m), outer_top, h)
    inner, inner_square = _edge(q, z, inner_bottom, inner_top, h)
    inner, inner_square = torch.where(closed, outer, -inner), torch.where(closed, outer_square, inner_square)

    def end_square(height: Tensor, inside_of: Tensor, outside_of: Tensor) -> Tensor:
        missing = torch.where(closed, 0.0, (inside_of - q).clamp(min=0))
        return (missing + (q - outside_of).clamp(min=0)) ** 2 + height**2

    top = end_square(z - h, inner_top, outer_top)
    bottom = end_square(z + h, inner_bottom, torch.zeros_like(m))
    outside = torch.minimum(torch.minimum(outer_square, inner_square), torch.minimum(top, bottom))
    # Inside a convex quad the nearest line holds the nearest point: no root, so a gradient on the surface.
    inside = torch.maximum(torch.maximum(outer, inner), z.abs() - h)
    return torch.where(inside <= 0, inside, _root(outside))


def rotate_to_local(points: Tensor, translation: Tensor, rotation: Tensor) -> Tensor:
    """Points (..., N, 3) in the local frames of poses.

    translation (..., 3); rotation (..., 4), quaternions (w, x, y, z) local to world of any length but zero.
    """
    w, x, y, z = rotation.unbind(-1)
    twice = 2 / (rotation * rotation).sum(-1)
    rows = (
        (1 - twice * (y * y + z * z), twice * (x * y - w * z), twice * (x * z + w * y)),
        (twice * (x * y + w * z), 1 - twice * (x * x + z * z), twice * (y * z - w * x)),
        (twice * (x * z - w * y), twice * (y * z + w * x), 1 - twice * (x * x + y * y)),
    )
    matrix = torch.stack([torch.stack(row, -1) for row in rows], -2)
    return (points - translation.unsqueeze(-2)) @ matrix  # row vectors: p R = R^T p


def part_distance(
    points: Tensor,
    translation: Tensor,
    rotation: Tensor,
    size: Tensor,
    roundness: Tensor,
    dilation: Tensor,
    taper: Tensor,
    bulge: Tensor,
    onion: Tensor,
) -> Tensor:
    """Signed distance (..., N) of world points (..., N, 3) to posed SuperFrusta, each alone."""
    local = rotate_to_local(points, translation, rotation)
    return superfrustum(local, size, roundness, dilation, taper, bulge, onion)


def fold(distances: Tensor, blends: Tensor, signs: Tensor | None = None) -> Tensor:
    """Distances (M, N) joined from first to last; blends (M,), that of the first unused.

    Parts of a negative sign (M,) are subtracted from what came before them, all others added to it.
    """
    subtracted = [False] * len(distances) if signs is None else [bool(sign < 0) for sign in signs]
    result = torch.full_like(distances[0], FAR) if subtracted[0] else distances[0]
    for distance, blend, minus in zip(distances[1:], blends[1:], subtracted[1:], strict=True):
        result = (smooth_difference if minus else smooth_union)(result, distance, blend)
    return result


def evaluate_parts(parameters: Tensor, points: Tensor) -> Tensor:
    """Distances (M, N) of each part alone; rows (M, 16 or 17) as in `fields.kernel`, points (N, 3)."""
    translation, rotation, size = (parameters[:, block] for block in (TRANSLATION, ROTATION, SIZE))
    return part_distance(points, translation, rotation, size, *parameters[:, PROPORTIONS].unbind(-1))


def evaluate(parameters: Tensor, points: Tensor) -> Tensor:
    """Distance (N,) of the whole: the parts folded as their signs say. Rows (M, 16 or 17), points (N, 3)."""
    signs = parameters[:, Column.SIGN] if parameters.shape[1] == WIDTH else None
    return fold(evaluate_parts(parameters, points), parameters[:, Column.BLEND], signs)


def _edge(q: Tensor, z: Tensor, bottom: Tensor, top: Tensor, h: Tensor) -> tuple[Tensor, Tensor]:
    """Signed distance to the line from (bottom, -h) to (top, h), positive at larger q, and the squared
    distance to the segment."""
    dq, dz, lean = q - bottom, z + h, top - bottom
    square = lean * lean + 4 * h * h
    u = ((dq * lean + dz * 2 * h) / square).clamp(0, 1)
    signed = (dq * 2 * h - dz * lean) / square.sqrt()
    return signed, (dq - u * lean) ** 2 + (dz - u * 2 * h) ** 2


def _root(square: Tensor) -> Tensor:
    """Square root with value and gradient 0 at 0 (the centre of a corner, of the arc, a point on an edge)."""
    positive = square > SQUARE_FLOOR
    return torch.where(positive, torch.where(positive, square, 1.0).sqrt(), 0.0)


def _sine_ratio(x: Tensor) -> Tensor:
    """sin(x) / x, also at 0."""
    near, square = x.abs() < SERIES_BELOW, x * x
    far = torch.where(near, 1.0, x)
    return torch.where(near, 1 - square / 6 * (1 - square / 20 * (1 - square / 42)), far.sin() / far)


def _angle_ratio(y: Tensor, x: Tensor) -> Tensor:
    """atan2(y, x) / y for x >= 0 and (x, y) not the origin; 1/x at y = 0."""
    near = y.abs() < SERIES_BELOW * x
    t = torch.where(near, y / torch.where(near, x, 1.0), 0.0)
    square = t * t
    series = 1 - square * (1 / 3 - square * (1 / 5 - square * (1 / 7 - square / 9)))
    far_y, far_x = torch.where(near, 1.0, y), torch.where(near, 1.0, x)
    return torch.where(near, series / torch.where(near, x, 1.0), torch.atan2(far_y, far_x) / far_y)
