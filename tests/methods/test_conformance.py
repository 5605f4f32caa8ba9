"""What every method must keep: the contract of `partwright.methods`, one suite over all of them.

An outside package's method can be held to the same laws: add it to CASES.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.errors import CancelledError, SettingError
from partwright.fields import Box
from partwright.fitting import FILES
from partwright.methods import METHODS, Ability, FitRequest, Fitted, Progress, Run
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.shapes import Shape, load_shape
from tests.superfrusta.meshes import table

# What asks for an ability, where a method lacks it. Locking needs a start, which comes first.
ASKS: dict[Ability, dict[str, Any]] = {
    Ability.BUDGET: {"max_parts": 2},
    Ability.TARGET: {"min_iou": 0.5},
    Ability.CURVE: {"curve": True},
    Ability.START: {"start": Assembly((Part(Box((1, 1, 1)), name="box"),))},
    Ability.LOCK: {"start": pw.Start(Assembly((Part(Box((1, 1, 1)), name="box"),)), ["box"])},
    Ability.SYMMETRY: {"symmetry": True},
    Ability.SUBTRACT: {"subtract": True},
    Ability.CLEAN: {"clean": True},
    Ability.BOUNDS: {"tolerance": "5%"},
    Ability.CUDA: {"device": "cuda"},
}


@dataclass(frozen=True)
class Case:
    """A method with settings that are quick and a shape that it can make something of."""

    settings: Any
    shape: Shape

    def fit(self, run: Run | None = None, **changes: Any) -> Fitted:
        request = {name: changes.pop(name) for name in ("start", "locked") if name in changes}
        settings = replace(self.settings, **changes)
        return FitRequest(self.shape, settings, run or Run(), **request).fitted()

    @property
    def method(self) -> Any:
        return METHODS[self.settings.method]


def settings_of(name: str) -> Any:
    few = {"near": 6000, "uniform": 6000}
    if name == "parts":
        return METHODS[name].settings(
            "draft", model="mixers", iterations=16, points=256, starts=2, resolution=32
        )
    if name == "capri":
        return METHODS[name].settings("draft", surface=6000, tries=2, **few)
    return METHODS[name].settings("draft", resolution=48, **few)


@pytest.fixture(scope="module")
def shape() -> Shape:
    return load_shape(table(), unit="mm", up="z")


@pytest.fixture(scope="module", params=METHODS.own)
def case(request: pytest.FixtureRequest, shape: Shape) -> Case:
    return Case(settings_of(request.param), mixer() if request.param == "parts" else shape)


def mixer() -> Shape:
    """One that the model of mixers was trained on: a few steps are enough for it."""
    model = load_model("mixers")
    mesh = mesh_shape(NeuralShape.trained(model, "0"), 48, parts=False).whole
    return load_shape(mesh, unit="mm", up="z")


@pytest.fixture(scope="module")
def told(case: Case) -> tuple[Fitted, list[Progress]]:
    steps: list[Progress] = []
    return case.fit(Run(progress=steps.append)), steps


def saved(assembly: Assembly, path: Path) -> bytes:
    assembly.save(path)
    return path.read_bytes()


def test_it_is_told_by_its_own_name_and_settings(case: Case) -> None:
    assert case.method.name == case.settings.method
    for ability in (Ability.BUDGET, Ability.TARGET, Ability.CURVE, Ability.SYMMETRY, Ability.SUBTRACT):
        assert (ability in case.method.can) == (ability.value in {f.name for f in fields(case.settings)})


def test_the_assembly_lies_on_the_shape(case: Case, told: tuple[Fitted, list[Progress]]) -> None:
    assembly = told[0].assembly
    lower, upper = assembly.bounds()
    size = np.ptp(case.shape.vertices, axis=0).max()
    # Quick settings make poor fits; a frame or a unit that is wrong is further off than these.
    np.testing.assert_allclose(lower, case.shape.vertices.min(axis=0), atol=0.25 * size)
    np.testing.assert_allclose(upper, case.shape.vertices.max(axis=0), atol=0.25 * size)
    assert assembly.unit == "mm"
    assert told[0].outcome in ("converged", "budget_reached", "target_reached")
    assert all(spent >= 0 for spent in told[0].seconds.values())
    json.dumps(told[0].details)  # what the report is to hold is JSON


def test_the_same_seed_gives_the_same_bytes_at_any_number_of_threads(
    case: Case, told: tuple[Fitted, list[Progress]], tmp_path: Path
) -> None:
    again = case.fit(Run(threads=1))
    assert saved(again.assembly, tmp_path / "a.json") == saved(told[0].assembly, tmp_path / "b.json")


def test_progress_goes_forward_and_makes_the_best_so_far(
    case: Case, told: tuple[Fitted, list[Progress]]
) -> None:
    steps = told[1]
    assert steps
    fractions = [step.fraction for step in steps]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] < fractions[-1] <= 1
    last = steps[-1].assembly()
    assert last is not None
    assert len(last) >= 1
    inside = np.asarray(case.shape.vertices).mean(axis=0, keepdims=True)
    assert np.isfinite(last.distance(inside)).all()


def test_cancelled_at_any_report_it_gives_a_whole_result(
    case: Case, told: tuple[Fitted, list[Progress]]
) -> None:
    count = len(told[1])
    for stop in sorted({0, count // 2, count - 1}):
        cancel = pw.Cancellation()
        seen: list[Progress] = []

        def report(step: Progress, stop: int = stop, cancel: Any = cancel, seen: Any = seen) -> None:
            seen.append(step)
            if len(seen) == stop + 1:
                cancel.request()

        fitted = case.fit(Run(progress=report, cancel=cancel))
        assert fitted.outcome == "interrupted"
        assert len(fitted.assembly) >= 1
        assert np.isfinite(fitted.assembly.distance(np.zeros((1, 3)))).all()
        assert len(seen) <= stop + 1 + 1  # it ends at once; one more may tell of the end


def test_cancelled_before_it_began_it_has_nothing(case: Case) -> None:
    cancel = pw.Cancellation()
    cancel.request()
    with pytest.raises(CancelledError):
        case.fit(Run(cancel=cancel))


def counted(fitted: Fitted) -> int:
    """Parts; of a tree of quadrics these, of which a part holds one or more."""
    tree = fitted.details.get("tree")
    return tree["primitives"] if isinstance(tree, dict) else len(fitted.assembly)


def test_a_budget_is_kept(case: Case, told: tuple[Fitted, list[Progress]]) -> None:
    if Ability.BUDGET not in case.method.can:
        return
    most = max(1, counted(told[0]) - 2)
    fitted = case.fit(max_parts=most)
    assert len(fitted.assembly) <= counted(fitted) <= most


def test_a_locked_part_of_other_units_is_refused_before_the_work() -> None:
    shape = pw.load_shape(trimesh.creation.box())
    for far in (
        pw.Part(pw.fields.Box((1e12, 1e12, 1e12)), name="far"),
        pw.Part(pw.fields.Box((1.0, 1.0, 1.0)), (0, 1e6, 0), name="far"),
    ):
        with pytest.raises(SettingError, match=r"locked part far reaches .* the same units"):
            pw.fit(shape, start=pw.Start(pw.Assembly((far,)), locked=["far"]))


def test_locked_parts_stay_bit_for_bit(case: Case, told: tuple[Fitted, list[Progress]]) -> None:
    if Ability.LOCK not in case.method.can:
        return
    start = told[0].assembly.expanded()
    kept = start.parts[0]
    fitted = case.fit(start=start, locked=(kept.name,))
    found = fitted.assembly[kept.name]
    assert (found.translation, found.rotation, found.field) == (kept.translation, kept.rotation, kept.field)


@pytest.mark.parametrize("ability", ASKS, ids=lambda ability: ability.name)
def test_what_it_cannot_do_is_one_clear_error_before_any_work(case: Case, ability: Ability) -> None:
    if ability in case.method.can:
        return
    with pytest.raises(SettingError, match=rf"^{case.method.name} .*\(({ability.value}|start)\)"):
        pw.fit(case.shape, case.settings, progress=pytest.fail, **ASKS[ability])


def test_its_settings_stand_for_its_name(case: Case) -> None:
    with pytest.raises(SettingError, match="quality stands for settings of its own"):
        pw.fit(case.shape, case.settings, quality="draft")
    with pytest.raises(SettingError, match="unknown settings: colour"):
        pw.fit(case.shape, case.settings, colour=1)


@pytest.mark.usefixtures("coarse_scores")
def test_a_result_is_one_type_and_one_folder(
    case: Case, tmp_path: Path, told: tuple[Fitted, list[Progress]]
) -> None:
    result = pw.fit(case.shape, case.settings)
    assert isinstance(result, pw.Result)
    assert result.report["method"] == case.method.name
    assert result.report["parts"] == len(result.assembly) == len(told[0].assembly)
    assert result.assembly.metadata["source"] == case.shape.name
    result.save(tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(FILES)
    assert json.loads((tmp_path / "out" / "report.json").read_text())["settings"].keys() >= {"quality"}


def test_after_a_cancellation_no_further_node_is_fitted(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for name, x in (("left", -2.0), ("right", 2.0)):
        box = trimesh.creation.box((1, 1, 1)).apply_translation((x, 0, 0))
        scene.add_geometry(box, node_name=name, geom_name=name)
    scene.export(tmp_path / "pair.glb")
    shape, settings, cancel = load_shape(tmp_path / "pair.glb"), settings_of("superfrusta"), pw.Cancellation()
    whole = pw.fit_nodes(shape, settings)
    names = [node.name for node in shape.nodes]
    assert sorted(names) == ["left", "right"]
    assert [child.name for child in whole.assembly.children] == names
    first = pw.fit_nodes(shape, settings, progress=lambda _: cancel.request(), cancel=cancel)
    assert first.outcome == "interrupted"
    assert [child.name for child in first.assembly.children] == names[:1]
