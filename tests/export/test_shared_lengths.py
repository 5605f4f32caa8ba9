"""A length that several parts share is typed once in the sources."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.export import export
from partwright.fields import Box, Cylinder


def plate() -> Assembly:
    holes = [Part(Cylinder(2, 8), (x, 0, 0), name=name) for x, name in ((-8, "left"), (8, "right"))]
    return Assembly(
        (Part(Box((30, 20, 5)), name="plate"), *holes, Part(Cylinder(3, 8), name="bore")), "difference"
    )


def test_openscad_and_build123d_type_a_shared_length_once(tmp_path: Path) -> None:
    export(plate(), tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text()
    assert "left_radius = 2;" in text
    assert "right_radius = left_radius;" in text
    assert "bore_radius = 3;" in text
    assert "bore_height = left_height;" in text
    pytest.importorskip("build123d")
    path = tmp_path / "a.build123d.py"
    export(plate(), path)
    source = path.read_text()
    assert "RIGHT_RADIUS = LEFT_RADIUS  #" in source
    whole = runpy.run_path(str(path))["assembly"].volume
    path.write_text(source.replace("LEFT_RADIUS = 2 ", "LEFT_RADIUS = 1 "))
    smaller = runpy.run_path(str(path))["assembly"].volume
    assert smaller - whole == pytest.approx(2 * 3.14159265 * 3 * 5)
