"""SDFormat: read with its comments, written with other collision elements and else as it was."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import RobotError
from partwright.export.rigid_body import numbers
from partwright.export.urdf import roll_pitch_yaw
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.model import Files, Link, MeshUse, RobotFile, Shape
from partwright.robots.native_solids import native_solids
from partwright.robots.paths import Place, carried, find, new_address, with_companions
from partwright.robots.sdf_frames import SdfFrames
from partwright.robots.xml_files import parsed, serialised, stl, three


class Sdf(RobotFile):
    """A model, or a world of models, in SDFormat. Models that it includes by address stay as they are."""

    kinds: ClassVar[tuple[type[Field], ...]] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        """Raises UnreadableFileError or RobotError, which name the link."""
        self.path, self.packages = path, packages
        self._tree = parsed(path, "sdf")
        self._frames = SdfFrames(path)
        self._places: dict[str, Place] = {}
        self._links = dict(self._named(self._tree.getroot(), ""))
        parents: dict[str, list[str]] = {name: [] for name in self._links}
        for joint in self._tree.getroot().iter("joint"):
            child, parent = (_scoped(joint, joint.findtext(end, "").strip()) for end in ("child", "parent"))
            if child in parents and parent in parents:
                parents[child].append(parent)
        self.links = [
            self._link(name, element, tuple(parents[name])) for name, element in self._links.items()
        ]

    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        files = Files()
        tree = copy.deepcopy(self._tree)
        for name, link in self._named(tree.getroot(), ""):
            if name in shapes:
                self._replace(link, shapes[name], files)
        for uri in tree.getroot().iterfind(".//mesh/uri"):
            place = self._places.get((uri.text or "").strip())
            if place is not None and not uri.get("new"):
                files.copied.update(with_companions(place))
                uri.text = place.address
        for uri in tree.getroot().iterfind(".//mesh/uri[@new]"):
            del uri.attrib["new"]
        for picture in tree.getroot().iterfind(".//material//*"):
            if str(picture.tag).endswith("_map") and (picture.text or "").strip():
                address = picture.text.strip()
                picture.text = carried(address, self.path.parent, self.packages, files.copied)
        files.written[self.path.name] = serialised(tree)
        return files

    def _named(self, element: Any, scope: str) -> Iterator[tuple[str, Any]]:
        """Links with their names, those of nested models as MODEL::LINK."""
        for child in element:
            if child.tag == "link":
                if not child.get("name"):
                    raise RobotError(f"{self.path}: line {child.sourceline}: a link without a name")
                yield scope + child.get("name"), child
            elif child.tag in ("model", "world"):
                within = f"{scope}{child.get('name')}::" if element.tag in ("model", "world") else ""
                yield from self._named(child, within)

    def _link(self, name: str, element: Any, parents: tuple[str, ...]) -> Link:
        uses: dict[str, list[MeshUse]] = {"visual": [], "collision": []}
        natives: list[Part] = []
        for role, found in uses.items():
            for child in element.findall(role):
                place = self._frames.within(child, element)
                mesh = child.find("geometry/mesh")
                if mesh is not None:
                    found.append(self._use(mesh, place, name))
                elif role == "collision":
                    natives += native_solids(
                        child, place, _read, self.kinds, f"link {name!r}: collision", self.path
                    )
        pose = self._frames.placed(element)
        above = element.getparent()
        while above is not None and above.tag == "model":
            pose = self._frames.placed(above) @ pose
            above = above.getparent()
        return Link(name, pose, parents, tuple(uses["collision"]), tuple(uses["visual"]), tuple(natives))

    def _use(self, mesh: Any, place: np.ndarray, link: str) -> MeshUse:
        address = mesh.findtext("uri", "").strip()
        if address not in self._places:
            self._places[address] = find(address, self.path.parent, self.packages, link)
        scale = three(mesh.findtext("scale", "1 1 1"), self.path, f"link {link!r}: scale")
        part = mesh.find("submesh")
        return MeshUse(
            self._places[address].path,
            place @ np.diag([*scale, 1.0]),
            submesh=None if part is None else part.findtext("name", "").strip(),
            centred=part is not None and part.findtext("center", "false").strip() in ("true", "1"),
        )

    def _replace(self, link: Any, shapes: Sequence[Shape], files: Files) -> None:
        old = [c for c in link.findall("collision") if c.find("geometry/mesh") is not None]
        like = self._places[old[0].findtext("geometry/mesh/uri", "").strip()]
        first, tail = link.index(old[0]), old[0].tail
        for element in old:
            link.remove(element)
        for i, shape in enumerate(shapes):
            element = _collision(shape, like, old[0], files)
            element.tail = tail
            link.insert(first + i, element)


def _scoped(joint: Any, name: str) -> str:
    """A link as a joint names it, with the models that the joint is nested in."""
    scope, above = "", joint.getparent()
    while above is not None and above.getparent() is not None and above.getparent().tag in ("model", "world"):
        scope, above = f"{above.get('name')}::{scope}", above.getparent()
    return scope + name


def _collision(shape: Shape, like: Place, old: Any, files: Files) -> Any:
    """A collision element with the surface, contact bits and whatever else the old one had."""
    from lxml import etree

    element = etree.Element("collision", name=shape.name)
    geometry = etree.SubElement(element, "geometry")
    if shape.part is None:
        address, within = new_address(f"{shape.name}.stl", like)
        files.written[within] = stl(shape.mesh)
        uri = etree.SubElement(etree.SubElement(geometry, "mesh"), "uri", new="yes")
        uri.text = address
    else:
        angles = roll_pitch_yaw(rotation_matrix(shape.part.rotation))
        pose = etree.Element("pose")
        pose.text = numbers([*shape.part.translation, *angles])
        element.insert(0, pose)
        solid = etree.SubElement(geometry, shape.part.field.kind)
        for key, value in _sizes(shape.part.field).items():
            etree.SubElement(solid, key).text = value
    for child in old:
        if child.tag not in ("pose", "geometry"):
            element.append(copy.deepcopy(child))
    return element


def _read(element: Any, key: str) -> str:
    return str(element.findtext(key, ""))


def _sizes(field: Field) -> dict[str, str]:
    match field:
        case Box(size=size):
            return {"size": numbers(size)}
        case Sphere(radius=radius):
            return {"radius": numbers([radius])}
        case Cylinder(radius=radius, height=height) | Capsule(radius=radius, height=height):
            return {"radius": numbers([radius]), "length": numbers([height])}
        case Ellipsoid(radii=radii):
            return {"radii": numbers(radii)}
    raise AssertionError(f"SDFormat has no {field.kind}")
