"""Where a search begins: turned shapes, parts of several training shapes; and shapes of no such family."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

import partwright as pw
from partwright.assembly import Similarity
from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION
from partwright.partsdf.familiarity import ODD, STRANGE, Familiarity, familiarity, oddness
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.starts import (
    best_starts,
    errors_by_part,
    errors_of,
    exchanged_parts,
    latents_by_part,
    ways_to_stand,
)
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import Frame


def target_of(shape: NeuralShape, count: int = 4000) -> Target:
    """A target that the model itself can reach exactly."""
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (count, 3)).astype(np.float32)
    return Target(torch.from_numpy(points), torch.from_numpy(shape.distances(points)))


def test_ways_to_stand_are_turns_about_the_up_axis_and_all_axes_where_it_is_unknown() -> None:
    assert ways_to_stand("z")[0] == pytest.approx(NO_ROTATION)
    up = {
        "x": (1, 0, 0),
        "-x": (-1, 0, 0),
        "y": (0, 1, 0),
        "-y": (0, -1, 0),
        "z": (0, 0, 1),
        "-z": (0, 0, -1),
    }
    for axis, expected in up.items():
        ways = ways_to_stand(axis)
        assert ways[0] == pytest.approx(NO_ROTATION)
        for rows in (Similarity(1.0, turn)(np.eye(3)) for turn in ways[-4:]):
            np.testing.assert_allclose(rows[2], expected, atol=1e-12)  # z is up there
        for turn in ways[:-4]:
            np.testing.assert_allclose(Similarity(1.0, turn)(np.array([expected]))[0], expected, atol=1e-12)
        matrices = (Similarity(1.0, turn)(np.eye(3)).flatten() for turn in ways)
        assert len({tuple(np.round(m, 6) + 0.0) for m in matrices}) == (4 if axis == "z" else 8)
    every = {tuple(np.round(Similarity(1.0, t)(np.eye(3)), 6).flatten() + 0.0) for t in ways_to_stand(None)}
    assert len(every) == 24


def test_ways_to_stand_of_a_family_that_has_another_axis_up() -> None:
    """As all of GLB files, where y is up."""

    def matrices(turns: list[Quaternion]) -> set[tuple[float, ...]]:
        return {tuple(np.round(Similarity(1.0, t)(np.eye(3)), 6).flatten() + 0.0) for t in turns}

    assert ways_to_stand("y", "y")[0] == pytest.approx(NO_ROTATION)
    assert matrices(ways_to_stand("y", "y")) == matrices(ways_to_stand("y")[:4])
    assert ways_to_stand(None, "y")[0] == pytest.approx(NO_ROTATION)
    assert matrices(ways_to_stand(None, "y")) == matrices(ways_to_stand(None))
    for turn in ways_to_stand("z", "y")[4:]:  # after those of a family that stands as the shape, by mistake
        np.testing.assert_allclose(Similarity(1.0, turn)(np.array([[0, 1, 0]]))[0], (0, 0, 1), atol=1e-12)


def test_a_scan_of_a_piece_is_not_taken_for_all_of_its_shape(model: Model) -> None:
    """Without two fifths of their height, in a frame of what is left: lamps start as large as they are (where
    the scan's own frame was taken for theirs, at an IoU of .28)."""
    ious = []
    for name in ("lamp0", "lamp1", "lamp3"):
        whole = NeuralShape.trained(model, name)
        points = np.asarray(mesh_shape(whole, 32, parts=False).whole.sample(2000, seed=0))
        low, high = points.min(axis=0), points.max(axis=0)
        piece = points[points[:, 2] < low[2] + 0.6 * (high - low)[2]]
        frame = pw.load_shape(piece).frame
        (start,) = best_starts(model, Target.of_points(frame.to_unit(piece), 2000), 1, [NO_ROTATION])
        places = np.random.default_rng(0).uniform(low, high, (4000, 3))
        true = whole.distances(places.astype(np.float32)) < 0
        found = start.shape.distances(frame.to_unit(places).astype(np.float32)) < 0
        ious.append(np.count_nonzero(found & true) / np.count_nonzero(found | true))
    assert np.mean(ious) > 0.5


@pytest.mark.parametrize("up", ["y", None])
def test_a_turned_shape_is_found_as_it_stands(model: Model, up: str | None) -> None:
    """A training shape lying on another axis and turned: the first start is that shape, in that turn."""
    target = target_of(NeuralShape.trained(model, "lamp3"))
    for turn in ways_to_stand("y")[5:7]:
        matrix = torch.tensor(Similarity(1.0, turn)(np.eye(3)), dtype=torch.float32)
        lying = replace(target, points=target.points @ matrix)
        first = best_starts(model, lying, 3, ways_to_stand(up))[0]
        np.testing.assert_allclose(np.abs(np.dot(first.turn, turn)), 1.0, atol=1e-9)
        assert first.shape.latents.equal(NeuralShape.trained(model, "lamp3").latents)
        torch.testing.assert_close(first.target.points, target.points, atol=1e-5, rtol=0)
    assert all(s.turn == NO_ROTATION for s in best_starts(model, target, 3, ways_to_stand("z")))


def test_parts_are_exchanged_one_by_one(model: Model) -> None:
    """A lamp with the plate of another: the start gets that plate, and what fits already stays."""
    own, other = (NeuralShape.trained(model, name) for name in ("lamp0", "lamp4"))
    latents, poses = own.latents.clone(), own.poses.map(torch.Tensor.clone)
    latents[0] = other.latents[0]
    for mine, theirs in zip(poses, other.poses, strict=True):
        mine[0] = theirs[0]
    target = target_of(replace(own, latents=latents, poses=poses))
    found = exchanged_parts(own, target)
    assert found.latents[0].equal(other.latents[0])
    rows = torch.arange(1000)
    before, after = (
        float(errors_of(model, one.latents[None], one.poses.map(lambda t: t[None]), target, rows)[0])
        for one in (own, found)
    )
    assert after < 0.5 * before
    assert exchanged_parts(own, target_of(own)).latents.equal(own.latents)


def test_known_parts_start_as_the_closest_of_the_training_shapes(model: Model) -> None:
    """A lamp with the plate of another: each part's latent is that of the lamp that it is of."""
    own, other = (NeuralShape.trained(model, name) for name in ("lamp0", "lamp4"))
    latents = own.latents.clone()
    latents[0] = other.latents[0]
    shape = replace(own, latents=latents)
    target = target_of(shape)
    part = torch.from_numpy(shape.part_distances(target.points.numpy())).argmin(dim=0)
    (found,) = latents_by_part(model, own.poses, replace(target, part=part))
    assert found[0].equal(other.latents[0])
    for number in own.present.nonzero().squeeze(1).tolist()[1:]:
        assert found[number].equal(own.latents[number])
    unseen = replace(target, part=torch.zeros_like(part))
    assert latents_by_part(model, own.poses, unseen)[0, 1].equal(model.mean_latent[1])
    three = latents_by_part(model, own.poses, replace(target, part=part), 3)
    errors = errors_by_part(
        model, three, own.poses.map(lambda t: t.expand(3, *t.shape)), replace(target, part=part)
    )
    assert three[0].equal(found)
    assert (errors[1:, own.present] > errors[0, own.present]).all()
    count = len(model.latents)
    apart = errors_by_part(
        model, model.latents, own.poses.map(lambda t: t.expand(count, *t.shape)), replace(target, part=part)
    )
    for number in own.present.nonzero().squeeze(1).tolist():
        having = model.present[:, number].nonzero().squeeze(1)
        closest = having[apart[having, number].argsort()[:3]]
        assert three[:, number].equal(model.latents[closest, number])


def test_a_fit_says_how_it_is_turned_and_what_is_no_such_shape(model: Model, tmp_path: Path) -> None:
    """A ring among lamps: one line of warning, in the report as for every method; and a lamp that lies."""
    file = tmp_path / "lamps.safetensors"
    model.save(file)
    settings = pw.LearnedParts(str(file), iterations=40, points=256, starts=2, resolution=48)
    ring = trimesh.creation.torus(0.8, 0.15)
    odd = pw.fit(pw.load_shape(ring), settings)
    lines = [line for line in odd.warnings if "no shape of the family that lamps knows" in line]
    assert len(lines) == 1
    learned = odd.report["learned"][0]
    oddest = min(2.0, max(learned["oddness"].values()))
    assert learned["residual"] * max(1.0, learned["layout"]) * max(1.0, oddest) > STRANGE
    half = math.sqrt(0.5)
    ball = trimesh.creation.icosphere(3, 0.38).apply_translation((0.2, 0, 0.53))
    lying = trimesh.util.concatenate([trimesh.creation.box((1.6, 1.2, 0.3)), ball])
    lying.vertices = Similarity(1.0, (half, -half, 0.0, 0.0))(lying.vertices)  # y up
    fitted = pw.fit(pw.load_shape(lying, up="y"), settings)
    assert fitted.report["learned"][0]["residual"] < 0.7 * odd.report["learned"][0]["residual"]
    assert fitted.scores.iou > 0.7
    plate = fitted.assembly["plate"]
    middle = np.mean(plate.bounds(), axis=0)
    assert middle[1] == pytest.approx(0.0, abs=0.1)  # below the ball, along y
    assert np.mean(fitted.assembly["ball"].bounds(), axis=0)[1] > 0.35


def test_points_of_something_else_are_told_of_by_far_smaller_errors(model: Model) -> None:
    """Points do not tell inside from outside, so what is left over says less, and counts sooner."""
    shape = NeuralShape.trained(model, "lamp0")
    ring = trimesh.creation.torus(0.7, 0.15).sample(2000, seed=0)
    target = Target.of_points(ring, count=8000)
    (line,) = familiarity(shape, target).warnings()
    assert "no shape of the family that lamps knows, or points with too much noise" in line
    told = Familiarity("lamps", 0.007, {"plate": 1.4}, 1.2, of_points=True)
    assert told.warnings() == []
    assert replace(told, residual=0.04).warnings()
    assert replace(told, residual=0.04, of_points=False).warnings() == []


def test_parts_in_points_of_a_piece_lie_as_in_their_own_frame(model: Model) -> None:
    """A scan of a piece has a frame of its own, which makes no stranger of what is found in it; a surface has
    its shape's."""
    shape = NeuralShape.trained(model, "lamp0")
    moved = Frame(torch.tensor([0.4, 0.0, -0.3]), torch.tensor(0.5)).from_family(shape.poses)
    points = Target.of_points(trimesh.creation.icosphere(3).vertices, count=1000)
    for target, alike in ((points, True), (target_of(shape, 100), False)):
        here, there = (familiarity(replace(shape, poses=p), target).layout for p in (shape.poses, moved))
        assert (there == pytest.approx(here, rel=1e-3)) == alike


def test_oddness_is_one_at_the_farthest_training_shape(model: Model) -> None:
    worst = [
        max(oddness(model, part, latent) for latent in model.latents[model.present[:, part], part])
        for part in range(3)
    ]
    assert worst == pytest.approx([1.0, 1.0, 1.0])
    shape = NeuralShape.trained(model, "lamp0")
    known = familiarity(shape, target_of(shape))
    assert known.residual < 1e-6
    assert known.warnings() == []
    far = replace(shape, latents=shape.latents + 5.0)
    assert familiarity(far, target_of(far)).latents["plate"] > ODD
    (line,) = Familiarity("lamps", 0.3, {"ball": 2.0}, 2.5).warnings()
    assert "off by 30 %" in line
    assert "its parts lie 2.5 times as far from the usual" in line
    assert "ball is 2.0 times as odd" in line
    # Near, of odd parts in odd places, is an unusual lamp; so is what is off but lies as lamps do.
    assert Familiarity("lamps", 0.05, {"ball": 9.0}, 4.0).warnings() == []
    assert Familiarity("lamps", 0.16, {"ball": ODD}, 0.3).warnings() == []
    assert Familiarity("lamps", 0.16, {"ball": ODD}, 4.0).warnings()
    assert "odd" not in Familiarity("lamps", 0.6, {"ball": ODD}, 1.0).warnings()[0]
    # Either odd forms or odd places are found in lamps that are met as closely, both together are not.
    for ball, layout in ((1.8, 1.0), (1.0, 3.0)):
        assert Familiarity("lamps", 0.16, {"ball": ball, "plate": 0.5}, layout).warnings() == []
    assert Familiarity("lamps", 0.16, {"ball": 1.8, "plate": 0.5}, 3.0).warnings()


def test_a_poor_fit_is_told_though_its_parts_are_as_usual() -> None:
    """As half of a shape that has no part for the other half."""
    usual = Familiarity("lamps", 0.16, {"ball": 0.9}, 0.9)
    assert usual.warnings() == []
    (line,) = replace(usual, residual=0.2).warnings()
    assert "no shape of the family that lamps knows: its distances are off by 20 % of what counts" in line
    assert replace(usual, residual=0.2).poor
    assert not replace(usual, residual=0.2).odd
