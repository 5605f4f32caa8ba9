"""FILE.report.json of a robot: what stands for each link, and how far off it is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from partwright import __version__
from partwright.robots.solids import Deviation
from partwright.robots.spheres import LinkSpheres, sphere_warnings


@dataclass(frozen=True)
class LinkReport:
    """One link. Lengths are in metres, as robots are.

    shapes: how many of each kind. stands_for: which meshes. volume: of the solid that they bound; of sheets
    that are enclosed, of what the shapes contain of their wrap, so that these lack none of it. missing,
    extra: volume that the shapes lack and add, over that of the meshes. farthest: where the surface of
    either reaches farthest beyond the other, in the link's frame. sticking_out: how far the meshes reach
    beyond the shapes, by fresh points; None where they may. most: shapes that it could have.
    """

    link: str
    meshes: tuple[str, ...]
    shapes: dict[str, int]
    stands_for: str
    volume: float
    missing: float
    extra: float
    farthest: Deviation
    tolerance: float
    sticking_out: float | None
    notes: tuple[str, ...]
    most: int

    @property
    def deviation(self) -> float:
        return self.farthest.length

    @property
    def count(self) -> int:
        return sum(self.shapes.values())

    def to_dict(self) -> dict[str, Any]:
        own: dict[str, Any] = {
            "link": self.link,
            "meshes": list(self.meshes),
            "shapes": self.shapes,
            "stands_for": self.stands_for,
            "volume": _short(self.volume),
            "volume_missing_ratio": _short(self.missing),
            "volume_extra_ratio": _short(self.extra),
            "max_deviation": _short(self.deviation),
            "max_deviation_at": [_short(value) for value in self.farthest.at],
            "tolerance": _short(self.tolerance),
        }
        if self.sticking_out is not None:
            own |= {"contained": self.sticking_out <= 0, "sticking_out": _short(self.sticking_out)}
        return own | ({"notes": list(self.notes)} if self.notes else {})


def report(
    name: str,
    links: Sequence[LinkReport],
    before: Mapping[tuple[str, str], float],
    after: Mapping[tuple[str, str], float],
    spheres: Sequence[LinkSpheres] = (),
) -> bytes:
    """As JSON. before, after: volume that two links share at rest."""
    pairs = [
        {"links": list(pair), "before": _short(before.get(pair, 0.0)), "after": _short(after.get(pair, 0.0))}
        for pair in dict.fromkeys((*before, *after))
    ]
    whole = {
        "file": name,
        "version": __version__,
        "unit": "m",
        "warnings": [*warnings(links), *sphere_warnings(spheres)],
        "links": [link.to_dict() for link in links],
        **({"spheres": [each.to_dict() for each in spheres]} if spheres else {}),
        "colliding_pairs_at_rest": {"before": len(before), "after": len(after)},
        "shared_volumes_at_rest": pairs,
    }
    return (json.dumps(whole, indent=2) + "\n").encode()


def warnings(links: Sequence[LinkReport]) -> list[str]:
    """What a user should be told, a sentence a link: where a tolerance is not kept, or a mesh sticks out."""
    result = []
    for link in links:
        if link.deviation > link.tolerance:
            nearer = "hulls (--kinds)"
            if "hull" in link.shapes:
                full = link.count >= link.most
                nearer = "more shapes (--max-parts)" if full else "a smaller --tolerance"
            place = ", ".join(f"{value:.3f}" for value in link.farthest.at)
            wrong = "lack" if link.farthest.missing else "add"
            result.append(
                f"link {link.link!r}: the shapes are {1000 * link.deviation:.1f} mm off at ({place}) m of "
                f"the link, where they {wrong} something: more than the tolerance of "
                f"{1000 * link.tolerance:.1f} mm; {nearer} would be nearer"
            )
        if link.sticking_out:
            result.append(
                f"link {link.link!r}: its mesh sticks out of the shapes by {1000 * link.sticking_out:.3g} mm"
            )
    return result


def _short(value: float) -> float:
    return float(f"{value:.6g}")
