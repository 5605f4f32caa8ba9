"""Whole fits of small parts: exact trees, demands, interruptions, repeatability, units, broken input."""

from __future__ import annotations

import sys
from itertools import product

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.capri import Settings, tree_search
from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import CsgTree
from partwright.capri.method import Found, found
from partwright.capri.repeated_convexes import with_repeated_convexes
from partwright.capri.tree_search import TreeSearch
from partwright.errors import (
    GridError,
    MissingDependencyError,
    NeedsSurfaceError,
    PartwrightError,
    SettingError,
)
from partwright.fields import Cylinder
from partwright.meshing import mesh_csg
from partwright.methods import Cancellation, FitRequest, Progress, Run
from partwright.shapes import Shape, load_shape
from tests.capri.meshes import bracket, drilled_plate, tilted_rod

pytestmark = pytest.mark.usefixtures("detected_once")

FAST = {"surface": 6000, "near": 6000, "uniform": 5000, "tries": 2, "least": 20}


def quick(shape: Shape, run: Run | None = None, **changes) -> Found:
    return found(FitRequest(shape, Settings(**FAST | changes), run or Run()))


def solid(assembly: Assembly) -> trimesh.Trimesh:
    mesh = mesh_csg(assembly)
    assert mesh.is_watertight
    return mesh


@pytest.mark.parametrize(
    ("mesh", "primitives", "convexes", "genus"),
    [
        pytest.param(trimesh.creation.box((2, 1, 0.6)), 6, 1, 0, id="box"),
        pytest.param(trimesh.creation.icosphere(4), 1, 1, 0, id="ball"),
        pytest.param(tilted_rod(), 3, 1, 0, id="tilted rod"),
        pytest.param(drilled_plate(), 8, 3, 2, id="drilled plate"),
        pytest.param(bracket(), 13, 3, 1, id="bracket"),
    ],
)
def test_known_parts_get_their_tree(
    mesh: trimesh.Trimesh, primitives: int, convexes: int, genus: int
) -> None:
    fitted = quick(load_shape(mesh))
    assert fitted.tree.primitives <= primitives
    assert fitted.tree.convexes <= convexes
    assert len(fitted.quadrics) == fitted.details["primitives"]
    assert len(fitted.quadrics.expanded()) == fitted.tree.primitives
    assert fitted.details["solids"] == len(fitted.assembly)  # each of these convexes has a name
    assert len(fitted.assembly.expanded()) == fitted.tree.convexes
    made = solid(fitted.assembly)
    assert made.volume == pytest.approx(mesh.volume, rel=0.01)
    assert made.euler_number == 2 - 2 * genus
    assert fitted.outcome == "converged"


@pytest.fixture(scope="module")
def plate() -> Shape:
    return load_shape(drilled_plate(), unit="mm")


def test_without_difference_and_nesting_there_is_one_layer_of_convexes(plate: Shape) -> None:
    fitted = quick(plate, subtract=False, nested=False)
    assert len(fitted.tree.layers) == 1
    assert fitted.tree.convexes == len(fitted.tree.layers[0])
    assert not fitted.tree.complement[[k for c in fitted.tree.layers[0] for k in c]].any()


def test_the_paper_s_form_is_a_difference_of_unions_of_convexes(plate: Shape) -> None:
    tree = quick(plate, nested=False).tree
    assert [len(layer) for layer in tree.layers] == [1, 2]
    whole = tree.assembly()
    assert whole.operation == "difference"
    assert [child.name for child in whole.children] == ["added", "subtracted"]
    assert all(c.operation == "intersection" for union in whole.children for c in union.children)


def test_the_assembly_is_the_tree(plate: Shape) -> None:
    fitted = quick(plate)
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    distance = fitted.assembly.distance(plate.frame.from_unit(points))
    sure = np.abs(distance) > 1e-3
    np.testing.assert_array_equal((distance < 0)[sure], fitted.tree.occupancy(points)[sure])
    assert fitted.assembly.unit == plate.unit
    plain = quick(plate, named=False)
    assert plain.assembly == fitted.quadrics
    assert {part.field.kind for part in plain.assembly.parts} == {"quadric"}


