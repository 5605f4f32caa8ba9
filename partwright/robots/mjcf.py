"""MJCF: read with its includes and comments, written with other colliding geoms and else as it was.

A colliding mesh geom that is the only sight of its body, that its body gets its mass from, or that something
else names, stays as a geom that is only seen; any other goes. New geoms have no mass, and the old ones'
contact attributes.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.errors import RobotError, UnreadableFileError
from partwright.export.mjcf import geom_size
from partwright.export.rigid_body import numbers
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.mjcf_defaults import (
    Compiler,
    Defaults,
    geom_pose,
    kept_path,
    mesh_matrix,
    pose_of,
    values,
)
from partwright.robots.mjcf_solids import native_geom
from partwright.robots.model import Files, Link, MeshUse, RobotFile, Shape
from partwright.robots.xml_files import parsed, serialised

_DEEPEST = 20  # of includes
_HIDDEN = 3  # groups from this on are not shown at first
# of the geom whose place is taken: what says how it collides and looks
_KEPT = (
    "class",
    "contype",
    "conaffinity",
    "condim",
    "friction",
    "solref",
    "solimp",
    "solmix",
    "margin",
    "gap",
)
_ALSO_KEPT = ("priority", "group", "rgba", "material")
_FILES = {
    "mesh": "meshdir",
    "texture": "texturedir",
    "hfield": "meshdir",
    "skin": "meshdir",
    "model": "meshdir",
}


@dataclass(frozen=True, eq=False)
class _Geom:
    """element: as in the file. said: with its class's attributes. pose: (4, 4) in the body's frame."""

    element: Any
    said: dict[str, str]
    pose: np.ndarray

    @property
    def collides(self) -> bool:
        return (int(self.said.get("contype", "1")), int(self.said.get("conaffinity", "1"))) != (0, 0)

    @property
    def is_mesh(self) -> bool:
        return self.said.get("type", "sphere") == "mesh"


class Mjcf(RobotFile):
    """A MuJoCo model."""

    kinds: ClassVar[tuple[type[Field], ...]] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        """Raises UnreadableFileError or RobotError, which name the link."""
        self.path = path
        self._documents: dict[str, Any] = {}  # path within the new folder -> tree
        self._read(path, path.name, 0)
        roots = [tree.getroot() for tree in self._documents.values()]
        whole = list(self._all(roots[0]))
        self._compiler = Compiler.of(e for e in whole if e.tag == "compiler")
        tops = [e for e in whole if e.tag == "default" and e.getparent().tag != "default"]
        self._defaults = Defaults(tops)
        self._meshes = self._assets(roots)
        self._geoms: dict[str, list[_Geom]] = {}
        self._bodies: dict[str, Any] = {}
        self.links = list(self._walk())

    # reading

    def _read(self, path: Path, within: str, depth: int) -> None:
        if depth > _DEEPEST:
            raise RobotError(f"{self.path}: its includes nest without end at {path.name}")
        tree = parsed(path, "mujoco") if depth == 0 else parsed(path, None)
        self._documents[within] = tree
        for include in tree.getroot().iter("include"):
            name = include.get("file") or ""
            found = next(
                (base / name for base in (self.path.parent, path.parent) if (base / name).is_file()), None
            )
            if found is None:
                raise UnreadableFileError(f"{path}: its include {name!r} is not there")
            inner = kept_path(name)
            if inner in self._documents:
                raise RobotError(f"{self.path}: {name!r} is included twice")
            self._read(found, inner, depth + 1)
            include.set("file", inner)

    def _assets(self, roots: Sequence[Any]) -> dict[str, Any]:
        found = {}
        for root in roots:
            for mesh in root.iter("mesh"):
                if mesh.getparent().tag == "default":
                    continue
                name = mesh.get("name") or Path(mesh.get("file", "")).stem
                found[name] = mesh
        return found

    def _walk(self) -> Iterator[Link]:
        main = next(iter(self._documents.values())).getroot()
        for world in main.iter("worldbody"):
            yield from self._body(world, np.eye(4), None, None, "world")

    def _children(self, element: Any) -> Iterator[Any]:
        """Child elements, with those of included files in their includes' places."""
        for child in element:
            if child.tag == "include":
                yield from self._children(self._documents[child.get("file")].getroot())
            elif isinstance(child.tag, str):
                yield child

    def _all(self, element: Any) -> Iterator[Any]:
        """All elements below one, in the order in which they are read: an include's where it stands."""
        for child in self._children(element):
            yield child
            yield from self._all(child)

    def _body(
        self, body: Any, above: np.ndarray, parent: str | None, inherited: str | None, name: str
    ) -> Iterator[Link]:
        bodies: list[tuple[Any, np.ndarray, str | None]] = []
        geoms: list[_Geom] = []
        self._gather(body, np.eye(4), inherited, name, geoms, bodies)
        if name in self._geoms and name != "world":
            raise RobotError(f"{self.path}: two bodies are named {name!r}")
        self._geoms.setdefault(name, []).extend(geoms)
        self._bodies.setdefault(name, body)
        yield self._link(name, above, parent, geoms)
        for i, (child, pose, kind) in enumerate(bodies, 1):
            own = child.get("name") or f"{name}_{i}"
            below = above @ pose @ pose_of(child.attrib, self._compiler, f"{self.path}: body {own!r}")
            yield from self._body(child, below, name, child.get("childclass") or kind, own)

    def _gather(
        self,
        element: Any,
        pose: np.ndarray,
        inherited: str | None,
        name: str,
        geoms: list[_Geom],
        bodies: list[Any],
    ) -> None:
        """The geoms and bodies directly within a body, through its frames."""
        where = f"{self.path}: body {name!r}"
        for child in self._children(element):
            if child.tag == "geom":
                said = self._defaults.attributes(child, inherited)
                geoms.append(_Geom(child, said, pose @ geom_pose(said, self._compiler, where)))
            elif child.tag == "body":
                bodies.append((child, pose, inherited))
            elif child.tag == "frame":
                inner = pose @ pose_of(child.attrib, self._compiler, where)
                self._gather(child, inner, child.get("childclass") or inherited, name, geoms, bodies)

    def _link(self, name: str, pose: np.ndarray, parent: str | None, geoms: Sequence[_Geom]) -> Link:
        meshes = [geom for geom in geoms if geom.is_mesh]
        return Link(
            name,
            pose,
            () if parent is None else (parent,),
            tuple(self._use(name, geom) for geom in meshes if geom.collides),
            tuple(self._use(name, geom) for geom in meshes if not geom.collides),
            tuple(
                solid
                for geom in geoms
                if geom.collides and (solid := native_geom(geom.said, geom.pose, name)) is not None
            ),
        )

    def _use(self, link: str, geom: _Geom) -> MeshUse:
        name = geom.said.get("mesh")
        asset = self._meshes.get(name or "")
        if asset is None:
            raise RobotError(f"{self.path}: link {link!r}: no asset is the mesh {name!r} of its geom")
        said = self._defaults.attributes(asset, None)
        matrix = geom.pose @ mesh_matrix(said, f"{self.path}: mesh {name!r}")
        if "vertex" in said:
            return MeshUse(Path(str(name)), matrix, _inline(said, f"{self.path}: mesh {name!r}"))
        path = self._source(asset.tag, said.get("file", ""))
        if not path.is_file():
            raise UnreadableFileError(f"link {link!r}: its mesh {name!r} is not there; looked for {path}")
        return MeshUse(path, matrix)

    def _source(self, tag: str, name: str) -> Path:
        name = Path(name).name if self._compiler.strippath else name
        return self.path.parent / getattr(self._compiler, _FILES[tag]) / name

    # writing

    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        files = Files()
        copies = {within: copy.deepcopy(tree) for within, tree in self._documents.items()}
        main = next(iter(copies.values())).getroot()
        taken = {e.get("name") for tree in copies.values() for e in tree.getroot().iter("geom", "mesh")}
        assets = _new_element("asset")
        renamed: dict[str, list[str]] = {}
        for link, found in shapes.items():
            olds = [
                self._twin(geom.element, copies)
                for geom in self._geoms[link]
                if geom.is_mesh and geom.collides
            ]
            names = [_free(shape.name, taken) for shape in found]
            self._replace(link, olds, list(zip(names, found, strict=True)), assets)
            for old in olds:
                if old.get("name"):
                    renamed[old.get("name")] = names
        for tree in copies.values():
            _expand_pairs(tree.getroot(), renamed)
        if len(assets):
            _append(main, assets)
        self._carry_assets(copies, files)
        for within, tree in copies.items():
            files.written[within] = serialised(tree)
        return files

    def _twin(self, element: Any, copies: Mapping[str, Any]) -> Any:
        """The same element of the copied document."""
        for within, tree in self._documents.items():
            if element.getroottree() is tree or element.getroottree().getroot() is tree.getroot():
                return copies[within].getroot().getroottree().xpath(tree.getpath(element))[0]
        raise AssertionError("an element of no document")

    def _replace(self, link: str, olds: Sequence[Any], new: Sequence[tuple[str, Shape]], assets: Any) -> None:
        geoms = self._geoms[link]
        seen = any(not geom.collides for geom in geoms)
        weighs = self._compiler.inertia_from_geoms or self._bodies[link].find("inertial") is None
        first = next(geom for geom in geoms if geom.is_mesh and geom.collides)
        group = int(first.said.get("group", "0"))
        kept = {
            key: first.element.get(key) for key in (*_KEPT, *_ALSO_KEPT) if first.element.get(key) is not None
        }
        stays = {id(old): weighs or not seen or _is_named(old) for old in olds}
        if any(stays.values()) and group < _HIDDEN:
            kept["group"] = str(_HIDDEN)
        place = olds[0]
        for name, shape in reversed(new):
            element = _geom(name, shape, kept, first.said, assets)
            element.tail = place.tail
            place.addnext(element)
        for old in olds:
            if stays[id(old)]:
                old.set("contype", "0")
                old.set("conaffinity", "0")
            else:
                _remove(old)

    def _carry_assets(self, copies: Mapping[str, Any], files: Files) -> None:
        for tree in copies.values():
            for compiler in tree.getroot().iter("compiler"):
                for key in ("meshdir", "texturedir", "assetdir"):
                    if compiler.get(key):
                        compiler.set(key, kept_path(compiler.get(key)))
            for element in tree.getroot().iter(*_FILES):
                for key, name in element.attrib.items():
                    if not key.startswith("file") or element.getparent().tag == "default":
                        continue
                    source = self._source(element.tag, name)
                    name = Path(name).name if self._compiler.strippath else kept_path(name)
                    element.set(key, name)
                    if source.is_file():
                        folder = kept_path(getattr(self._compiler, _FILES[element.tag]))
                        files.copied[f"{folder}/{name}" if folder else name] = source


