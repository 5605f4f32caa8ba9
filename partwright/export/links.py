"""An assembly as links that joints tie together: the children of its root, where their metadata say so.

A child's metadata: `joint`: fixed, revolute, continuous or prismatic; `joint_origin` and `joint_axis`: three
numbers, "0 0 50", in the assembly's own unit and axes; `joint_lower`, `joint_upper`: radians, or lengths in
the assembly's unit; `joint_parent`: the name of another child, else the first.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Node, Similarity
from partwright.assembly.names import unique_names
from partwright.errors import ParameterError, SettingError

JOINTS = ("fixed", "revolute", "continuous", "prismatic")
_KEYS = ("joint_origin", "joint_axis", "joint_lower", "joint_upper", "joint_parent")


@dataclass(frozen=True)
class Joint:
    """kind: one of `JOINTS`. origin: (3,) of the child's frame in the parent's. axis: (3,) unit. limits: in
    radians or lengths; None where there are none."""

    kind: str
    parent: str
    origin: np.ndarray
    axis: np.ndarray
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class Link:
    """A link's name, what it holds in its own frame, and the joint to its parent; None for the first."""

    name: str
    assembly: Assembly
    joint: Joint | None


def links_of(assembly: Assembly, links: bool) -> list[Link]:
    """The links, each after its parent: one for the whole, or where `links` or a child's joint ask for it,
    one for each child of the root.

    Raises:
        SettingError: links are asked for of what is no union of several.
        ParameterError: a joint's numbers make no sense, its parent is not there, or joints form a loop.
    """
    said = [child for child in assembly.children if any(key in child.metadata for key in ("joint", *_KEYS))]
    if not links and not said:
        return [Link(assembly.name or "assembly", assembly, None)]
    if assembly.operation != "union" or len(assembly.children) < 2:
        raise SettingError("links: expected a union of several children, each of which becomes a link")
    children = assembly.children
    names = unique_names([_name(child) for child in children], ["link"] * len(children))
    origins = [_vector(child, "joint_origin", (0.0, 0.0, 0.0)) for child in children]
    found: dict[str, Link] = {}
    waiting = dict(zip(names, zip(children, origins, strict=True), strict=True))
    for name, (child, _) in waiting.items():
        parent = str(child.metadata.get("joint_parent", names[0]))
        if name != names[0] and parent not in names:
            raise ParameterError(
                f"joint of {name!r}: there is no link {parent!r}; links are {', '.join(names)}"
            )
    base = np.array(origins[0])
    found[names[0]] = Link(names[0], _alone(assembly, children[0], names[0], base), None)
    while len(found) < len(names):
        ready = [n for n in names if n not in found and _parent(waiting[n][0], names) in found]
        if not ready:
            rest = ", ".join(repr(n) for n in names if n not in found)
            raise ParameterError(f"the joints of {rest} form a loop; each link needs a way to {names[0]!r}")
        for name in ready:
            child, origin = waiting[name]
            parent = _parent(child, names)
            joint = _joint(name, child, parent, np.array(origin) - np.array(waiting[parent][1]))
            found[name] = Link(name, _alone(assembly, child, name, np.array(origin)), joint)
    return list(found.values())


def placed(joint: Joint, frame: Similarity) -> Joint:
    """The joint in the format's unit and axes."""
    turn = dataclasses.replace(frame, scale=1.0, translation=(0.0, 0.0, 0.0))
    limits = joint.limits
    if limits is not None and joint.kind == "prismatic":
        limits = limits[0] * frame.scale, limits[1] * frame.scale
    origin = turn(joint.origin[None])[0] * frame.scale
    return dataclasses.replace(joint, origin=origin, axis=turn(joint.axis[None])[0], limits=limits)


def _alone(assembly: Assembly, child: Node, name: str, origin: np.ndarray) -> Assembly:
    """A link's own assembly in its own frame; what it melted into is another body."""
    local = dataclasses.replace(child, blend=0.0).translated(tuple((-origin).tolist()))
    return dataclasses.replace(assembly, children=(local,), name=name, blend=0.0)


def _joint(name: str, child: Node, parent: str, origin: np.ndarray) -> Joint:
    kind = str(child.metadata.get("joint", "fixed"))
    if kind not in JOINTS:
        raise ParameterError(f"joint of {name!r}: expected one of {', '.join(JOINTS)}, got {kind!r}")
    axis = np.array(_vector(child, "joint_axis", (0.0, 0.0, 1.0)))
    length = float(np.linalg.norm(axis))
    if not length > 0:
        raise ParameterError(f"joint of {name!r}: its axis has no length")
    return Joint(kind, parent, origin, axis / length, _limits(name, kind, child.metadata))


def _limits(name: str, kind: str, said: Mapping[str, str | float]) -> tuple[float, float] | None:
    if kind not in ("revolute", "prismatic"):
        return None
    lower, upper = (_number(name, said, key) for key in ("joint_lower", "joint_upper"))
    if lower is None or upper is None or not lower < upper:
        raise ParameterError(
            f"joint of {name!r}: a {kind} one needs joint_lower below joint_upper, got {lower} and {upper}"
        )
    return lower, upper


def _number(name: str, said: Mapping[str, str | float], key: str) -> float | None:
    if key not in said:
        return None
    try:
        value = float(said[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(f"joint of {name!r}: {key} is no number: {said[key]!r}")
    return value


def _vector(child: Node, key: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
    if key not in child.metadata:
        return default
    try:
        x, y, z = (float(word) for word in str(child.metadata[key]).replace(",", " ").split())
    except ValueError as error:
        raise ParameterError(
            f"{key} of {_name(child)!r}: expected three numbers, got {child.metadata[key]!r}"
        ) from error
    if not np.isfinite([x, y, z]).all():
        raise ParameterError(
            f"{key} of {_name(child)!r}: expected finite numbers, got {child.metadata[key]!r}"
        )
    return x, y, z


def _parent(child: Node, names: list[str]) -> str:
    return str(child.metadata.get("joint_parent", names[0]))


def _name(node: Node) -> str:
    return node.name or (node.parts[0].name if isinstance(node, Assembly) else "")