def test_nothing_can_be_removed_for_free(plate: Shape) -> None:
    """Pruned: without any one primitive the tree is another solid."""
    tree = quick(plate).tree
    points = np.random.default_rng(1).uniform(-1, 1, (40_000, 3))
    whole = tree.occupancy(points)
    for k, layer in enumerate(tree.layers):
        for i, convex in enumerate(layer):
            for one in convex:
                rest = tuple(c for c in convex if c != one)
                fewer = [list(x) for x in tree.layers]
                fewer[k][i : i + 1] = [rest] if rest else []
                less = CsgTree(tree.rows, tree.complement, tuple(tuple(x) for x in fewer))
                assert (less.occupancy(points) != whole).mean() > 1e-3


def test_the_same_seed_gives_the_same_bytes(detected_anew: None, tmp_path) -> None:
    for name in ("a", "b"):
        quick(load_shape(bracket()), Run(seed=3)).assembly.save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_budget_of_primitives(plate: Shape) -> None:
    fitted = quick(plate, max_parts=7)
    assert len(fitted.quadrics) <= 7
    assert fitted.outcome == "budget_reached"
    assert solid(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.15)


def test_a_budget_that_holds_nothing_says_how_many_do() -> None:
    with pytest.raises(SettingError, match=r"max_parts: 2 quadrics enclose nothing.* has [4-7]"):
        quick(load_shape(trimesh.creation.box((1, 2, 3))), max_parts=2)


def test_a_target_takes_the_cheapest_tree_that_reaches_it(plate: Shape) -> None:
    fitted = quick(plate, min_iou=0.85)
    assert fitted.outcome == "target_reached"
    assert len(fitted.quadrics) <= 6


def test_progress_and_interruption(plate: Shape) -> None:
    seen: list[Progress] = []
    quick(plate, Run(progress=seen.append))
    fractions = [step.fraction for step in seen]
    assert fractions == sorted(fractions)
    assert 0 < fractions[0] < fractions[-1] == 1
    assert seen[-1].iou > 0.98

    cancel = Cancellation()
    fitted = quick(plate, Run(progress=lambda _: cancel.request(), cancel=cancel))
    assert fitted.outcome == "interrupted"
    assert solid(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.1)


def test_an_interruption_is_heard_while_copies_are_sought(plate: Shape, monkeypatch) -> None:
    """After the last step of the search, as it is told, and within."""
    cancel = Cancellation()

    def stop_then(step: Progress) -> None:
        if step.stage == "repeat":
            cancel.request()

    told = quick(plate, Run(progress=stop_then, cancel=cancel))
    cancel = Cancellation()

    def sought(*given):
        cancel.request()
        with_repeated_convexes(*given)
        pytest.fail("it was not heard")

    monkeypatch.setattr(tree_search, "with_repeated_convexes", sought)
    within = quick(plate, Run(cancel=cancel))
    for fitted in (told, within):
        assert fitted.outcome == "interrupted"
        assert not fitted.tree.copies
        assert solid(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.01)


def two_steps() -> trimesh.Trimesh:
    """A plate with a block on either end."""
    blocks = [trimesh.creation.box(bounds=[(x, -0.3, 0.1), (x + 0.3, 0.3, 0.6)]) for x in (-0.9, 0.6)]
    plate = trimesh.creation.box(bounds=[(-1, -0.5, -0.2), (1, 0.5, 0.2)])
    return trimesh.boolean.union([plate, *blocks])


def with_a_speck(tree: CsgTree, *_) -> CsgTree:
    """More primitives: a small box within what is there."""
    speck = [rows.plane(s * e, 0.01) for s in (1.0, -1.0) for e in np.eye(3)]
    count = len(tree.rows)
    layers = ((*tree.layers[0], tuple(range(count, count + 6))), *tree.layers[1:])
    return CsgTree(np.concatenate([tree.rows, speck]), np.r_[tree.complement, np.zeros(6, bool)], layers)


def with_one_alone(tree: CsgTree, *_) -> CsgTree:
    """Less like the shape: nothing but its first convex."""
    return CsgTree(tree.rows, tree.complement, (tree.layers[0][:1], *((),) * (len(tree.layers) - 1)))


