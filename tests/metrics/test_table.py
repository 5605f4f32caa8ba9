"""Laws of every metric in the table, and metrics of other packages."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest
import trimesh

from partwright import registry
from partwright.assembly import Assembly, Part
from partwright.errors import SettingError
from partwright.fields import Box, Sphere
from partwright.metrics import METRICS, Comparison, Metric, evaluate
from partwright.shapes import Shape, load_shape

SLIMNESS = Metric(lambda pair: 1.0 / len(pair.assembly), "higher")
EXACT = Assembly((Part(Box((2.0, 1.0, 1.2))),))
# two balls too many, one of them within the other and one sticking out
POOR = Assembly((Part(Box((1.8, 1.0, 1.0))), Part(Sphere(0.4)), Part(Sphere(0.4), (0.9, 0.1, 0.1))))


@pytest.fixture(scope="module")
def block() -> Shape:
    return load_shape(trimesh.creation.box((2.0, 1.0, 1.2)))


@pytest.mark.parametrize("name", METRICS.own)
def test_a_metric_tells_the_better_of_two_and_repeats(name: str, block: Shape) -> None:
    metric = METRICS[name]
    exact, again, poor = (metric(Comparison(assembly, block)) for assembly in (EXACT, EXACT, POOR))
    assert exact == again
    assert exact > poor if metric.better == "higher" else exact < poor


def test_a_metric_of_another_package_is_taken_by_name(monkeypatch: pytest.MonkeyPatch, block: Shape) -> None:
    point = EntryPoint("slimness", f"{__name__}:SLIMNESS", "partwright.metrics")
    monkeypatch.setattr(registry, "_installed", lambda group: (point,) if group == point.group else ())
    plain = evaluate(EXACT, block, emd=False)
    scores = evaluate(POOR, block, emd=False, metrics=("slimness", "convexes"))
    assert scores.further == {"slimness": 1 / 3, "convexes": 3}
    assert scores.to_dict()["slimness"] == 1 / 3
    assert plain.to_dict().keys() == scores.to_dict().keys() - {"slimness", "convexes"}


def test_an_unknown_metric_is_a_setting_error(block: Shape) -> None:
    with pytest.raises(SettingError, match=r"unknown metric 'iuo'.*did you mean 'iou'"):
        evaluate(EXACT, block, metrics=("iuo",))
