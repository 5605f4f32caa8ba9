"""PartSDF's measures on solids whose scores are known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import trimesh

from partwright.metrics import mean_scores, reconstruction_scores
from partwright.metrics.image_consistency import image_consistency, views
from partwright.metrics.parted import (
    OUTSIDE,
    joint_box,
    joint_owners,
    owners_in,
    part_iou,
    undecided,
    whole_iou,
)
from partwright.metrics.reconstruction import worst_chamfer
from partwright.render.raycast import Scene


@dataclass(frozen=True)
class Surface:
    vertices: np.ndarray
    faces: np.ndarray
    label: np.ndarray


def cuboid(low: tuple[float, ...], high: tuple[float, ...], cut: float | None = None) -> Surface:
    """A box; where it is cut, faces left of x = cut are part 0, the others part 1."""
    mesh = trimesh.creation.box(bounds=[low, high])
    for _ in range(4):
        mesh = mesh.subdivide()
    label = np.zeros(len(mesh.faces), int) if cut is None else (mesh.triangles_center[:, 0] > cut).astype(int)
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces), label)


def test_a_surface_agrees_with_itself() -> None:
    left, right = cuboid((-0.9, -0.9, -0.9), (-0.5, -0.7, -0.6)), cuboid((0.2, 0.3, 0.6), (0.9, 0.9, 0.9))
    box = Surface(
        np.concatenate([left.vertices, right.vertices]),
        np.concatenate([left.faces, right.faces + len(left.vertices)]),
        np.concatenate([left.label, right.label + 1]),
    )
    scores = reconstruction_scores(box, box)
    assert (scores.iou, scores.part_iou, scores.decided_part_iou, scores.failed) == (1, 1, 1, 0)
    assert scores.image_consistency == pytest.approx(1, abs=1e-6)
    assert scores.chamfer == pytest.approx(scores.chamfer_floor, rel=0.05)


def test_ious_of_boxes_are_those_of_their_volumes() -> None:
    """On boxes that differ along all axes, over a joint box that is no cube."""
    first, second = cuboid((-0.9, -0.4, -0.2), (0.7, 0.4, 0.2)), cuboid((-0.5, -0.4, -0.2), (0.9, 0.4, 0.2))
    one, other = joint_owners(first, second)
    assert one.shape == (128, 128, 128)
    assert whole_iou(one, other) == pytest.approx(1.2 / 1.8, abs=0.02)
    assert whole_iou(one, other) == whole_iou(other, one)


def test_parts_are_what_is_nearest_and_need_not_be_closed() -> None:
    """The same bar cut in two at 0 and at 0.3: parts of 0.9 + 0.9 and of 1.2 + 0.6."""
    first = cuboid((-0.9, -0.1, -0.1), (0.9, 0.1, 0.1), cut=0.0)
    second = cuboid((-0.9, -0.1, -0.1), (0.9, 0.1, 0.1), cut=0.3)
    one, other = joint_owners(first, second, 48)
    assert whole_iou(one, other) == 1
    assert part_iou(one, other) == pytest.approx((0.9 / 1.2 + 0.6 / 0.9) / 2, abs=0.06)


def test_a_part_that_only_one_has_counts_as_lost() -> None:
    first = cuboid((-0.9, -0.1, -0.1), (0.9, 0.1, 0.1), cut=0.0)
    one, other = joint_owners(first, replace(first, label=np.zeros_like(first.label)), 48)
    assert part_iou(one, other) == pytest.approx((0.5 + 0) / 2, abs=0.01)
    assert part_iou(np.full(8, OUTSIDE), np.full(8, OUTSIDE)) == 1


def table(flip: bool) -> Surface:
    """A plate on one thick leg; `flip` says whose faces come first, and are found where two are as near."""
    plate = trimesh.creation.box(bounds=[(-0.9, -0.9, 0.0), (0.9, 0.9, 0.4)])
    leg = trimesh.creation.box(bounds=[(-0.5, -0.5, -0.9), (0.5, 0.5, 0.2)])
    mesh = trimesh.boolean.union([plate, leg])
    label = (mesh.triangles_center[:, 2] < -1e-6).astype(int)
    order = np.argsort(label if flip else -label, kind="stable")
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces)[order], label[order])


def test_what_lies_behind_an_edge_of_two_parts_is_nobodys() -> None:
    """Above the leg all is nearest to its rim, which is the plate's, too; elsewhere not."""
    surface = table(flip=False)
    lower, size = joint_box(surface, surface)
    owner = owners_in(surface, lower, size, 40)
    tied = undecided(surface, owner, lower, size)
    x, y, z = (lower + (np.argwhere(np.ones(owner.shape)) + 0.5) * (size / 40)).T.reshape(3, *owner.shape)
    column = (np.abs(x) < 0.42) & (np.abs(y) < 0.42) & (np.maximum(np.abs(x), np.abs(y)) > 0.3)
    assert tied[column & (z > 0.03) & (z < 0.12)].all()
    assert not tied[(np.abs(x) > 0.75) | (z < -0.3)].any()
    other = owners_in(table(flip=True), lower, size, 40)
    assert part_iou(owner[~tied], other[~tied]) == 1
    assert (tied & (owner != OUTSIDE)).sum() == tied.sum() > 0
    alone = replace(surface, label=np.zeros_like(surface.label))
    assert not undecided(alone, owners_in(alone, lower, size, 40), lower, size).any()


