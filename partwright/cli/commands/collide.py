"""What `partwright collide` does."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import TypeVar

from partwright.cli.terminal import counted, note, say, warn
from partwright.processes import one_a_processor
from partwright.robots import Collided, CollideOptions, collide, save
from partwright.robots.report import LinkReport, warnings
from partwright.robots.spheres import LinkSpheres, sphere_warnings

_Link = TypeVar("_Link", bound=LinkReport | LinkSpheres)


def run(arguments: argparse.Namespace) -> int:
    options = CollideOptions(
        enclose=arguments.enclose,
        inside=arguments.inside,
        tolerance=arguments.tolerance,
        max_parts=arguments.max_parts,
        extra=arguments.extra,
        spheres=arguments.spheres,
        kinds=tuple(filter(None, arguments.kinds.split(","))),
    )
    workers = one_a_processor(arguments.workers)
    result = collide(arguments.robot, options, arguments.packages, told=note, workers=workers)
    save(result, arguments.output)
    for line in (*_table(result.links), *_sphere_table(result.spheres)):
        say(line)
    say(_summary(result))
    say(f"written to {arguments.output}")
    warn([*warnings(result.links), *sphere_warnings(result.spheres)])
    return 0


def _table(links: Sequence[LinkReport]) -> list[str]:
    def cells(link: LinkReport) -> str:
        kinds = ", ".join(f"{number} {kind}" for kind, number in link.shapes.items())
        far = f"{1000 * link.deviation:.2f} mm" + (" (over)" if link.deviation > link.tolerance else "")
        return f"{kinds:28}  {_errors(link)}  {far}"

    return _lines("shapes                        missing    extra  largest deviation", links, cells)


def _sphere_table(links: Sequence[LinkSpheres]) -> list[str]:
    return _lines("spheres  missing    extra", links, lambda link: f"{len(link.balls):7}  {_errors(link)}")


def _lines(heads: str, links: Sequence[_Link], cells: Callable[[_Link], str]) -> list[str]:
    """A line a link below one of heads; none of no links."""
    wide = max(map(len, ("link", *(link.link for link in links))))
    lines = [f"{link.link:{wide}}  {cells(link)}" for link in links]
    return [f"{'link':{wide}}  {heads}", *lines] if lines else []


def _errors(link: LinkReport | LinkSpheres) -> str:
    return f"{100 * link.missing:6.1f} %  {100 * link.extra:6.1f} %"


def _summary(result: Collided) -> str:
    count = sum(link.count for link in result.links)
    line = f"{counted(len(result.links), 'link')}, {counted(count, 'shape')}; colliding pairs at rest: "
    line += f"{len(result.pairs_before)} before, {len(result.pairs_after)} after"
    checked = [link for link in result.links if link.sticking_out is not None]
    if checked:
        held = sum(link.sticking_out == 0 for link in checked)
        line += f"; {held} of {counted(len(checked), 'link')} contained"
    if result.spheres:
        line += f"; {counted(sum(len(link.balls) for link in result.spheres), 'sphere')}"
    return line
