"""Small detail of a face that no feature has is told once, and nothing else is taken for it."""

from __future__ import annotations

import pytest
import trimesh
from manifold3d import CrossSection, FillRule, Manifold

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box
from partwright.superfrusta.far_places import Solid
from partwright.superfrusta.feature_assembly import in_unit_frame
from partwright.superfrusta.left_out import left_out, left_out_warnings
from partwright.superfrusta.sharp_edges import sharp_edge_warnings

PLATE = Manifold.cube((60, 40, 10), center=True)
FOUND = Part(Box((60, 40, 10)))


def letters(height: float, at: float) -> Manifold:
    """H, E, F and T, each 10 high."""
    strokes = {
        0: [(0, 0, 2, 10), (4, 0, 6, 10), (0, 4, 6, 6)],
        8: [(0, 0, 2, 10), (0, 0, 6, 2), (0, 4, 5, 6), (0, 8, 6, 10)],
        16: [(0, 0, 2, 10), (0, 4, 5, 6), (0, 8, 6, 10)],
        24: [(2, 0, 4, 10), (0, 8, 6, 10)],
    }
    bars = [
        [(a + x - 20, b), (c + x - 20, b), (c + x - 20, d), (a + x - 20, d)]
        for x, own in strokes.items()
        for a, b, c, d in own
    ]
    return Manifold.extrude(CrossSection(bars, FillRule.NonZero), height).translate((0, 0, at))


def told(drawn: Manifold, *found: Part) -> tuple[str, ...]:
    mesh = drawn.to_mesh64()
    shape = pw.load_shape(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts), unit="mm")
    own = in_unit_frame(shape, Assembly(found))
    fitted = Solid.of(own)
    details = left_out(shape, own, fitted)
    return left_out_warnings(shape, details) + sharp_edge_warnings(shape, fitted, details)


@pytest.mark.parametrize(
    ("drawn", "how"),
    [
        (PLATE - letters(1.0, 4.5), "is cut in by 0.5 mm at the upper"),
        (PLATE + letters(1.0, 4.5), "stands out by 0.5 mm at the upper"),
    ],
)
def test_letters_have_one_line(drawn: Manifold, how: str) -> None:
    (line,) = told(drawn, FOUND)
    assert line.startswith("left out: small detail (4 places, as letters are) that")
    assert how in line


def test_small_holes_through_a_sheet_have_one_line() -> None:
    """Their walls face neither way of the sheet, both of whose sides go on around them."""
    hole = Manifold.cylinder(4, 1.0, center=True)
    holes = [hole.translate((x, y, 0)) for x in (-20, 20) for y in (-10, 10)]
    sheet = Manifold.cube((60, 40, 2), center=True)
    (line,) = told(sheet - sum(holes[1:], holes[0]), Part(Box((60, 40, 2))))
    assert line.startswith("left out: small detail (4 places, as letters are) that is cut in by")


def test_what_freeform_steps_leave_is_no_detail() -> None:
    step = Part(Box((10, 10, 10)), (-20, 0, 0), name="freeform_1")
    (line,) = told(PLATE - letters(1.0, 4.5), FOUND, step)
    assert "3 places" in line


def test_a_groove_along_an_edge_is_no_chamfer() -> None:
    """Both of its walls lean, beside an edge that is sharp as it was drawn."""
    groove = Manifold.cube((30, 1, 1), center=True).rotate((45, 0, 0)).translate((0, 19, 5))
    (line,) = told(PLATE - groove, FOUND)
    assert line.startswith("left out: small detail that is cut in by 0.7")
    rim = Manifold.cube((80, 2, 2), center=True).rotate((45, 0, 0)).translate((0, 20, 5))
    (line,) = told(PLATE - rim, FOUND)
    assert line.startswith("left sharp: a chamfer")


def test_what_is_a_little_shorter_is_no_detail() -> None:
    """A post whose end is off lies beside no face that goes on."""
    post = Manifold.cube((8, 8, 10), center=True).translate((0, 0, 9.5))
    assert told(PLATE + post, FOUND, Part(Box((8, 8, 10)), (0, 0, 9))) == ()
    assert told(PLATE, FOUND) == ()
