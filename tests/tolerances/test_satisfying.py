"""Bounds are kept at points that nothing was fitted to, and the results stay tight."""

from __future__ import annotations

import numpy as np
import pytest

import partwright as pw
from partwright.fields import SuperFrustum
from partwright.meshing import mesh_assembly
from partwright.methods import Cancellation
from partwright.metrics.deviation import projected
from partwright.tolerances import Bounded, Checked, DistanceBounds, minimise_parts, satisfy
from partwright.tolerances.check import Side
from partwright.tolerances.satisfying import measured
from tests.tolerances.shapes import ALL, boss, tube


def on_shape(shape: pw.Shape) -> np.ndarray:
    """Fresh points of the surface in the shape's own units, corners among them."""
    return np.concatenate([shape.frame.from_unit(shape.unit_surface(50_000, 987).points), shape.vertices])


def on_assembly(assembly: pw.Assembly) -> np.ndarray:
    mesh = mesh_assembly(assembly, 160)
    points = mesh.sample(50_000, seed=987)
    return projected(assembly.distance, points)[0]


@pytest.mark.parametrize("name", ALL)
def test_the_assembly_contains_the_shape_and_stays_tight(name: str) -> None:
    mesh, rough = ALL[name]()
    shape = pw.load_shape(mesh)
    assert rough.distance(on_shape(shape)).max() > 5e-3  # it does not, to begin with
    kept = satisfy(rough, shape, DistanceBounds.of(shape, contain=True))
    assert kept.satisfied
    assert kept.assembly.distance(on_shape(shape)).max() <= 5e-4
    assert mesh_assembly(kept.assembly).volume < 1.05 * shape.volume


@pytest.mark.parametrize("name", ["plate_with_hole"])
def test_the_assembly_stays_inside_the_shape_and_fills_it(name: str) -> None:
    mesh, rough = ALL[name]()
    shape = pw.load_shape(mesh)
    kept = satisfy(rough, shape, DistanceBounds.of(shape, inside=True))
    assert kept.satisfied
    assert shape.signed_distance(on_assembly(kept.assembly)).max() <= 5e-4
    assert mesh_assembly(kept.assembly).volume > 0.95 * shape.volume


def test_a_slack_is_used_up_to_its_length_and_no_further() -> None:
    mesh, rough = boss()
    shape = pw.load_shape(mesh, unit="m")
    kept = satisfy(rough, shape, DistanceBounds.of(shape, contain="5mm"))
    assert kept.satisfied
    assert kept.assembly.distance(on_shape(shape)).max() <= 5.5e-3


@pytest.mark.parametrize("name", ["boss", "legs"])
def test_a_tolerance_holds_both_ways(name: str) -> None:
    mesh, rough = ALL[name]()
    shape = pw.load_shape(mesh)
    assert pw.evaluate(rough, shape, emd=False).max_deviation > 0.01
    kept = satisfy(rough, shape, DistanceBounds.of(shape, tolerance=0.01))
    assert kept.satisfied
    assert pw.evaluate(kept.assembly, shape, seed=5, emd=False).max_deviation <= 0.0105


def test_a_tolerance_out_of_reach_does_not_cost_the_rest_of_the_shape() -> None:
    """A box has no hole, and getting thinner brings its faces no nearer to one."""
    mesh, _ = ALL["plate_with_hole"]()
    shape = pw.load_shape(mesh)
    plain = pw.Assembly([pw.Part(SuperFrustum((2, 1.2, 0.3)))])
    asked = DistanceBounds.of(shape, tolerance="1%")
    missed, before = satisfy(plain, shape, asked), measured(plain, shape, asked)
    assert not missed.satisfied
    assert missed.checked.total_excess <= before.checked.total_excess
    assert pw.evaluate(missed.assembly, shape, emd=False).iou > 0.88  # as of the plain box


def test_the_better_of_two_that_miss_a_bound_is_no_worse_elsewhere() -> None:
    bounds = DistanceBounds(tolerance=0.01)

    def found(worst: float, iou: float) -> Bounded:
        return Bounded(boss()[1], Checked(bounds, {"tolerance": Side(worst, np.zeros(3))}), iou)

    assert found(0.02, 0.9).improves_on(found(0.03, 0.9))
    assert not found(0.02, 0.8).improves_on(found(0.03, 0.9))
    assert not found(0.03, 0.9).improves_on(found(0.02, 0.8))
    assert found(0.009, 0.8).improves_on(found(0.02, 0.9))
    assert not found(0.02, 0.9).improves_on(found(0.009, 0.8))


def test_what_keeps_its_bounds_comes_back_untouched() -> None:
    mesh, _ = tube()
    loose = pw.Assembly([pw.Part(pw.fields.Tube(1.01, 0.32, 2.02))])
    assert satisfy(loose, pw.load_shape(mesh), DistanceBounds(contain=0.0)).assembly is loose


def test_locked_parts_stay_and_the_bound_is_reported_as_missed() -> None:
    mesh, rough = boss()
    shape = pw.load_shape(mesh)
    names = [part.name for part in rough.parts]
    missed = satisfy(rough, shape, DistanceBounds(contain=0.0), locked=names)
    assert not missed.satisfied
    assert missed.checked.excess["contain"] > 1e-3
    assert missed.assembly == rough


def test_parts_that_a_tolerance_does_not_need_go() -> None:
    mesh, rough = boss()
    shape, bounds = pw.load_shape(mesh), DistanceBounds(tolerance=0.02)
    chip = pw.Part(pw.fields.Box((0.3, 0.3, 0.3)), (-0.7, 0.2, 0), name="chip")
    kept = satisfy(pw.Assembly([*rough.parts, chip]), shape, bounds)
    assert kept.satisfied
    thinned = minimise_parts(kept, shape, bounds, locked=[part.name for part in rough.parts])
    assert thinned.satisfied
    assert len(thinned.assembly) == 2
    assert "chip" not in [part.name for part in thinned.assembly.parts]


def test_cancelled_it_keeps_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, rough = boss()
    shape, cancel = pw.load_shape(mesh), Cancellation()
    cancel.request()
    monkeypatch.setattr("partwright.tolerances.satisfying.augmented_lagrangian", pytest.fail)
    stopped = satisfy(rough, shape, DistanceBounds(contain=0.0), cancel=cancel)
    assert not stopped.complete
    assert stopped.satisfied  # the start, offset


def test_a_cancelled_removal_keeps_the_parts() -> None:
    mesh, _ = tube()
    shape, cancel = pw.load_shape(mesh), Cancellation()
    loose = pw.Assembly([pw.Part(pw.fields.Tube(1.01, 0.32, 2.02), name=name) for name in ("one", "two")])
    kept = measured(loose, shape, DistanceBounds(tolerance=0.05))
    cancel.request()
    stopped = minimise_parts(kept, shape, DistanceBounds(tolerance=0.001), cancel=cancel)
    assert not stopped.complete
    assert stopped.assembly is loose
