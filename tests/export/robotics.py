"""Assemblies that the robotics formats are tried on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Capsule, Cylinder, Sphere, SuperFrustum, Tube

FLOOR = '<geom type="plane" size="5 5 .1"/>'
TURN = (0.5, 0.5, 0.5, 0.5)


def natives() -> Assembly:
    """In millimetres, Z up: a part of each native kind, none of them touching another."""
    parts = (
        Part(Box((100, 200, 300)), (0, 0, 150), name="base"),
        Part(Cylinder(50, 200), (300, 0, 150), TURN, name="post"),
        Part(Sphere(60), (0, 400, 150), name="ball & <socket>"),
        Part(Capsule(40, 120), (-300, 0, 150), (0.8, 0.6, 0, 0), name="rod"),
    )
    return Assembly(parts, unit="mm", up="z", name="natives")


def awkward() -> Assembly:
    """A blended bent rod, a pyramid, a tube and a block with a hole: only the base is native."""
    rod = SuperFrustum((0.1, 0.1, 1.0), 1.0, 0.03, 1.0, 0.7)
    holed = Assembly(
        (Part(Box((0.5, 0.5, 0.5)), name="block"), Part(Cylinder(0.2, 1.0), name="hole")), "difference"
    )
    children = (
        Part(Box((0.6, 0.6, 0.1)), name="base"),
        Part(rod, (0, 0, 0.5), blend=0.05, name="hook"),
        Part(SuperFrustum((0.6, 0.6, 0.9), taper=0.0), (0, 1.2, 0.0), name="spike"),
        Part(Tube(0.3, 0.02, 0.8), (1, 0, 0), name="cup"),
        holed.translated((-1.0, 0, 0)),
    )
    return Assembly(children, unit="m", up="z", name="awkward")


def with_others(path: Path, others: str) -> Any:
    """The MuJoCo model of an MJCF file with further elements in its world."""
    import mujoco

    text = path.read_text(encoding="utf-8").replace("<worldbody>", f"<worldbody>{others}")
    return mujoco.MjModel.from_xml_string(text)
