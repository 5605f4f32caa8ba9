"""The paper's schedule: what supervises it, seeds that keep their tree, fine-tuning that helps, fits."""

from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

from partwright.capri import Settings, stages
from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import CsgTree
from partwright.capri.finetuning import Finetuning, seeded, straightened
from partwright.capri.finetuning_samples import draw_finetuning_samples
from partwright.capri.method import Found, found
from partwright.capri.network import (
    UNIT_TO_PAPER,
    CapriNet,
    NetworkSizes,
    distances,
    load_network,
    rows_of,
    save_network,
)
from partwright.capri.paper import SHIPPED
from partwright.capri.pretraining_dataset import make_pretraining_dataset
from partwright.capri.settings import CHOICES
from partwright.errors import EmptyShapeError, SettingError
from partwright.meshing import mesh_csg
from partwright.methods import Cancellation, FitRequest, Progress, Run
from partwright.shapes import Shape, load_shape
from tests.capri.meshes import drilled_plate

pytestmark = pytest.mark.usefixtures("detected_once")

PAPER = {"schedule": "paper", "iterations": 3, "surface": 6000, "near": 6000, "uniform": 5000, "tries": 0}


def fit(shape: Shape, settings: Settings, run: Run | None = None) -> Found:
    return found(FitRequest(shape, settings, run or Run()))


TINY = NetworkSizes(primitives=32, convexes=8, code=8, hidden=16, channels=1)


@pytest.fixture(scope="module")
def plate() -> Shape:
    return load_shape(drilled_plate())


