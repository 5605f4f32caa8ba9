"""Pipes in the sources for CAD programs: corners of the path and radii of its bends, by name."""

from __future__ import annotations

from typing import Any

from partwright.fields import Pipe

MEANING = {
    "path": "corners x, y and z of the path",
    "bend": "radius in which the path takes its corners",
    "bends": "radii in which the path takes the corners between its ends",
}


def pipe_parameters(field: Pipe) -> dict[str, Any]:
    """By name, as few as say it: bends of one radius are one number."""
    corners = field.bent_corners
    bends = tuple(bend for *_, bend in corners[1:-1])
    numbers: dict[str, Any] = {"path": tuple(corner[:3] for corner in corners)}
    if bends:
        numbers |= {"bend": bends[0]} if len(set(bends)) == 1 else {"bends": bends}
    wall = {"thickness": field.thickness} if field.thickness else {}
    return numbers | {"radius": field.radius} | wall


def scad_pipe(names: dict[str, str]) -> str:
    """names: parameter -> variable."""
    bends = names.get("bend") or names.get("bends") or "0"
    wall = f", {names['thickness']}" if "thickness" in names else ""
    return f"pipe_along({names['path']}, {bends}, {names['radius']}{wall});"


def build123d_pipe(names: dict[str, str]) -> tuple[str, str]:
    """The path, and the solid along it."""
    bends = names.get("bend") or names.get("bends")
    path = f"bent_path({names['path']}, {bends})" if bends else f"bent_path({names['path']})"
    section = f"bd.Circle({names['radius']})"
    if "thickness" in names:
        section = f"({section} - bd.Circle({names['radius']} - {names['thickness']}))"
    return path, f"bd.sweep((path ^ 0) * {section}, path)"
