"""A link as so many spheres, as motion planners on GPUs collide it: its material, filled or contained."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.approximation.ball_filling import Balls, filling_balls
from partwright.approximation.convex_fit import Mode
from partwright.errors import RobotError
from partwright.fields import Box, Sphere
from partwright.meshing.manifolds import surface_of
from partwright.robots.containment import larger, shape_solid, told_apart
from partwright.robots.covering import balls_solid, covering_balls, outside_of_balls
from partwright.robots.model import Link, Shape
from partwright.robots.solids import Target
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

    from partwright.assembly import Part

_INSIDE, _SURFACE = 14, 3000  # cells along the solid's box; points of its surface
_FRESH = 100_000  # points of the surface that containment is tried on
_ROUND = 2e-3  # of its size: by how much a native solid's facets lie within it, at most
_FEW = 0.5  # of the link's volume: what spheres that stand for it may lack and add
_ERRORS = ("mean", "best", "worst")


@dataclass(frozen=True, eq=False)
class LinkSpheres:
    """The spheres of one link.

    balls: (N, 4) centres and radii in the link's frame. missing, extra: volume that they lack and add, over
    the link's. far: the mean, smallest and largest distance of its surface from theirs, in metres.
    sticking_out: how far it is outside of them, by fresh points; None where it may be.
    """

    link: str
    balls: Balls
    missing: float
    extra: float
    far: tuple[float, float, float]
    sticking_out: float | None

    @property
    def too_few(self) -> bool:
        """Whether they are too far from the link to stand for it."""
        return self.missing + self.extra > _FEW

    def to_dict(self) -> dict[str, Any]:
        own: dict[str, Any] = {
            "link": self.link,
            "spheres": len(self.balls),
            "volume_missing_ratio": _short(self.missing),
            "volume_extra_ratio": _short(self.extra),
        }
        if self.sticking_out is not None:
            own |= {"contained": self.sticking_out <= 0, "sticking_out": _short(self.sticking_out)}
        return own


def spheres_for(link: Link, target: Target | None, count: int, mode: Mode, seed: int = 0) -> LinkSpheres:
    """At most `count` spheres for a link: for what its meshes bound, if it has some, and its native solids.

    mode: around contains every triangle; within lies inside; nearest lacks and adds little volume.
    """
    fields = [part.field for part in link.natives]
    if target is None and len(fields) <= count and all(isinstance(field, Sphere) for field in fields):
        return _themselves(link, mode)
    whole = _with_natives(link.natives, target)
    if mode != "around":
        balls = filling_balls(whole.solid, count, "within" if mode == "within" else "in", seed=seed)
        return _measured(link.name, balls, whole, None)
    points = np.concatenate([whole.samples(_SURFACE, seed), _points_inside(whole.wrap)])
    balls = covering_balls(whole.wrap, points, whole.vertices[whole.faces], count, seed)
    return _measured(link.name, balls, whole, seed + 1)


def curobo(spheres: Sequence[LinkSpheres]) -> bytes:
    """As the YAML of cuRobo's robot configurations."""
    lines = ["collision_spheres:"]
    for each in spheres:
        lines.append(f"  {json.dumps(each.link)}:")
        for row in each.balls:
            x, y, z, radius = map(_decimal, row)
            lines.append(f"    - center: [{x}, {y}, {z}]")
            lines.append(f"      radius: {radius}")
    return ("\n".join(lines) + "\n").encode()


def as_json(spheres: Sequence[LinkSpheres]) -> bytes:
    """For each link its errors, and a list of `origin` and `radius`, as foam's sphere decompositions have
    them."""
    whole = {
        each.link: {
            **{name: _short(value) for name, value in zip(_ERRORS, each.far, strict=True)},
            "spheres": [
                {"origin": [_short(v) for v in row[:3]], "radius": _short(row[3])}
                for row in each.balls.tolist()
            ],
        }
        for each in spheres
    }
    return (json.dumps(whole, indent=1) + "\n").encode()


