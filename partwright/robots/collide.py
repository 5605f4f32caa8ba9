"""A whole robot with collision shapes in the place of its collision meshes."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_cover import simplified
from partwright.approximation.convex_fit import Mode
from partwright.atomic_io import replacing_files
from partwright.errors import RobotError, SettingError
from partwright.robots.containment import shape_solid, sticking_out
from partwright.robots.enclosed_link import EnclosedLink
from partwright.robots.keeping_apart import keep_apart
from partwright.robots.link_processes import Order, shapes_of_all
from partwright.robots.model import Link, RobotFile, Shape
from partwright.robots.opening import open_robot
from partwright.robots.overlaps import Pair, overlaps, too_near
from partwright.robots.picture import picture
from partwright.robots.report import LinkReport, report
from partwright.robots.shaping import LIGHT, Wishes, numbered
from partwright.robots.solids import Solids, Target, largest_deviation
from partwright.robots.spheres import LinkSpheres, as_json, curobo, spheres_for
from partwright.shapes.cleaning import counted
from partwright.shapes.lengths import own_length

if TYPE_CHECKING:
    from manifold3d import Manifold

    from partwright.fields import Field

HULL = "hull"
_SHARE, _LEAST_SHARE = 0.02, 0.003  # of the longest sides of link and robot: the tolerance that none gave
# Of a tolerance that was given: what makes meshes and hulls simpler is off by a tenth of it each, on top.
_AIM = 0.85
_EXTRA = 0.08  # of its volume: what the hulls of a link may add
_WORTH = 0.7  # two chords for one save three quarters
_FINER = 1  # times a link's tolerance is halved where it overlaps a neighbour more than its mesh did
_MORE_OVERLAP = 1e-3  # of the smaller link's volume
_MOST_SPHERES = 1000
Told = Callable[[str], None]


@dataclass(frozen=True)
class CollideOptions:
    """What is wanted of a robot's collision shapes."""

    enclose: bool = False
    """The shapes contain the link's visual meshes (its collision meshes, where it has no others)."""
    inside: bool = False
    """The shapes lie inside of the link's collision meshes."""
    tolerance: float | str | None = None
    """How far a shape's surface may lie from the mesh's: metres, "5mm", or a share "2%" of the link's
    longest side. Not given it is 2%, and no less than 0.3 % of the robot's."""
    max_parts: int = 48
    """Shapes a link at most; without `tolerance` and `extra` those beyond 24 only where each saves 0.16 % of
    what one hull would add to the link, and the more there are the more."""
    kinds: tuple[str, ...] = ()
    """Native solids that may be used, and "hull" for convex meshes; all that the format has if empty."""
    spheres: int | None = None
    """Spheres a link at most, that are found beside the shapes for all that collides; none if not given."""
    extra: float | None = None
    """Volume that convex pieces may add, over the link's, before it is cut further; 0.08 if not given."""

    def __post_init__(self) -> None:
        if self.enclose and self.inside:
            raise SettingError("--enclose and --inside contradict each other: take one of them")
        if isinstance(self.max_parts, bool) or not isinstance(self.max_parts, int) or self.max_parts < 1:
            raise SettingError(f"max_parts: expected a number of at least 1, got {self.max_parts!r}")
        if self.spheres is not None and (
            isinstance(self.spheres, bool) or not 1 <= self.spheres <= _MOST_SPHERES
        ):
            raise SettingError(f"spheres: expected a number from 1 to {_MOST_SPHERES}, got {self.spheres!r}")
        if not 0 < self.most_extra < np.inf:
            raise SettingError(f"extra: expected a share of the volume such as 0.08, got {self.extra!r}")
        self.length(1.0, 1.0)

    @property
    def mode(self) -> Mode:
        return "around" if self.enclose else "within" if self.inside else "nearest"

    @property
    def most_extra(self) -> float:
        return _EXTRA if self.extra is None else self.extra

    @property
    def worth(self) -> float | None:
        """What a shape more has to save, of the mean of what they add, where neither a tolerance nor the
        volume that hulls may add tells how many."""
        told = self.tolerance is not None or (self.extra is not None and self.hulls)
        return _WORTH if self.mode == "nearest" and not told else None

    @property
    def hulls(self) -> bool:
        """Whether convex meshes may be used."""
        return not self.kinds or HULL in self.kinds

    def length(self, size: float, whole: float) -> float:
        """The tolerance of a link of this longest side, of a robot of that, in metres.

        Raises:
            SettingError: it is none.
        """
        if self.tolerance is None:
            return max(_SHARE * size, _LEAST_SHARE * whole)
        try:
            length = own_length(self.tolerance, "m", size)
        except SettingError as error:
            raise SettingError(f"tolerance: {error}") from error
        if length == 0:
            raise SettingError(f"tolerance: expected a length above 0, got {self.tolerance!r}")
        return length

    def wishes(self, tolerance: float, kinds: tuple[type[Field], ...], hulls: bool) -> Wishes:
        """What is asked of a link's shapes, so that they keep to this tolerance, in metres."""
        aimed = self.tolerance is not None and self.mode == "nearest"
        aim = _AIM * tolerance if aimed else tolerance
        return Wishes(aim, kinds, hulls, self.max_parts, self.most_extra, self.mode, self.worth)


