"""Faces of a STEP file that OpenCASCADE leaves out at one tolerance are made at another."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.meshing.manifolds import closed
from partwright.shapes import step

OCP = pytest.importorskip("OCP.BRepPrimAPI", reason="needs the extra cad")


@pytest.mark.parametrize("fails", [0, 1, 2, 9])
def test_faces_without_triangles_are_tried_at_other_tolerances(
    fails: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chamfer of a printed part, a valid cone, had none at any finer tolerance: its body stayed open, and
    no feature was found in it. Where nothing helps, the best is kept."""
    tried: list[float] = []
    real = step._left_out

    def left_out(solid: object, deflection: float) -> int:
        tried.append(deflection)
        return real(solid, deflection) + (len(tried) <= fails)

    monkeypatch.setattr(step, "_left_out", left_out)
    rod = OCP.BRepPrimAPI_MakeCylinder(1.0, 2.0).Shape()
    step._tessellate([rod])
    first = tried[0]
    assert [one / first for one in tried] == pytest.approx(
        {0: [1], 1: [1, 2], 2: [1, 2, 0.5], 9: [1, 2, 0.5, 4, 1]}[fails]
    )
    vertices, faces = step._triangles(rod)
    merged, index = np.unique(np.round(vertices, 9), axis=0, return_inverse=True)
    assert closed(merged, index.ravel()[faces]).volume() == pytest.approx(2 * np.pi, rel=0.03)