@pytest.mark.parametrize(
    ("demand", "spoilt"),
    [({"max_parts": 18}, with_a_speck), ({"min_iou": 0.95}, with_one_alone)],
    ids=["budget", "target"],
)
def test_copies_that_leave_a_demand_unmet_are_not_taken(monkeypatch, demand, spoilt) -> None:
    shape = load_shape(two_steps())
    monkeypatch.setattr(tree_search, "with_repeated_convexes", lambda tree, *_: tree)
    met = quick(shape, **demand)
    monkeypatch.setattr(tree_search, "with_repeated_convexes", spoilt)
    fitted = quick(shape, **demand)
    assert fitted.tree.convexes == met.tree.convexes == 3
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    np.testing.assert_array_equal(fitted.tree.occupancy(points), met.tree.occupancy(points))


def test_what_a_fit_to_all_places_leaves_open_is_closed(monkeypatch) -> None:
    def without_an_end(tree: CsgTree, *_) -> CsgTree:
        layers = tuple(tuple(convex[:-1] for convex in layer) for layer in tree.layers)
        return CsgTree(tree.rows, tree.complement, layers)

    monkeypatch.setattr(tree_search, "with_repeated_convexes", without_an_end)
    assert np.abs(quick(load_shape(two_steps())).tree.assembly().bounds()).max() < 1


def test_where_further_copies_break_a_budget_the_others_stay(monkeypatch) -> None:
    asked = []

    def sought(tree: CsgTree, samples, price, convex_price, pause, further, own) -> CsgTree:
        asked.append(further)
        if further:
            return with_a_speck(tree)
        return with_repeated_convexes(tree, samples, price, convex_price, pause, further, own)

    monkeypatch.setattr(tree_search, "with_repeated_convexes", sought)
    fitted = quick(load_shape(two_steps()), max_parts=18)
    assert asked == [True, False]
    assert [copy is None for copy in fitted.tree.copies[0]].count(False) == 1


def perforated_plate() -> trimesh.Trimesh:
    """With 30 small holes."""
    plate = trimesh.creation.box((1.8, 1.4, 0.12))
    cuts = []
    for x, y in product(np.linspace(-0.75, 0.75, 6), np.linspace(-0.5, 0.5, 5)):
        cuts.append(trimesh.creation.cylinder(0.036, 0.5, sections=48))
        cuts[-1].apply_translation((x, y, 0))
    return trimesh.boolean.difference([plate, *cuts])


def test_holes_that_are_too_small_to_pay_one_by_one_are_drilled_at_once() -> None:
    mesh = perforated_plate()
    fitted = quick(load_shape(mesh), surface=12_000, near=12_000, uniform=6000)
    assert fitted.details["convexes"] == 2
    assert fitted.details["primitives"] == 7
    made = solid(fitted.assembly)
    assert made.euler_number == 2 - 2 * 30
    assert made.volume == pytest.approx(mesh.volume, rel=0.002)


def test_holes_that_are_too_small_to_pay_one_by_one_are_not_drilled_so(monkeypatch) -> None:
    """Without being offered all at once, which is what drills them, and without mending, which drills singly
    those whose walls are far from the faces."""
    monkeypatch.setattr(tree_search, "_MAX_OFFERED", 0)
    monkeypatch.setattr(tree_search, "_MENDINGS", 0)
    alone = quick(load_shape(perforated_plate()), surface=12_000, near=12_000, uniform=6000)
    assert solid(alone.assembly).euler_number > 2 - 2 * 30


def test_more_convexes_are_not_taken_where_they_cost_more_than_they_save(monkeypatch) -> None:
    """With a speck that is offered the copies of all else may be lost."""

    def sought(tree: CsgTree, *rest) -> CsgTree:
        return with_a_speck(tree) if tree is offered else tree

    monkeypatch.setattr(tree_search, "with_repeated_convexes", sought)
    monkeypatch.setattr(tree_search.TreeSearch, "with_offered", lambda search: offer(search))
    offered = None

    def offer(search: tree_search.TreeSearch) -> CsgTree:
        nonlocal offered
        offered = search.tree().closed(*search.box)
        return offered

    shape = load_shape(two_steps())
    plain = quick(shape, symmetry=False).tree
    assert quick(shape).tree.convexes == plain.convexes