@dataclass(frozen=True)
class Collided:
    """The robot as it was and what is to be written of it. shapes: by link. spheres: of every link that
    collides, if they were asked for."""

    robot: RobotFile
    shapes: dict[str, list[Shape]]
    links: list[LinkReport]
    pairs_before: dict[Pair, float] = field(default_factory=dict)
    pairs_after: dict[Pair, float] = field(default_factory=dict)
    spheres: list[LinkSpheres] = field(default_factory=list)


def collide(
    robot: str | Path | RobotFile,
    options: CollideOptions | None = None,
    packages: Sequence[str | Path] = (),
    told: Told = lambda _: None,
    workers: int = 1,
) -> Collided:
    """Shapes for every link of the robot that has collision meshes, and spheres, if they are asked for, for
    every one that collides.

    told: gets a line a link. workers: processes, as of `carried_out`, that shape the links of a robot that
    takes long.

    Raises:
        UnreadableFileError, UnsupportedFormatError, RobotError: of `open_robot`; no link has a collision
        mesh, or collides. PartwrightError: a mesh is damaged or encloses nothing; the message names the link.
        SettingError: an option does not fit the format.
    """
    options = options or CollideOptions()
    robot = robot if isinstance(robot, RobotFile) else open_robot(robot, packages)
    links = [link for link in robot.links if link.collisions]
    colliding = [link for link in robot.links if link.collisions or link.natives]
    if not (colliding if options.spheres is not None else links):
        meant = "collides" if options.spheres is not None else "has a collision mesh to replace"
        native = f"; {len(colliding)} collide by native solids, which stay" if colliding else ""
        raise RobotError(f"{robot.path}: none of its {len(robot.links)} links {meant}{native}")
    kinds, hulls = kinds_of(robot, options.kinds)
    solids = Solids()
    before = {link.name: solids.target(link, link.collisions) for link in links}
    seen = {link.name for link in links if options.enclose and link.visuals}
    uses = {link.name: link.visuals if link.name in seen else link.collisions for link in links}
    wanted = {link.name: solids.target(link, uses[link.name], link.name in seen) for link in links}
    bodies = _bodies(colliding, {name: target.solid for name, target in before.items()})
    pairs_before = overlaps(bodies)
    corners = [np.reshape(_in_world(link, before[link.name].solid).bounding_box(), (2, 3)) for link in links]
    whole = float(np.ptp(np.concatenate(corners), axis=0).max()) if links else 0.0
    volumes = {name: body.volume() for name, body in bodies.items()}
    tolerances = {name: options.length(target.size, whole) for name, target in wanted.items()}
    wishes = {name: options.wishes(tolerances[name], kinds, hulls) for name in wanted}
    shapes: dict[str, list[Shape]] = {}
    made: dict[tuple[Target, Wishes], list[Shape]] = {}
    todo = {link.name for link in links}
    for turn in range(1 + _FINER):
        keys = {link.name: (wanted[link.name], wishes[link.name]) for link in links if link.name in todo}
        orders: dict[tuple[Target, Wishes], Order] = {}
        for link in links:
            if link.name in todo and (key := keys[link.name]) not in made:  # four legs alike are made once
                orders.setdefault(key, Order(link, uses[link.name], link.name in seen, wishes[link.name]))
        with closing(shapes_of_all(solids, [*orders.values()], workers)) as found:
            for name, key in keys.items():
                if key not in made:
                    made[key] = next(found)
                shapes[name] = numbered(_stem(name), made[key])
                told(f"{name}: {counted(len(shapes[name]), 'shape')}")
        if options.enclose:
            apart = _kept_apart(links, shapes, wanted, wishes, pairs_before)
            for name in (name for name in apart if len(apart[name]) != len(shapes[name])):
                told(f"{name}: {counted(len(apart[name]), 'shape')}, apart from its neighbours'")
            shapes = apart
        unions = {link.name: _union(shapes[link.name]) for link in links}
        pairs_after = overlaps(_bodies(colliding, unions))
        near = too_near(pairs_before, pairs_after, volumes, _MORE_OVERLAP)
        neighbours = {frozenset((link.name, above)) for link in links for above in link.parents}
        todo = {name for pair in near if frozenset(pair) in neighbours for name in pair if name in shapes}
        if not todo or turn == _FINER or options.enclose:
            break
        for name in todo:
            finer = dataclasses.replace(
                wishes[name], tolerance=wishes[name].tolerance / 2, extra=wishes[name].extra / 2
            )
            wishes[name] = finer
    reports = [
        _measured(
            link,
            shapes[link.name],
            unions[link.name],
            wanted[link.name],
            before[link.name],
            tolerances[link.name],
            options,
        )
        for link in links
    ]
    spheres: list[LinkSpheres] = []
    of_target: dict[Target, LinkSpheres] = {}
    for link in colliding if options.spheres is not None else ():
        spheres.append(_spheres(link, wanted.get(link.name), solids, options, of_target))
        told(f"{link.name}: {counted(len(spheres[-1].balls), 'sphere')}")
    return Collided(robot, shapes, reports, pairs_before, pairs_after, spheres)


