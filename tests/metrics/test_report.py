"""The whole report on shapes whose scores are known."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Sphere
from partwright.meshing import mesh_assembly
from partwright.metrics import Scores, evaluate
from partwright.metrics.deviation import buried
from partwright.shapes import load_shape


def ball_shape(radius: float = 1.0):
    return load_shape(trimesh.creation.icosphere(5, radius), unit="mm", up="z")


def ball(radius: float, x: float = 0.0) -> Assembly:
    return Assembly((Part(Sphere(radius), (x, 0.0, 0.0)),))


def test_a_perfect_ball() -> None:
    scores = evaluate(ball(1.0), ball_shape())
    assert scores.iou > 0.995
    assert scores.bi_surface_iou > 0.98
    assert scores.chamfer == pytest.approx(scores.chamfer_floor, rel=0.1)
    assert scores.emd is not None
    assert scores.emd < 0.06
    assert scores.overlap == 0.0
    assert scores.parts == 1
    assert scores.max_deviation < 0.004
    assert json.loads(json.dumps(scores.to_dict()))["worst_place"] == scores.worst_place


def test_an_inflated_ball() -> None:
    """Radius 1.1 for 1, in units of which 0.9 make a unit length."""
    scores = evaluate(ball(1.1), ball_shape(), emd=False)
    assert scores.max_deviation == pytest.approx(0.1, abs=0.004)
    assert scores.deviation_95 == pytest.approx(0.1, abs=0.004)
    assert scores.iou == pytest.approx(1 / 1.1**3, abs=0.01)
    assert scores.chamfer - scores.chamfer_floor == pytest.approx(2 * (0.1 * 0.9) ** 2, rel=0.03)
    assert scores.emd is None


def test_the_worst_place_is_where_a_part_sticks_out() -> None:
    spike = Part(Box((0.2, 0.2, 0.2)), translation=(1.2, 0.0, 0.0))
    scores = evaluate(ball(1.0) | spike, ball_shape(), emd=False)
    assert scores.worst_place == "right"
    assert scores.worst_point[0] == pytest.approx(1.3, abs=0.02)
    assert scores.max_deviation == pytest.approx(np.sqrt(1.3**2 + 2 * 0.1**2) - 1, abs=0.02)
    assert scores.max_protrusion == scores.max_deviation
    missing = evaluate(ball(1.0) - Part(Box((1.0, 1.0, 1.0)), (0.0, 0.0, 1.0)), ball_shape(), emd=False)
    assert missing.worst_place == "upper"
    assert missing.max_deviation == pytest.approx(0.5, abs=0.01)
    assert missing.max_protrusion < 0.01  # its surface lies deep inside, but outside nowhere


def test_what_is_left_out_does_not_stick_out() -> None:
    two = load_shape(trimesh.util.concatenate([_block(0.0), _block(2.0)]))
    scores = evaluate(Assembly((Part(Box((1.0, 1.0, 1.0))),)), two, emd=False)
    assert scores.max_deviation == pytest.approx(2.0, abs=0.01)
    assert scores.max_protrusion < 0.01


def test_buried_faces_and_hairline_cracks_do_not_count() -> None:
    """Blocks that run into each other by a half, and blocks with a crack between them, as one block."""
    overlapping = load_shape(trimesh.util.concatenate([_block(0.0), _block(0.5)]))
    scores = evaluate(Assembly((Part(Box((1.5, 1.0, 1.0)), (0.25, 0.0, 0.0)),)), overlapping, emd=False)
    assert scores.max_deviation < 0.01
    for gap, seen in ((0.004, False), (0.06, True)):
        cracked = load_shape(trimesh.util.concatenate([_block(0.0), _block(1.0 + gap)]))
        whole = Part(Box((2.0 + gap, 1.0, 1.0)), ((1.0 + gap) / 2, 0.0, 0.0))
        scores = evaluate(Assembly((whole,)), cracked, emd=False)
        assert (scores.max_deviation > 0.3) == seen
        # And the other way round: the crack in the assembly.
        halves = Assembly((Part(Box((1.0, 1.0, 1.0))), Part(Box((1.0, 1.0, 1.0)), (1.0 + gap, 0.0, 0.0))))
        solid = load_shape(trimesh.creation.box((2.0 + gap, 1.0, 1.0)).apply_translation(whole.translation))
        scores = evaluate(halves, solid, emd=False)
        assert (scores.max_deviation > 0.3) == seen


def test_buried_points_are_the_same_where_normals_are_known() -> None:
    cracked = load_shape(trimesh.util.concatenate([_block(0.0), _block(1.004), _block(1.7)]))
    drawn = cracked.unit_surface(4000, 0)
    alone = buried(cracked.unit_distance, drawn.points)
    assert 100 < np.count_nonzero(alone) < 2000
    np.testing.assert_array_equal(alone, buried(cracked.unit_distance, drawn.points, drawn.normals))


def _block(x: float) -> trimesh.Trimesh:
    return trimesh.creation.box((1.0, 1.0, 1.0)).apply_translation((x, 0.0, 0.0))


Measured = tuple[trimesh.Trimesh, Assembly, Scores]


@pytest.fixture(scope="module")
def measured() -> Measured:
    mesh = trimesh.creation.box((2.0, 1.0, 1.2))
    block, ball = Part(Box((1.0, 1.0, 1.1)), (-0.5, 0.0, 0.0)), Part(Sphere(0.55), (0.4, 0.0, 0.0), blend=0.1)
    assembly = Assembly((block, ball))
    return mesh, assembly, evaluate(assembly, load_shape(mesh), emd=False)


@pytest.mark.parametrize(
    "similarity",
    [
        Similarity(1e-4, translation=(3.0, -2.0, 1.0)),
        Similarity(2500.0, rotation=(0.0, 0.0, 0.0, 1.0), translation=(1e4, 2e4, -3e4)),
    ],
)
def test_scores_do_not_change_under_similarities(measured: Measured, similarity: Similarity) -> None:
    mesh, assembly, before = measured
    moved = mesh.copy()
    moved.vertices = similarity(mesh.vertices)
    after = evaluate(assembly.transformed(similarity), load_shape(moved), emd=False)
    for name in ("iou", "bi_surface_iou", "overlap"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=0.01)
    assert after.chamfer == pytest.approx(before.chamfer, rel=0.05)
    # A random sample of a corner: the maximum is only as sure as the sampling is dense.
    for name in ("max_deviation", "deviation_95"):
        assert getattr(after, name) / similarity.scale == pytest.approx(getattr(before, name), rel=0.03)


def test_same_seed_same_scores_and_a_given_mesh_is_used() -> None:
    assembly, shape = ball(1.05), ball_shape()
    surface = mesh_assembly(assembly)
    one, two = evaluate(assembly, shape, seed=3, surface=surface), evaluate(assembly, ball_shape(), seed=3)
    assert isinstance(one, Scores)
    assert one == two
    assert evaluate(assembly, shape, seed=4, emd=False).chamfer != one.chamfer


def test_nothing_left_is_named() -> None:
    with pytest.raises(NoSurfaceError):
        evaluate(ball(0.5) - Part(Sphere(1.0)), ball_shape())


def test_groups_that_are_copies_count_once() -> None:
    group = Assembly((Part(Box((0.4, 0.4, 0.4)), (0.5, 0, 0)), Part(Sphere(0.3), (0.5, 0, 0.3))))
    both = Assembly((Part(Sphere(1.0)), group, group.translated((-1, 0, 0))))
    assert evaluate(both, ball_shape(), emd=False).parts == 3
