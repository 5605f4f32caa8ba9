"""Wheels that turn: the speed of a body's surface, and a case whose wall moves with it.

A wheel rolls on the ground: it turns about an axle through the middle of its part, each copy of it about its
own, across the flow, so fast that its lowest point goes with the ground. The body's mesh stands still; its
wall has a speed (as OpenFOAM's rotatingWallVelocity, face by face, so that wheels need no patches of their
own).
"""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import trimesh

from partwright.assembly import Assembly
from partwright.errors import SettingError, SimulationError
from partwright.goals.flow.air import Air
from partwright.goals.objectives.axes import axis
from partwright.goals.surface import face_labels
from partwright.shapes import MeshDistance

_STILL = "body { type noSlip; }"


def surface_speeds(assembly: Assembly, surface: trimesh.Trimesh, air: Air, metres: float) -> np.ndarray:
    """(F, 3) m/s at each face's centre: that of the parts that `air.turning` names, 0 elsewhere.

    metres: length of the assembly's unit.

    Raises:
        SettingError: no part has such a name, or the middle of one is not above the ground.
    """
    up = axis(air.ground, "z", "ground")
    centres = metres * np.asarray(surface.triangles_center)
    ground = float((metres * np.asarray(surface.vertices) @ up).min())
    labels = face_labels(assembly, surface)
    speeds = np.zeros_like(centres)
    for i in turning_parts(assembly, air):
        copies = assembly.parts[i].copies
        own = np.flatnonzero(labels == i)
        nearest = Assembly(copies).nearest_parts(np.asarray(surface.triangles_center)[own])
        for k, copy in enumerate(copies):
            middle = metres * np.asarray(copy.translation, dtype=float)
            radius = float(middle @ up) - ground
            if radius <= 0:
                raise SettingError(f"air: the middle of {copy.name} is not above the ground")
            rate = air.speed / radius * np.cross(air.direction, up)
            mine = own[nearest == k]
            speeds[mine] = np.cross(rate, centres[mine] - middle)
    return speeds


def turning_parts(assembly: Assembly, air: Air) -> list[int]:
    """Places of the leaves that turn.

    Raises:
        SettingError: there is none of such a name.
    """
    found = [i for i, part in enumerate(assembly.parts) if fnmatchcase(part.name, air.turning)]
    if air.turning and not found:
        names = ", ".join(part.name for part in assembly.parts)
        raise SettingError(f"air: no part is called {air.turning!r}, to turn; there are {names:.200}")
    return found


def turn_wall(folder: Path, surface: trimesh.Trimesh, speeds: np.ndarray, metres: float) -> None:
    """Give the wall of a case that is meshed the speeds (F, 3) of the surface's nearest faces.

    Raises:
        SimulationError: the mesh cannot be read, or the case has no wall that stands still.
    """
    centres = np.array([corners.mean(axis=0) for corners in body_faces(folder)])
    vertices, faces = metres * np.asarray(surface.vertices), np.asarray(surface.faces)
    middle, scale = vertices.mean(axis=0), 1 / float(np.ptp(vertices, axis=0).max())
    there = MeshDistance((vertices - middle) * scale, faces, faces, True)
    nearest, _ = there.nearest((centres - middle) * scale)
    rows = "\n".join("({:.9g} {:.9g} {:.9g})".format(*speeds[i]) for i in nearest)
    path = folder / "0" / "U"
    text = path.read_text(encoding="utf-8")
    if _STILL not in text:
        raise SimulationError(f"{path}: expected a wall that stands still, {_STILL!r}; there is none to turn")
    moving = f"body {{ type fixedValue; value nonuniform List<vector>\n{len(centres)}\n(\n{rows}\n);\n }}"
    path.write_text(text.replace(_STILL, moving), encoding="utf-8")


def body_faces(folder: Path) -> list[np.ndarray]:
    """Corners (K, 3) of each face of the body, as the case has meshed it, in metres.

    Raises:
        SimulationError: the mesh is not there, or cannot be read.
    """
    mesh = folder / "constant" / "polyMesh"
    try:
        found = re.search(
            r"\bbody\s*\{.*?nFaces\s+(\d+);\s*startFace\s+(\d+);", (mesh / "boundary").read_text(), re.S
        )
        count, first = (int(number) for number in found.groups()) if found else (0, 0)
        listed = re.findall(r"\d+\(([\d ]+)\)", (mesh / "faces").read_text())[first : first + count]
        text = (mesh / "points").read_text()
        rows = re.findall(r"\(([^()]+)\)", text[text.index("(", text.index("object")) + 1 :])
        points = np.array([row.split() for row in rows], dtype=float)
        corners = [points[[int(word) for word in face.split()]] for face in listed]
    except (OSError, ValueError, IndexError) as error:
        raise SimulationError(f"{mesh}: the mesh of the air cannot be read: {error}") from error
    if not corners:
        raise SimulationError(f"{mesh}: nothing of the body is in the mesh of the air")
    return corners