def save(result: Collided, folder: str | Path) -> list[Path]:
    """Write the robot into a folder, with the meshes it needs, FILE.report.json and FILE.png: all or none.

    Raises:
        OutputError: it cannot be written.
    """
    files = result.robot.replaced(result.shapes)
    name = result.robot.path.name
    folder = Path(folder)
    with replacing_files(folder) as staging:
        for within, data in files.written.items():
            _parent(staging / within).write_bytes(data)
        for within, source in files.copied.items():
            if within not in files.written:
                shutil.copyfile(source, _parent(staging / within))
        (staging / f"{name}.report.json").write_bytes(
            report(name, result.links, result.pairs_before, result.pairs_after, result.spheres)
        )
        if result.spheres:
            (staging / f"{name}.spheres.yml").write_bytes(curobo(result.spheres))
            (staging / f"{name}.spheres.json").write_bytes(as_json(result.spheres))
        picture(result.robot, result.shapes, result.spheres, staging / f"{name}.png")
        written = sorted(path.relative_to(staging) for path in staging.rglob("*") if path.is_file())
    return [folder / path for path in written]


def kinds_of(robot: RobotFile, names: Sequence[str]) -> tuple[tuple[type[Field], ...], bool]:
    """Native kinds of these names, and whether hulls are among them.

    Raises:
        SettingError: the format has no such kind.
    """
    if not names:
        return tuple(robot.kinds), True
    known = {kind.kind: kind for kind in (*robot.kinds, *robot.composed)}
    for name in names:
        if name not in known and name != HULL:
            raise SettingError(
                f"kinds: {robot.path.suffix} has no {name!r}; expected some of {', '.join((*known, HULL))}"
            )
    return tuple(kind for name, kind in known.items() if name in names), HULL in names