def test_open_surfaces_are_measured_by_winding_number() -> None:
    box = cuboid((-0.9, -0.5, -0.3), (0.9, 0.5, 0.3))
    few = Surface(box.vertices, box.faces[5:], box.label[5:])
    one, other = joint_owners(few, box, 48)
    assert whole_iou(one, other) > 0.97


def test_image_consistency_of_moved_and_turned_surfaces() -> None:
    box = cuboid((-0.9, -0.5, -0.3), (0.9, 0.5, 0.3))
    scene = Scene(box.vertices, box.faces)
    moved = [Scene(box.vertices + np.array([0, 0, d]), box.faces) for d in (0.0, 0.1, 0.4)]
    near, nearer, far = (image_consistency(scene, other, 128) for other in moved)
    assert near == pytest.approx(1, abs=1e-6)
    assert 1 > nearer > far > 0
    away = Scene(box.vertices * 0.01 + 0.9, box.faces)
    assert image_consistency(scene, away, 64) < 0.05
    inside_out = Scene(box.vertices, box.faces[:, ::-1])
    assert image_consistency(scene, inside_out, 64) == pytest.approx(-1, abs=1e-6)


def test_all_of_the_unit_frame_is_seen() -> None:
    corners = np.array(np.meshgrid(*[[-0.9, 0.9]] * 3)).reshape(3, -1).T
    for view in views():
        local = (corners - view.eye) @ np.stack([view.right, view.up, -view.back], axis=1)
        assert (np.abs(local[:, :2] / local[:, 2:]) < view.half[0]).all()
        assert np.linalg.det(np.stack([view.right, view.up, view.back])) == pytest.approx(1)


def test_failures_are_the_worst_and_stay_in_the_mean() -> None:
    box = cuboid((-0.9, -0.5, -0.3), (0.9, 0.5, 0.3))
    failed = reconstruction_scores(None, box)
    empty = reconstruction_scores(Surface(box.vertices, box.faces[:0], box.label[:0]), box)
    assert failed == empty
    assert (failed.iou, failed.image_consistency, failed.part_iou, failed.failed) == (0, 0, 0, 1)
    assert failed.decided_part_iou == 0
    far = cuboid((0.8, 0.8, 0.8), (1, 1, 1))
    assert failed.chamfer > reconstruction_scores(far, box).chamfer
    good = reconstruction_scores(box, box)
    mean = mean_scores([good, failed])
    assert mean.iou == 0.5
    assert mean.failed == 0.5
    assert mean.chamfer == pytest.approx((good.chamfer + failed.chamfer) / 2)


def test_the_worst_chamfer_is_finite_and_of_the_farthest_corner() -> None:
    assert worst_chamfer(np.array([[-1.0, -1.0, -1.0]])) == pytest.approx(24)  # 12 either way
