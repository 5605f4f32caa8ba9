"""Parts moved to an outline: a camera's derivatives, layouts found again, outlines that nobody trusts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from scipy import ndimage

from partwright.partsdf import outline_fit
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.outline_fit import _Layout, _PlacedParts, _Problem, fit_outline
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.photos import Covered
from partwright.partsdf.pinhole import NEAR, NUMBERS, Pinhole
from partwright.partsdf.poses import PoseTensors, rotation_matrices
from partwright.render import Camera
from partwright.render.raycast import Scene

EYE = Pinhole(np.array([0.5, 0.3, 0.02, 0.2, math.log(0.45), 0.03, -0.02]), "z")
CELLS = 64


def boxes(shape: NeuralShape) -> dict[str, trimesh.Trimesh]:
    """In place of parts' meshes, their boxes."""
    found = {}
    for p, name in enumerate(shape.model.parts):
        if not shape.present[p]:
            continue
        box = trimesh.creation.box((2, 2, 2)).subdivide().subdivide()
        matrix = (rotation_matrices(shape.poses.rotation[p]) * shape.poses.scale[p]).numpy()
        box.vertices = box.vertices @ matrix.T + shape.poses.translation[p].numpy()
        found[name] = box
    return found


def seen(shape: NeuralShape, eye: Pinhole) -> Covered:
    """The mask of a shape's boxes."""
    whole = trimesh.util.concatenate(list(boxes(shape).values()))
    origin, rays = eye.rays(CELLS)
    face, _, _ = Scene(whole.vertices, whole.faces).first_hit(np.broadcast_to(origin, rays.shape), rays)
    mask = (face >= 0).reshape(CELLS, CELLS).astype(float)
    return Covered(mask, np.ones_like(mask))


def stretched(shape: NeuralShape) -> NeuralShape:
    """Its ball a tenth larger and higher, its plate longer."""
    poses = shape.poses
    place, size = poses.translation.clone(), poses.scale.clone()
    place[1, 2] += 0.08
    size[1] *= 1.12
    size[0, 0] *= 1.08
    return replace(shape, poses=PoseTensors(place, poses.rotation, size))


def test_rays_go_where_points_are_seen() -> None:
    origin, rays = EYE.rays(8)
    place = (np.arange(8) + 0.5) / 8 - 0.5
    expected = np.stack([np.tile(place, 8), np.repeat(-place, 8)], axis=1)
    for far in (0.5, 1.0, 1.3):
        points = origin + far * np.linalg.norm(origin) * rays
        np.testing.assert_allclose(EYE.project(points), expected, atol=1e-6)
    assert np.linalg.norm(origin) == pytest.approx(1 / EYE.numbers[NEAR])


def test_derivatives_of_places() -> None:
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (20, 3))
    step = 1e-6
    numeric = np.stack(
        [(EYE.project(points + s) - EYE.project(points - s)) / (2 * step) for s in step * np.eye(3)], axis=-1
    )
    np.testing.assert_allclose(EYE.by_points(points), numeric, atol=1e-8)
    moved = EYE.moved(1e-4 * np.arange(1, NUMBERS + 1))
    told = EYE.by_numbers(points) @ (moved.numbers - EYE.numbers)
    np.testing.assert_allclose(moved.project(points) - EYE.project(points), told, atol=1e-6)


def test_a_camera_is_placed_so_that_a_box_is_filled() -> None:
    points = np.random.default_rng(1).uniform(-0.7, 0.7, (50, 3))
    camera = Camera(200.0, 15.0, 40.0, "y", 0.0)
    eye = Pinhole.filling(camera, points, (-0.3, -0.4, 0.45, 0.35))
    places = eye.project(points)
    # As large as the box, in the middle of it; its own sides are in its own proportion.
    np.testing.assert_allclose(places.min(axis=0) + places.max(axis=0), (0.15, -0.05), atol=1e-9)
    assert np.prod(np.ptp(places, axis=0)) == pytest.approx(0.75 * 0.75)
    back = eye.camera
    assert (back.azimuth, back.elevation) == pytest.approx((200.0, 15.0))


def test_a_layout_of_the_family_is_found_again(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    # By the outline alone, as far as the family's layouts go: the ball and the plate are of other sizes.
    monkeypatch.setattr(outline_fit, "_LOOSE", 1.0)
    monkeypatch.setattr(outline_fit, "_USUAL", 0.0)
    vectors = PartVectors.of(model)
    shape, true = (NeuralShape.trained(model, name) for name in ("0", "5"))
    picture = seen(true, EYE)
    start = EYE.moved(np.array([0.05, -0.05, 0.01, 0.0, 0.02, 0.01, 0.0]))
    found = fit_outline(shape, boxes(shape), picture, start)

    def differing(one: NeuralShape, eye: Pinhole) -> float:
        return float(np.abs(seen(one, eye).share - picture.share).sum())

    def apart(one: NeuralShape) -> float:
        return float((vectors.of_poses(one.poses) - vectors.of_poses(true.poses)).norm())

    assert differing(found.shape, found.eye) < 0.15 * differing(shape, start)
    assert found.iou > 0.96
    assert apart(found.shape) < 0.75 * apart(shape)
    assert torch.equal(found.shape.present, shape.present)
    assert torch.equal(found.shape.latents[shape.present], shape.latents[shape.present])


def test_a_mask_changes_as_is_told(model: Model) -> None:
    shape = NeuralShape.trained(model, "0")
    picture = seen(stretched(shape), EYE)
    problem = _Problem(_Layout(shape), _PlacedParts(shape, boxes(shape)), picture, EYE)
    size, blur = problem.layout.size, 3.0
    state = problem._state(np.zeros(size), EYE, blur)
    slopes, off = problem._change(state)
    share = ndimage.gaussian_filter(state.mask.astype(float), blur)
    np.testing.assert_allclose(state.share, share)
    assert slopes.shape == (len(off), size + NUMBERS)
    down, across = np.gradient(share * CELLS)
    band = np.hypot(down, across) > outline_fit._BAND * CELLS
    np.testing.assert_allclose(off, (share - ndimage.gaussian_filter(picture.share, blur))[band])
    # Size and place of the picture shift all rims; what turns boxes brings other edges to them.
    for k, step, alike in ((4, 0.05, 0.96), (5, 0.03, 0.98), (6, 0.03, 0.98), (2, 0.06, 0.9), (-1, 0.5, 0.9)):
        way = np.zeros(size + NUMBERS)
        way[size + k] = step
        plus, minus = (
            problem._state(s * way[:size], EYE.moved(s * way[size:]), blur).share[band] for s in (0.5, -0.5)
        )
        told, true = slopes @ way, plus - minus
        assert told @ true > alike * np.linalg.norm(told) * np.linalg.norm(true), k
        assert np.linalg.norm(told) == pytest.approx(np.linalg.norm(true), rel=0.2), k


def test_what_nobody_trusts_moves_nothing(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outline_fit, "_USUAL", 0.0)  # what is usual in the family draws, too
    shape = NeuralShape.trained(model, "0")
    picture = seen(stretched(shape), EYE)
    found = fit_outline(shape, boxes(shape), replace(picture, trust=np.zeros_like(picture.share)), EYE)
    assert torch.allclose(found.shape.poses.translation, shape.poses.translation, atol=1e-5)
    assert torch.allclose(found.shape.poses.scale, shape.poses.scale, atol=1e-5)
    np.testing.assert_allclose(found.eye.numbers, EYE.numbers)
