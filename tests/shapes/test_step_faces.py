"""Faces of a STEP file that OpenCASCADE leaves out at one tolerance are made at another."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from partwright.meshing.manifolds import closed
from partwright.shapes import step

OCP = pytest.importorskip("OCP.BRepPrimAPI", reason="needs the extra cad")


class LeavingOut:
    """In place of `_left_out`: one face more, the first few times that it is asked, and after `passing` times
    that it is not."""

    def __init__(self, patch: pytest.MonkeyPatch, fails: int, passing: int = 0) -> None:
        self.asked, self.fails, self.passing, self.real = 0, fails, passing, step._left_out
        patch.setattr(step, "_left_out", self)

    def __call__(self, solid: object) -> int:
        self.asked += 1
        return self.real(solid) + (self.passing < self.asked <= self.passing + self.fails)


def volume(mesh: tuple[np.ndarray, np.ndarray]) -> float:
    merged, index = np.unique(np.round(mesh[0], 9), axis=0, return_inverse=True)
    return closed(merged, index.ravel()[mesh[1]]).volume()


def ball() -> Any:
    return OCP.BRepPrimAPI_MakeSphere(1.0).Shape()


@pytest.mark.parametrize(("fails", "tries", "share"), [(0, 1, 1.0), (1, 2, 2.0), (2, 3, 0.5), (9, 4, 1.0)])
def test_faces_without_triangles_are_tried_at_other_tolerances(
    fails: int, tries: int, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chamfer of a printed part, a valid cone, had none at any finer tolerance: its body stayed open, and
    no feature was found in it. Where nothing helps, the best is kept."""
    monkeypatch.setattr(step, "TOLERANCE", share * step.TOLERANCE)
    (wanted,) = step._meshes([ball()])
    monkeypatch.undo()
    left_out = LeavingOut(monkeypatch, fails)
    (found,) = step._meshes([ball()])
    assert left_out.asked == tries
    assert len(found[1]) == len(wanted[1])
    assert volume(found) == pytest.approx(4 / 3 * np.pi, rel=0.03)


@pytest.mark.parametrize("passing", [0, 1])
def test_solids_with_a_common_face_both_close(passing: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The face was made anew with the one solid, and no longer fitted the other."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Splitter
    from OCP.collections import List_TopoDS_Shape
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_ShapeEnum

    splitter = BRepAlgoAPI_Splitter()
    whole, tool = List_TopoDS_Shape(), List_TopoDS_Shape()
    whole.Append(OCP.BRepPrimAPI_MakeCylinder(1.0, 2.0).Shape())
    tool.Append(OCP.BRepPrimAPI_MakeBox(gp_Pnt(-2, -2, 1), 4.0, 4.0, 4.0).Shape())
    splitter.SetArguments(whole)
    splitter.SetTools(tool)
    splitter.Build()
    halves = list(step.parts_of(splitter.Shape(), TopAbs_ShapeEnum.TopAbs_SOLID))
    assert len(halves) == 2
    LeavingOut(monkeypatch, 1, passing)
    low, high = step._meshes(halves)
    assert volume(low) == pytest.approx(np.pi, rel=0.03)
    assert volume(high) == pytest.approx(np.pi, rel=0.03)


def test_what_is_placed_several_times_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    left_out = LeavingOut(monkeypatch, 9)
    box = OCP.BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape()
    shift, turn = gp_Trsf(), gp_Trsf()
    shift.SetTranslation(gp_Vec(10, 0, 0))
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), np.pi / 2)
    there = box.Moved(TopLoc_Location(shift))
    placed = list(step._meshes([box, there, there.Moved(TopLoc_Location(turn)), box.Reversed()]))
    ends = [[mesh[0].min(axis=0).tolist(), mesh[0].max(axis=0).tolist()] for mesh in placed[:3]]
    assert np.allclose(ends, [[(0, 0, 0), (1, 2, 3)], [(10, 0, 0), (11, 2, 3)], [(-2, 10, 0), (0, 11, 3)]])
    assert [volume(mesh) for mesh in placed] == pytest.approx([6, 6, 6, -6])
    assert left_out.asked == 8  # four tries each of the box and of its inside
