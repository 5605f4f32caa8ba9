"""Meshes of parts that no formula draws, for the page: learned parts, each in its own frame."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.assembly.joint import is_joint
from partwright.errors import NoSurfaceError

_STEPS = 32767  # of a coordinate, from the middle of the box to its side


def part_meshes(assembly: Assembly) -> str | None:
    """JSON: by the parts' names, meshes as the page reads them (studio/src/model/learned.ts); None where no
    part needs one. A part without a surface is left out.

    Places are 16-bit steps from `centre`, of `half` / 32767 along each axis; both arrays are base64 of
    little-endian numbers.
    """
    learned = [part for part in assembly.parts if is_joint(part)]
    if not learned:
        return None
    meshes = {}
    for part in learned:
        try:
            meshes[part.name] = _mesh(part)
        except NoSurfaceError:
            continue
    return json.dumps(meshes, allow_nan=False)


def _mesh(part: Part) -> dict[str, Any]:
    assert is_joint(part)
    mesh = part.field.preview()
    low, high = mesh.bounds
    centre, half = (low + high) / 2, np.maximum((high - low) / 2, 1e-300)
    steps = np.round((np.asarray(mesh.vertices) - centre) / half * _STEPS).astype("<i2")
    triangles = np.asarray(mesh.faces).astype("<u4")
    return {
        "centre": centre.tolist(),
        "half": half.tolist(),
        "places": base64.b64encode(steps.tobytes()).decode("ascii"),
        "triangles": base64.b64encode(triangles.tobytes()).decode("ascii"),
        "half_lengths": list(getattr(part.field, "half_lengths", (1.0, 1.0, 1.0))),
    }