@pytest.fixture(scope="module")
def weights(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("weights") / "n.safetensors"
    torch.manual_seed(0)
    save_network(CapriNet(TINY), path)
    return str(path)


@pytest.mark.parametrize("kind", CHOICES["supervision"])
def test_supervision_is_near_the_surface_and_right(plate: Shape, kind: str) -> None:
    given = draw_finetuning_samples(kind, plate, 0)
    assert given.points.shape == (65_536 if kind == "points" else 32_768, 3)
    distance = plate.unit_distance(given.points / UNIT_TO_PAPER)
    sure = np.abs(distance) > {"voxels": 1e-5, "points": 0.15, "samples": 1e-5}[kind]
    agreed = ((distance < 0) == (given.inside > 0))[np.abs(distance) < 0.04]
    assert agreed.mean() > 0.97  # along a normal of 1/64, the far side of something thin may come near
    if kind != "points":
        assert ((distance < 0) == (given.inside > 0))[sure].all()
    assert np.mean(np.abs(distance) < 5 / 64) > 0.5


def known() -> CsgTree:
    """A slab minus a cylinder and a ball, of expressible rows, in no order."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    table = [rows.plane(axis, offset) for axis, offset in zip(axes, (0.9, 0.6, 0.2) * 2, strict=True)]
    table += [rows.sphere((0.4, 0.1, 0.2), 0.2), rows.cylinder((-0.3, 0, 0), (0, 0, 1), 0.25)]
    table = [rows.plane(axes[0], 0.1), *table]
    return CsgTree(np.stack(table), np.zeros(9, bool), (((1, 2, 3, 4, 5, 6),), ((8,), (7,))))


def test_a_seeded_network_is_the_tree() -> None:
    tree = known()
    network, code = seeded(tree, 0)
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    made = tuned(network, code).tree()
    assert [len(layer) for layer in made.layers] == [16, 16]
    np.testing.assert_array_equal(made.occupancy(points), tree.occupancy(points))


def tuned(network: CapriNet, code: torch.Tensor, tree: CsgTree | None = None) -> Finetuning:
    from partwright.capri.finetuning_samples import FinetuningSamples

    points = np.random.default_rng(1).uniform(-1, 1, (20_000, 3))
    inside = (tree or known()).occupancy(points).astype(np.float32)
    return Finetuning(
        network, code, FinetuningSamples((UNIT_TO_PAPER * points).astype(np.float32), inside), 0
    )


@pytest.mark.parametrize("stage", stages.STAGES)
def test_fine_tuning_mends_a_tree(stage: stages.Stage) -> None:
    """Seeds that are a little off: every stage lowers its own loss."""
    off = known()
    off.rows[:, 6] += np.random.default_rng(0).uniform(-0.02, 0.02, len(off.rows))
    network, code = seeded(off, 0)
    tuning = tuned(network, code)
    before = tuning.loss(stage, tuning.points[None], tuning.inside[None]).item()
    fixed = network.selection.detach().clone()
    seen: list[float] = []
    tuning.run(stage, 8, seen.append)
    after = tuning.loss(stage, tuning.points[None], tuning.inside[None]).item()
    assert after < 0.97 * before
    assert seen == [1.0]
    assert torch.equal(network.selection, fixed) == (stage == "binary_selection")


def test_straight_rows_keep_their_surface() -> None:
    """Nearly flat quadrics become planes; nothing moves by more than the tolerance."""
    given = np.stack([1e-3 * rows.sphere((0, 0, 50.0), 49.9), 30 * rows.sphere((0, 0, 0), 0.5)])
    made = straightened(given)
    assert rows.is_plane(made).tolist() == [False, False]
    flat = straightened(np.array([[1e-4, 0, 2e-4, 0, 0.6, 0.8, 0.1, 0, 0, 0]]))
    assert rows.is_plane(flat).all()
    points = np.random.default_rng(0).uniform(-1, 1, (1000, 3))
    np.testing.assert_array_equal(rows.values(made, points) > 0, rows.values(given, points) > 0)
    steep = straightened(30 * np.stack([rows.plane((0, 0.6, 0.8), 0.3), rows.sphere((0.1, 0, 0), 0.5)]))
    np.testing.assert_allclose(steep[0], rows.plane((0, 0.6, 0.8), 0.3), atol=1e-12)
    np.testing.assert_allclose(steep[1], rows.sphere((0.1, 0, 0), 0.5), atol=0.05)
    network = CapriNet(TINY)
    assert straightened(rows_of(network.coefficients(torch.rand(1, 8))[0])).shape == (32, 10)


def test_seeds_go_through_the_paper_s_schedule(plate: Shape) -> None:
    seen: list[Progress] = []
    fitted = fit(plate, Settings(**PAPER), Run(progress=seen.append))
    made = mesh_csg(fitted.assembly)
    assert made.is_watertight
    assert made.volume == pytest.approx(drilled_plate().volume, rel=0.02)
    assert made.euler_number == -2
    assert fitted.details["start"] == "detected surfaces"
    assert fitted.tree.primitives <= 12
    fractions = [step.fraction for step in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)
    assert {"weighted union", "exact union", "binary selection"} < {step.stage for step in seen}


@pytest.mark.parametrize("schedule", CHOICES["schedule"])
def test_the_cheaper_start_wins_and_is_named(plate: Shape, weights: str, schedule: str) -> None:
    fitted = fit(plate, Settings(**PAPER | {"schedule": schedule, "start": "auto", "weights": weights}))
    costs = fitted.details["costs"]
    assert fitted.details["start"] == min(costs, key=costs.__getitem__) == "detected surfaces"
    alone = fit(plate, Settings(**PAPER | {"schedule": schedule}))
    assert alone.details["costs"]["detected surfaces"] == costs["detected surfaces"]
    assert mesh_csg(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.02)


def test_the_network_that_ships_has_learnt_the_family() -> None:
    """Parts of another seed than it was trained on: their inside, by eq. 4 and 6, from 64^3 voxels."""
    held_out = make_pretraining_dataset(8, 1024, 4321)
    voxels, points, inside = held_out.draw(8, 1024, True, np.random.default_rng(0))
    network = load_network(SHIPPED)
    with torch.no_grad():
        distance = distances(network.coefficients(network.encoder(voxels)), points)
        found = stages.sides("weighted_union", distance, network.selection, network.weights)
    made, there = (found.left > stages.BETA) & ~(found.right > stages.BETA), inside > 0
    assert float((made & there).sum() / (made | there).sum()) > 0.45  # half of them near the surface
    assert SHIPPED.stat().st_size < 4e6


def test_too_few_iterations_are_named(plate: Shape) -> None:
    with pytest.raises(EmptyShapeError, match="after 3 x 3 iterations no convex holds anything; give more"):
        fit(plate, Settings(**PAPER | {"start": "weights"}))


def test_searching_among_the_shipped_network_s_quadrics(plate: Shape) -> None:
    fitted = fit(plate, Settings(start="weights", surface=1500, near=1500, uniform=1200, tries=0))
    assert fitted.details["start"] == "pre-trained network"
    assert mesh_csg(fitted.assembly).is_watertight
    assert fitted.details["costs"]["pre-trained network"] < 0.7


def test_an_interruption_keeps_what_there_is(plate: Shape) -> None:
    cancel = Cancellation()

    def stop(step: Progress) -> None:
        if step.stage == "weighted union":
            cancel.request()

    fitted = fit(plate, Settings(**PAPER), Run(progress=stop, cancel=cancel))
    assert fitted.outcome == "interrupted"
    assert mesh_csg(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.02)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": "nothing"}, 'start: expected "seeds" or "weights" or "auto"'),
        ({"supervision": "mesh"}, 'supervision: expected "voxels" or "points" or "samples"'),
        ({"max_parts": 5}, "knows no max_parts"),
    ],
)
def test_settings_that_cannot_be_used_are_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        Settings(**PAPER | changes)


def test_points_and_grids_supervise_as_well() -> None:
    points, face = trimesh.sample.sample_surface(drilled_plate(), 10_000, seed=0)
    cloud = np.concatenate([points, drilled_plate().face_normals[face]], axis=1)
    fitted = fit(load_shape(cloud), Settings(**PAPER | {"supervision": "points"}))
    assert mesh_csg(fitted.assembly).volume == pytest.approx(drilled_plate().volume, rel=0.06)
