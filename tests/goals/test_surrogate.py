"""The drag network: what it learns of bodies whose drag is known, its slopes, and when not to believe it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from partwright.assembly import Assembly, Part
from partwright.errors import ModelError, SettingError
from partwright.fields import Box
from partwright.goals import Start
from partwright.goals.flow.air import Air
from partwright.goals.flow.dataset import Sample
from partwright.goals.flow.learning import scores, train
from partwright.goals.flow.simulation import PRESSURE
from partwright.goals.flow.skin import Skin
from partwright.goals.flow.surrogate import Spread, Surrogate
from partwright.goals.objectives.surrogate import drawn, outside, predicted
from partwright.goals.wanted import measure_of


def blunt(seed: int) -> Sample:
    """A box that the air presses on its front only: its drag is the area of its front."""
    size = np.array([1.0, 0.5, 0.4]) * np.random.default_rng(seed).uniform(0.6, 1.4, 3)
    box = trimesh.creation.box(size)
    fine = box.subdivide().subdivide().subdivide()
    pressure = np.where(fine.face_normals[:, 0] < -0.9, 1.0, 0.0)
    skin = Skin(np.array(fine.vertices), np.array(fine.faces), {PRESSURE: pressure})
    drag = float(size[1] * size[2])
    return Sample(f"box {seed}", drag, 0.0, Air(), skin, np.array(box.vertices), np.array(box.faces))


@pytest.fixture(scope="module")
def model() -> Surrogate:
    return train([blunt(seed) for seed in range(24)], rounds=60, width=24, points=128, mirror="y")


def test_bodies_that_it_has_not_seen_are_ranked(model: Surrogate) -> None:
    found = scores(model, [blunt(seed) for seed in range(100, 116)], mean=0.2)
    assert found.bodies == 16
    assert found.rank > 0.95
    assert found.r2 > 0.9
    assert found.error < 0.4 * found.floor


def test_its_slope_is_that_of_its_number(model: Surrogate, tmp_path: Path) -> None:
    model.save(tmp_path / "drag.safetensors")
    assembly = Assembly((Part(Box((1.0, 0.5, 0.4))),), unit="m")
    surface = trimesh.creation.box((1.0, 0.5, 0.4)).subdivide().subdivide()
    start = Start(assembly, surface, 1.0)
    measure, power = measure_of(f"surrogate_drag@{tmp_path / 'drag.safetensors'}", start)
    assert power == 2
    vertices, faces, labels = (
        np.array(surface.vertices),
        np.array(surface.faces),
        np.zeros(len(surface.faces), int),
    )
    value, slope = measure(vertices, faces, labels)
    assert value == pytest.approx(0.2, rel=0.15)
    # The points stay where they are on the faces: the draws follow the areas, which no slope knows.
    spreads = drawn(vertices, faces)
    for axis in (1, 2):
        step = 0.02 * vertices * np.eye(3)[axis]
        ends = [predicted(model, torch.tensor(vertices + s * step), faces, 1.0, spreads)[0] for s in (1, -1)]
        assert (slope * step).sum() == pytest.approx(float((ends[0] - ends[1]).detach()) / 2, rel=0.03)
    # The same body in millimetres has the same drag: in its own unit a million times the number.
    large, _ = measure_of(
        f"surrogate_drag@{tmp_path / 'drag.safetensors'}",
        Start(Assembly(assembly.children, unit="mm"), surface, 1e3),
    )
    assert large(1e3 * vertices, faces, labels)[0] == pytest.approx(1e6 * value, rel=1e-4)


def test_a_body_unlike_all_is_told(model: Surrogate) -> None:
    assert outside(model, trimesh.creation.box((1.0, 0.5, 0.4)), 1.0) < 1
    assert outside(model, trimesh.creation.box((0.2, 3.0, 2.0)), 1.0) > 2


def test_a_model_is_read_back_as_it_was(model: Surrogate, tmp_path: Path) -> None:
    path = tmp_path / "drag.safetensors"
    model.save(path)
    again = Surrogate.load(path)
    body = [blunt(7)]
    assert scores(again, [*body, blunt(8)], 0.2) == scores(model, [*body, blunt(8)], 0.2)
    assert (again.air, again.length) == (model.air, model.length)
    for damage in (path.read_bytes()[:200], b"", b"{}"):
        (tmp_path / "bad.safetensors").write_bytes(damage)
        with pytest.raises(ModelError, match="expected a drag model"):
            Surrogate.load(tmp_path / "bad.safetensors")
    with pytest.raises(ModelError, match="expected a drag model"):
        Surrogate.load(tmp_path / "none.safetensors")
    with pytest.raises(SettingError, match="expected a model's file"):
        measure_of("surrogate_drag", Start(Assembly((Part(Box((1.0, 1.0, 1.0))),)), trimesh.Trimesh(), 1.0))


def test_points_lie_on_the_surface_as_its_area_asks_for() -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    spread = Spread.over(box.area_faces, seed=3)
    points, normals, area = spread.on(torch.tensor(box.vertices), torch.tensor(box.faces))
    assert float(area) == pytest.approx(22.0)
    assert np.abs(np.abs(points.numpy() / [0.5, 1.0, 1.5]).max(axis=1) - 1).max() < 1e-6
    ends = (np.abs(normals.numpy()[:, 0]) > 0.9).mean()
    assert ends == pytest.approx(12 / 22, abs=0.01)


def test_too_few_bodies_are_named() -> None:
    with pytest.raises(SettingError, match="too few"):
        train([blunt(0)])