def _inline(said: Mapping[str, str], where: str) -> Any:
    import trimesh

    corners = values(said, "vertex", (), where).reshape(-1, 3)
    if "face" in said:
        return trimesh.Trimesh(
            corners, values(said, "face", (), where).astype(int).reshape(-1, 3), process=False
        )
    return trimesh.Trimesh(corners).convex_hull


def _new_element(tag: str, **attributes: str) -> Any:
    from lxml import etree

    return etree.Element(tag, attributes)


def _geom(name: str, shape: Shape, kept: Mapping[str, str], said: Mapping[str, str], assets: Any) -> Any:
    element = _new_element("geom", name=name, **kept)
    if shape.part is None:
        assert shape.mesh is not None
        corners = numbers(np.asarray(shape.mesh.vertices).ravel())
        _append(assets, _new_element("mesh", name=name, inertia="shell", scale="1 1 1", vertex=corners))
        own = {"type": "mesh", "mesh": name, "pos": "0 0 0", "quat": "1 0 0 0"}
    else:
        own = {
            "type": shape.part.field.kind,
            "size": numbers(geom_size(shape.part.field)),
            "pos": numbers(shape.part.translation),
            "quat": numbers(shape.part.rotation),
        }
    for key, value in {**own, "mass": "0"}.items():
        element.set(key, value)
    return element


