"""URDF: read with its comments, written with other collision elements and else as it was."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import RobotError
from partwright.export.rigid_body import numbers
from partwright.export.urdf import roll_pitch_yaw
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.model import Files, Link, MeshUse, RobotFile, Shape, frame, from_roll_pitch_yaw
from partwright.robots.native_solids import native_solids
from partwright.robots.paths import Place, carried, find, new_address, with_companions
from partwright.robots.xml_files import parsed, serialised, stl, three


class Urdf(RobotFile):
    """A URDF file. A capsule, which URDF lacks, is written as a cylinder and two spheres."""

    kinds: ClassVar[tuple[type[Field], ...]] = (Box, Cylinder, Sphere)
    composed: ClassVar[tuple[type[Field], ...]] = (Capsule,)

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        """Raises UnreadableFileError or RobotError, which name the link."""
        self.path, self.packages = path, packages
        self._tree = parsed(path, "robot")
        root = self._tree.getroot()
        if any("xacro" in str(space) for space in root.nsmap.values()) and root.xpath(
            "//*[contains(name(), 'xacro')]"
        ):
            raise RobotError(f"{path}: it is xacro source; run it through xacro first, and give the URDF")
        self._places: dict[str, Place] = {}
        self._elements = {self._name(link): link for link in root.findall("link")}
        if len(self._elements) < len(root.findall("link")):
            raise RobotError(f"{path}: two links have the same name")
        parents = self._parents()
        poses = {name: self._pose(name, parents) for name in self._elements}
        self.links = [self._link(name, poses[name], parents) for name in self._elements]

    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        files = Files()
        tree = copy.deepcopy(self._tree)
        for link in tree.getroot().findall("link"):
            for mesh in link.iterfind("visual/geometry/mesh"):
                self._carry(mesh, files)
            if link.get("name") in shapes:
                self._replace(link, shapes[link.get("name")], files)
            else:
                for mesh in link.iterfind("collision/geometry/mesh"):
                    self._carry(mesh, files)
        for texture in tree.getroot().iterfind(".//material/texture[@filename]"):
            address = texture.get("filename")
            texture.set("filename", carried(address, self.path.parent, self.packages, files.copied))
        files.written[self.path.name] = serialised(tree)
        return files

    def _name(self, element: Any) -> str:
        name = element.get("name")
        if not name:
            raise RobotError(f"{self.path}: line {element.sourceline}: a {element.tag} without a name")
        return str(name)

    def _parents(self) -> dict[str, tuple[str, np.ndarray]]:
        """child -> its parent and the (4, 4) of its joint."""
        result: dict[str, tuple[str, np.ndarray]] = {}
        for joint in self._tree.getroot().findall("joint"):
            name = self._name(joint)
            ends = []
            for role in ("parent", "child"):
                end = joint.find(role)
                link = end.get("link") if end is not None else None
                if link not in self._elements:
                    raise RobotError(f"{self.path}: joint {name!r}: its {role} link {link!r} is not there")
                ends.append(link)
            if ends[1] in result:
                raise RobotError(f"{self.path}: link {ends[1]!r} hangs on two joints: {name!r} closes a loop")
            result[ends[1]] = (ends[0], _origin(joint, self.path, name))
        return result

    def _pose(self, name: str, parents: dict[str, tuple[str, np.ndarray]]) -> np.ndarray:
        pose, seen = np.eye(4), {name}
        while name in parents:
            name, step = parents[name]
            pose = step @ pose
            if name in seen:
                raise RobotError(f"{self.path}: the joints above link {name!r} are a loop")
            seen.add(name)
        return pose

    def _link(self, name: str, pose: np.ndarray, parents: dict[str, tuple[str, np.ndarray]]) -> Link:
        element = self._elements[name]
        uses: dict[str, list[MeshUse]] = {"visual": [], "collision": []}
        natives: list[Part] = []
        for role, found in uses.items():
            for child in element.findall(role):
                place = _origin(child, self.path, name)
                mesh = child.find("geometry/mesh")
                if mesh is not None:
                    found.append(self._use(mesh, place, name))
                elif role == "collision":
                    natives += native_solids(
                        child, place, _read, self.kinds, f"link {name!r}: collision", self.path
                    )
        above = (parents[name][0],) if name in parents else ()
        return Link(name, pose, above, tuple(uses["collision"]), tuple(uses["visual"]), tuple(natives))

    def _use(self, mesh: Any, place: np.ndarray, link: str) -> MeshUse:
        address = mesh.get("filename") or ""
        if address not in self._places:
            self._places[address] = find(address, self.path.parent, self.packages, link)
        scale = three(mesh.get("scale", "1 1 1"), self.path, f"link {link!r}: scale")
        return MeshUse(self._places[address].path, place @ np.diag([*scale, 1.0]))

    def _carry(self, mesh: Any, files: Files) -> None:
        """A mesh that stays, with what belongs to it."""
        place = self._places[mesh.get("filename")]
        files.copied.update(with_companions(place))
        mesh.set("filename", place.address)

    def _replace(self, link: Any, shapes: Sequence[Shape], files: Files) -> None:
        old = [c for c in link.findall("collision") if c.find("geometry/mesh") is not None]
        like = self._places[old[0].find("geometry/mesh").get("filename")]
        first, tail = link.index(old[0]), old[0].tail
        new = [
            _collision(name, kind, sizes, pose)
            for shape in shapes
            for name, kind, sizes, pose in _elements(shape, like, files)
        ]
        for element in old:
            link.remove(element)
        for i, element in enumerate(new):
            element.tail = tail
            link.insert(first + i, element)


def _origin(element: Any, path: Path, name: str) -> np.ndarray:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    angles = three(origin.get("rpy", "0 0 0"), path, f"{name!r}: rpy")
    return frame(from_roll_pitch_yaw(*angles), three(origin.get("xyz", "0 0 0"), path, f"{name!r}: xyz"))


def _elements(shape: Shape, like: Place, files: Files) -> list[tuple[str, str, dict[str, str], np.ndarray]]:
    """URDF's elements for a shape: name, tag, attributes and (4, 4)."""
    if shape.part is None:
        address, within = new_address(f"{shape.name}.stl", like)
        files.written[within] = stl(shape.mesh)
        return [(shape.name, "mesh", {"filename": address}, np.eye(4))]
    pose = frame(rotation_matrix(shape.part.rotation), shape.part.translation)
    match shape.part.field:
        case Box(size=size):
            return [(shape.name, "box", {"size": numbers(size)}, pose)]
        case Sphere(radius=radius):
            return [(shape.name, "sphere", {"radius": numbers([radius])}, pose)]
        case Cylinder(radius=radius, height=height):
            return [(shape.name, "cylinder", _round(radius, height), pose)]
        case Capsule(radius=radius, height=height):
            ends = [pose @ frame(np.eye(3), (0, 0, side * height / 2)) for side in (1, -1)]
            ball = {"radius": numbers([radius])}
            return [
                (shape.name, "cylinder", _round(radius, height), pose),
                *((f"{shape.name}_end{i}", "sphere", ball, end) for i, end in enumerate(ends, 1)),
            ]
    raise AssertionError(f"URDF has no {shape.part.field.kind}")


def _round(radius: float, height: float) -> dict[str, str]:
    return {"radius": numbers([radius]), "length": numbers([height])}


def _read(element: Any, key: str) -> str | None:
    value: str | None = element.get(key)
    return value


def _collision(name: str, kind: str, sizes: dict[str, str], pose: np.ndarray) -> Any:
    from lxml import etree

    element = etree.Element("collision", name=name)
    if not np.allclose(pose, np.eye(4), atol=1e-15):
        angles = numbers(roll_pitch_yaw(pose[:3, :3]))
        etree.SubElement(element, "origin", xyz=numbers(pose[:3, 3]), rpy=angles)
    etree.SubElement(etree.SubElement(element, "geometry"), kind, sizes)
    return element
