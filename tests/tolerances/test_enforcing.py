"""Bounds as options of a fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

import partwright as pw
from partwright.fields import Extrusion, Profile
from partwright.meshing import mesh_part
from partwright.tolerances import enforcing
from partwright.tolerances.distance_bounds import DistanceBounds
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


@dataclass(frozen=True)
class Parts:
    """So many parts, of which three keep the bounds."""

    count: int
    complete: bool = True

    @property
    def satisfied(self) -> bool:
        return self.count >= 3

    def improves_on(self, other: Parts) -> bool:
        return self.count > other.count


@pytest.mark.parametrize(
    ("start", "made", "tolerance", "asked", "pruned", "end"),
    [
        (1, {1 / 3: 2, 1 / 10: 5}, 0.1, [1 / 3, 1 / 10], [5], (3, "target_reached")),
        (1, {1 / 3: 4}, 0.1, [1 / 3], [4], (3, "target_reached")),
        (4, {}, 0.1, [], [4], (3, "target_reached")),
        (2, {1 / 3: 1, 1 / 10: 1}, 0.1, [1 / 3, 1 / 10], [], (2, "budget_reached")),
        (1, {}, 0.1, [1 / 3], [], (1, "budget_reached")),
        (4, {}, None, [], [], (4, "converged")),
    ],
    ids=["twice", "once", "at once", "no better", "no more", "no tolerance"],
)
def test_more_parts_are_made_until_a_tolerance_is_kept_and_then_the_fewest_stay(
    start: int, made: dict[float, int], tolerance: float | None, asked: list[float], pruned: list[int],
    end: tuple[int, str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    shares: list[float] = []
    minimised: list[int] = []

    def refit(share: float) -> Any:
        shares.append(share)
        return made.get(share)

    def fewest(best: Parts, *_: Any) -> Parts:
        minimised.append(best.count)
        return Parts(3)

    monkeypatch.setattr(enforcing, "satisfy", lambda count, *_: Parts(count))
    monkeypatch.setattr(enforcing, "minimise_parts", fewest)
    bounds = DistanceBounds(tolerance=tolerance, contain=None if tolerance else 0.0)
    given: Any = start
    shape: Any = None
    found: Any = enforcing.enforce(given, shape, bounds, "converged", refit)
    assert (found[0].count, found[1]) == end
    assert (shares, minimised) == (asked, pruned)


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
