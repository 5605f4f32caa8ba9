"""Bounds as options of a fit."""

from __future__ import annotations

import pytest

import partwright as pw
from partwright.fields import Extrusion, Profile
from partwright.meshing import mesh_part
from tests.tolerances.shapes import boss


@pytest.fixture(scope="module")
def shape() -> pw.Shape:
    return pw.load_shape(boss()[0], unit="mm")


def test_a_fit_contains_its_shape_with_few_parts(shape: pw.Shape) -> None:
    result = pw.fit(shape, quality="draft", tolerance=pw.Tolerance(contain=True), max_parts=2, threads=1)
    bound = result.report["bounds"]
    assert bound["contain"]["kept"]
    assert len(result.assembly) <= 2
    assert result.assembly.distance(shape.vertices).max() <= 1e-4
    assert 1.0 <= bound["volume_ratio"] < 1.1


@pytest.mark.heavy
def test_a_tolerance_takes_the_fewest_parts(shape: pw.Shape) -> None:
    result = pw.fit(shape, quality="draft", tolerance="0.06mm", threads=1)
    assert result.outcome == "target_reached"
    assert result.scores.max_deviation <= 0.063
    assert len(result.assembly) == 2


@pytest.mark.parametrize("asked", [{"within": "0.5%"}, {"contain": True}], ids=["tolerance", "contain"])
def test_features_keep_bounds_as_features(asked: dict) -> None:
    """An angle with a rounded edge is one extrusion, which grows as far as is needed."""
    outline = Profile.polygon([(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)])
    angle = pw.load_shape(mesh_part(pw.Part(Extrusion(outline, 1.5, top_fillet=0.2)), 64), unit="mm")
    result = pw.fit(angle, "solids", quality="draft", tolerance=pw.Tolerance(**asked), threads=1)
    (part,) = result.assembly.parts
    assert isinstance(part.field, Extrusion)
    assert len(part.field.profile.outline) == 6
    assert part.field.top_fillet == pytest.approx(0.2, abs=0.02)
    (bound,) = (value for name, value in result.report["bounds"].items() if name != "volume_ratio")
    assert bound["kept"]
    assert result.report["bounds"]["volume_ratio"] == pytest.approx(1, abs=0.02)


def test_what_is_out_of_reach_is_said(shape: pw.Shape) -> None:
    result = pw.fit(shape, quality="draft", tolerance="1%", max_parts=1, threads=1)
    assert result.outcome == "budget_reached"
    assert not result.report["bounds"]["tolerance"]["kept"]
    assert any("tolerance 0.02 mm is not kept" in warning for warning in result.warnings)