def test_copies_are_sought_at_the_price_at_which_a_demand_was_met(monkeypatch) -> None:
    prices = []

    def sought(tree: CsgTree, samples, price, convex_price, *rest) -> CsgTree:
        prices.append((price, convex_price))
        return tree

    monkeypatch.setattr(tree_search, "with_repeated_convexes", sought)
    shape, own = load_shape(two_steps()), Settings(**FAST)
    quick(shape, max_parts=8)
    quick(shape)
    dearer, plain = dict.fromkeys(prices)  # asked once more where more convexes break the budget
    assert plain == (own.price, own.convex_price)
    assert dearer[0] / plain[0] == pytest.approx(dearer[1] / plain[1])
    assert dearer[0] > plain[0]


@pytest.mark.parametrize("scale", [1e-5, 1e5])
def test_units_and_place_do_not_matter(scale: float) -> None:
    mesh = drilled_plate()
    mesh.vertices = mesh.vertices * scale + np.array([3.0, -2.0, 5.0]) * scale
    made = solid(quick(load_shape(mesh)).assembly)
    assert made.volume == pytest.approx(mesh.volume, rel=0.01)


@pytest.mark.parametrize("kind", ["points", "grid"])
def test_points_and_grids_come_in_as_well(kind: str) -> None:
    mesh = drilled_plate()
    points, face = trimesh.sample.sample_surface(mesh, 10_000, seed=0)
    cloud = np.concatenate([points, mesh.face_normals[face]], axis=1)
    shape = load_shape(cloud if kind == "points" else mesh.voxelized(2 / 48).fill().matrix)
    fitted = quick(shape, price=1e-3, surface=3000, near=4000, uniform=3000)
    made = solid(fitted.assembly)
    assert made.volume == pytest.approx(shape.volume, rel=0.05)
    assert len(fitted.quadrics) <= 14


def test_a_closed_cavity_stays() -> None:
    """A box around a ball of nothing."""
    inner = trimesh.creation.icosphere(3, radius=0.4)
    inner.invert()
    mesh = trimesh.util.concatenate([trimesh.creation.box((2, 1.4, 1.2)), inner])
    shape = load_shape(mesh)
    if shape.volume < 3.3:  # the shape itself kept it
        assert solid(quick(shape).assembly).volume == pytest.approx(mesh.volume, rel=0.02)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (np.ones((16, 16, 16), bool), GridError),
        (np.zeros((16, 16, 16), bool), GridError),
        (np.random.default_rng(0).uniform(size=(50, 3)), NeedsSurfaceError),
        ((np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])), PartwrightError),
    ],
    ids=["full grid", "empty grid", "few points", "one triangle"],
)
def test_broken_input_is_named(given, error: type[PartwrightError]) -> None:
    with pytest.raises(error):
        quick(load_shape(given))


def test_settings_that_cannot_be_used_are_named(plate: Shape) -> None:
    for changes, message in [
        ({"max_parts": 0}, "max_parts"),
        ({"price": 0.0}, "price"),
        ({"schedule": "fast"}, 'schedule: expected "search" or "paper"'),
        ({"kinds": ("sphere",)}, "kinds: expected plane"),
        ({"curve": True}, "unknown settings: curve"),
        ({"weights": "/nowhere"}, "weights: there is no file"),
        ({"colour": 1}, "unknown settings: colour"),
    ]:
        with pytest.raises(SettingError, match=message):
            Settings.for_quality("draft", **changes)
    with pytest.raises(SettingError, match="the search of trees runs on the CPU"):
        quick(plate, Run(device="cuda"))


def test_surfaces_of_a_given_assembly_join(plate: Shape) -> None:
    """A cylinder that the shape does not show is among the quadrics, in the shape's frame."""
    rod = Part(Cylinder(0.37, 1.0), (0.3, 0.2, 0.1))
    run = TreeSearch(Settings(**FAST))
    run.prepare(plate, None)
    before = run.pool.rows
    run.prepare(plate, Assembly((rod,)))
    new = [row for row in run.pool.rows if np.abs(before - row).max(axis=1).min() > 0.02]
    expected = rows.cylinder(0.9 * np.array([0.3, 0.2, 0.1]), (0, 0, 1), 0.9 * 0.37)
    assert min(np.abs(row - expected).max() for row in new) < 0.02


def test_without_torch_the_network_is_asked_for_by_name(plate: Shape, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    for name in ("partwright.capri.paper", "partwright.capri.network"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    with pytest.raises(MissingDependencyError, match="needs PyTorch"):
        quick(plate, schedule="paper")
