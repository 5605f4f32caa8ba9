"""Fits of solids whose rods and tubes bend: each is one pipe, with the numbers that it was drawn by."""

from __future__ import annotations

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Pipe, Revolution
from partwright.meshing import mesh_csg
from partwright.shapes import load_shape

DOWN = (0.5**0.5, 0.5**0.5, 0.0, 0.0)


def fitted(assembly: Assembly) -> pw.Result:
    return pw.fit(load_shape(mesh_csg(assembly, 0.01), unit="mm"), "solids", quality="draft")


def pipes(result: pw.Result) -> list[Pipe]:
    return [part.field for part in result.assembly.parts if isinstance(part.field, Pipe)]


def test_a_hook_with_a_peg_is_two_parts() -> None:
    """A rod of 6 mm: straight, around in half a turn, and back; a thicker peg stands on it."""
    rod = Pipe(((60, 0, 0), (0, 0, 0, 12), (0, 24, 0, 12), (20, 24, 0)), 3)
    result = fitted(Assembly((Part(rod), Part(Cylinder(4, 20), (40, -10, 0), DOWN))))
    assert sorted(part.field.kind for part in result.assembly.parts) == ["cylinder", "pipe"]
    (again,) = pipes(result)
    assert again.radius == pytest.approx(3, abs=0.01)
    assert again.length == pytest.approx(rod.length, rel=2e-3)
    assert [corner[3] for corner in again.path[1:-1]] == pytest.approx([12, 12], rel=5e-3)
    assert result.scores.iou > 0.99
    assert {part.name for part in result.assembly.parts} == {"base_rod", "boss"}


def test_a_bent_tube_with_a_flange_keeps_its_bore() -> None:
    tube = Pipe(((0, 0, 0), (50, 0, 0, 25), (50, 50, 0)), 10, 2)
    flange = Assembly((Part(Cylinder(20, 5), (0, 0, 0), (0.5**0.5, 0, 0.5**0.5, 0)),))
    bore = Part(Cylinder(8, 30), (0, 0, 0), (0.5**0.5, 0, 0.5**0.5, 0))
    result = fitted(Assembly((Part(tube), Assembly((*flange.children, bore), "difference"))))
    (again,) = pipes(result)
    assert again.radius == pytest.approx(10, abs=0.02)
    assert again.thickness == pytest.approx(2, abs=0.02)
    assert result.scores.iou > 0.98
    assert len(result.assembly) <= 3


def test_a_bent_channel_is_cut_as_a_pipe() -> None:
    channel = Pipe(((-40, 0, 0), (0, 0, 0, 15), (0, 40, 0)), 6)
    result = fitted(Assembly((Part(Box((60, 60, 30))), Part(channel)), "difference"))
    block, cut = result.assembly.parts
    assert (block.field.kind, cut.field.kind) == ("box", "pipe")
    assert cut.name == "channel"
    assert result.scores.iou > 0.995


def test_one_bend_alone_is_turned() -> None:
    """What goes on nowhere is no pipe with a path."""
    bend = Pipe(((0, 0, 0), (40, 0, 0, 40), (40, 40, 0)), 8)
    (part,) = fitted(Assembly((Part(bend),))).assembly.parts
    assert isinstance(part.field, Pipe | Revolution)
    points = np.array(part.bounds())
    assert np.abs(points - np.array(bend.bounds())).max() < 0.1