def _kept_apart(
    links: Sequence[Link],
    shapes: Mapping[str, Sequence[Shape]],
    wanted: Mapping[str, Target],
    wishes: Mapping[str, Wishes],
    allowed: Mapping[Pair, float],
) -> dict[str, list[Shape]]:
    """The shapes of all links, held apart where they contain what is wanted.

    allowed: volume that links may share."""
    bodies: dict[str, EnclosedLink] = {}
    for link in links:
        target, name = wanted[link.name], link.name
        triangles, solid = target.vertices[target.faces], simplified(target.solid, wishes[name].tolerance)
        fine = LIGHT * wishes[name].tolerance
        bodies[name] = EnclosedLink(shapes[name], triangles, solid, link.pose, fine)
    keep_apart(bodies, allowed, max((each.most for each in wishes.values()), default=1))
    return {name: numbered(_stem(name), body.result()) for name, body in bodies.items()}


def _stem(link: str) -> str:
    """What the names of a link's shapes start with."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-.") else "_" for c in link) + "_collision"


def _union(shapes: Sequence[Shape]) -> Manifold:
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean([shape_solid(shape) for shape in shapes], OpType.Add)


def _in_world(link: Link, solid: Manifold) -> Manifold:
    return solid.transform(link.pose[:3])


def _bodies(links: Sequence[Link], solids: Mapping[str, Manifold]) -> dict[str, Manifold]:
    """All that collides of each link, at rest: its solid, if it has one here, and its native ones."""
    from manifold3d import Manifold, OpType

    found = {}
    for link in links:
        own = [solids[link.name]] if link.name in solids else []
        own += [shape_solid(Shape("", part)) for part in link.natives]
        found[link.name] = _in_world(link, Manifold.batch_boolean(own, OpType.Add))
    return found


def _spheres(
    link: Link,
    target: Target | None,
    solids: Solids,
    options: CollideOptions,
    made: dict[Target, LinkSpheres],
) -> LinkSpheres:
    """made: those of links that are this target alone, which this one becomes as well."""
    if target is None and options.enclose and link.visuals:
        target = solids.target(link, link.visuals, sheets=True)
    assert options.spheres is not None
    if target is None or link.natives:
        return spheres_for(link, target, options.spheres, options.mode)
    if target not in made:
        made[target] = spheres_for(link, target, options.spheres, options.mode)
    return dataclasses.replace(made[target], link=link.name)


def _measured(
    link: Link,
    shapes: Sequence[Shape],
    union: Manifold,
    target: Target,
    before: Target,
    tolerance: float,
    options: CollideOptions,
) -> LinkReport:
    shared = target.solid ^ union  # of what touches all along, differences may have no sense
    # What enclosing shapes lack of a thickness that sheets do not have is nothing.
    solid = shared if options.enclose and target.sheets else target.solid
    own, common = solid.volume(), shared.volume()
    kinds: dict[str, int] = {}
    for shape in shapes:
        kinds[shape.kind] = kinds.get(shape.kind, 0) + 1
    return LinkReport(
        link=link.name,
        meshes=tuple(use.source.name for use in link.collisions),
        shapes=kinds,
        stands_for="visual" if target is not before else "collision",
        volume=own,
        missing=max(own - common, 0.0) / own,
        extra=max(union.volume() - common, 0.0) / own,
        farthest=largest_deviation(solid, union),
        tolerance=tolerance,
        sticking_out=sticking_out(shapes, target) if options.enclose else None,
        most=options.max_parts,
        notes=tuple(dict.fromkeys((*before.notes, *target.notes))),
    )


def _parent(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