def _is_named(geom: Any) -> bool:
    """Whether another element than a contact pair names it."""
    name = geom.get("name")
    if not name:
        return False
    return any(
        element is not geom and element.tag != "pair" and name in element.attrib.values()
        for element in geom.getroottree().getroot().iter()
        if isinstance(element.tag, str) and element.tag not in ("mesh", "body", "material", "joint")
    )


def _expand_pairs(root: Any, renamed: Mapping[str, Sequence[str]]) -> None:
    """Contact pairs between geoms that were replaced, between all that stand for them."""
    for pair in list(root.iter("pair")):
        sides = [renamed.get(pair.get(key), [pair.get(key)]) for key in ("geom1", "geom2")]
        if sum(map(len, sides)) == 2 and sides == [[pair.get("geom1")], [pair.get("geom2")]]:
            continue
        for number, (one, other) in enumerate(itertools.product(*sides), 1):
            twin = copy.deepcopy(pair)
            twin.set("geom1", one)
            twin.set("geom2", other)
            if pair.get("name"):
                twin.set("name", f"{pair.get('name')}_{number}")
            pair.addprevious(twin)
        _remove(pair)


def _free(name: str, taken: set[str | None]) -> str:
    free, number = name, 1
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    taken.add(free)
    return free


def _append(parent: Any, child: Any) -> None:
    child.tail = "\n"
    parent.append(child)


def _remove(element: Any) -> None:
    """Without the text that follows it, but for its line."""
    before = element.getprevious()
    parent = element.getparent()
    if element.tail and element.tail.strip():
        if before is not None:
            before.tail = (before.tail or "") + element.tail
        else:
            parent.text = (parent.text or "") + element.tail
    parent.remove(element)