def sphere_warnings(spheres: Sequence[LinkSpheres]) -> list[str]:
    """What a user should be told, a sentence a link: where spheres are too few, or its mesh sticks out."""
    result = []
    for each in spheres:
        if each.too_few:
            lacks = f"lack {_percent(each.missing)} of its volume and add {_percent(each.extra)}"
            result.append(
                f"link {each.link!r}: {len(each.balls)} spheres are too few to stand for it: they {lacks}; "
                "ask for more with --spheres"
            )
        if each.sticking_out:
            result.append(
                f"link {each.link!r}: its mesh sticks out of the spheres by {1000 * each.sticking_out:.3g} mm"
            )
    return result


def _themselves(link: Link, mode: Mode) -> LinkSpheres:
    """Spheres that the link has."""
    balls = np.array([[*part.translation, part.field.radius] for part in link.natives])  # type: ignore[attr-defined]
    return LinkSpheres(link.name, balls, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0 if mode == "around" else None)


def _with_natives(natives: Sequence[Part], target: Target | None) -> Target:
    """Meshes, if there are any, and native solids as one."""
    from manifold3d import Manifold, OpType

    if target is not None and not natives:
        return target
    plain = [shape_solid(Shape("", part)) for part in natives]
    around = [surface_of(shape_solid(Shape("", _rounded(part)))) for part in natives]
    pieces = [(target.vertices, target.faces)] if target is not None else []
    vertices, faces, start = [], [], 0
    for corners, triangles in [*pieces, *around]:
        vertices.append(corners)
        faces.append(triangles + start)
        start += len(corners)
    solid = Manifold.batch_boolean([*([target.solid] if target is not None else []), *plain], OpType.Add)
    corners, triangles = np.concatenate(vertices), np.concatenate(faces)
    if target is None:
        return Target(solid, solid, corners, triangles, ())
    wrap = Manifold.batch_boolean([target.wrap, *plain], OpType.Add)
    return dataclasses.replace(  # native solids are more than sheets
        target, solid=solid, wrap=wrap, vertices=corners, faces=triangles, sheets=False
    )


def _rounded(part: Part) -> Part:
    """So much larger that its facets contain the solid itself."""
    if isinstance(part.field, Box):
        return part
    lower, upper = np.reshape(shape_solid(Shape("", part)).bounding_box(), (2, 3))
    return dataclasses.replace(part, field=larger(part.field, _ROUND * float((upper - lower).max())))


def _measured(link: str, balls: Balls, target: Target, seed: int | None) -> LinkSpheres:
    if not len(balls):
        raise RobotError(f"link {link!r}: no sphere lies inside of its mesh; it is too thin")
    union, own = balls_solid(balls), target.solid.volume()
    apart = np.abs(outside_of_balls(target.samples(_SURFACE, seed=2), balls))
    sticking = None
    if seed is not None:
        fresh = target.samples(_FRESH, seed)
        sticking = told_apart(float(outside_of_balls(fresh, balls).max()), fresh)
    return LinkSpheres(
        link,
        balls,
        float((target.solid - union).volume() / own),
        float((union - target.solid).volume() / own),
        (float(apart.mean()), float(apart.min()), float(apart.max())),
        sticking,
    )


def _points_inside(solid: Manifold) -> np.ndarray:
    vertices, faces = surface_of(solid)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    size = float((upper - lower).max())
    step = size / _INSIDE
    axes = [np.arange(low + step / 2, high, step) for low, high in zip(lower, upper, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    signed = MeshDistance((vertices - lower) / size, faces, faces, True).signed((points - lower) / size)
    return points[signed < 0]


def _decimal(value: float) -> str:
    """Six digits without an exponent: YAML reads 1e-05 as a word."""
    return np.format_float_positional(float(f"{value:.6g}"), trim="0")


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.0f} %"


def _short(value: float) -> float:
    return float(f"{value:.6g}")
