"""Pre-training: its data have the parts' own sides, it repeats, goes on where it was stopped, and learns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from partwright.capri.network import SMALL, UNIT_TO_PAPER, CapriNet, NetworkSizes, load_network
from partwright.capri.pretraining import (
    CHECKPOINT,
    COLLECTION,
    NETWORK,
    PretrainingReport,
    PretrainingSettings,
    Trainer,
    train,
)
from partwright.capri.pretraining_dataset import (
    PretrainingDataset,
    load_pretraining_dataset,
    make_pretraining_dataset,
)
from partwright.datasets.cad_parts import cad_part
from partwright.errors import SettingError, UnreadableFileError
from partwright.shapes import load_shape

TINY = NetworkSizes(primitives=32, convexes=4, code=8, hidden=16, channels=2)
BRIEF = PretrainingSettings(parts=4, points=128, batch=2, draw=64, steps=6, every=2)


@pytest.fixture(scope="module")
def few() -> PretrainingDataset:
    return make_pretraining_dataset(4, 512, seed=0)


def test_points_have_the_part_s_own_side(few: PretrainingDataset) -> None:
    shape = load_shape(cad_part(1).mesh)
    distance = shape.unit_distance(few.points[1].float().numpy() / UNIT_TO_PAPER)
    np.testing.assert_array_equal(few.inside[1], distance < 0)
    voxels, points, inside = few.rows(slice(1, 2))
    np.testing.assert_array_equal(voxels[0, 0] > 0, shape.unit_occupancy(64))
    np.testing.assert_array_equal(inside[0] > 0, distance < 0)
    assert torch.equal(points[0], few.points[1].float())
    assert (np.abs(distance[:256]) < 0.25).all()
    assert np.abs(distance[256:]).max() > 0.4


def test_a_batch_is_turned_as_a_whole(few: PretrainingDataset) -> None:
    """The voxel that holds a point nearly always says the same, however the cube is turned."""
    for seed in range(8):
        voxels, points, inside = few.draw(3, 400, near=False, rng=np.random.default_rng(seed))
        assert voxels.shape == (3, 1, 64, 64, 64)
        cell = torch.clamp(((points / UNIT_TO_PAPER + 1) * 32).long(), 0, 63)
        for i in range(3):
            held = voxels[i, 0][tuple(cell[i].T)]
            assert float((held * inside[i]).sum() / torch.maximum(held, inside[i]).sum()) > 0.6


def test_a_collection_comes_back_from_its_file(few: PretrainingDataset, tmp_path: Path) -> None:
    few.save(tmp_path / "c", 4, 0)
    back = load_pretraining_dataset(tmp_path / "c", 4, 512, 0)
    for name in ("voxels", "points", "inside"):
        np.testing.assert_array_equal(getattr(back, name), getattr(few, name))
    again = make_pretraining_dataset(4, 512, seed=0, workers=2)
    assert all(torch.equal(getattr(again, name), getattr(few, name)) for name in vars(few))
    with pytest.raises(UnreadableFileError, match="holds other CAD parts"):
        load_pretraining_dataset(tmp_path / "c", 5, 512, 0)
    (tmp_path / "c").write_bytes(b"x" * 100)
    with pytest.raises(UnreadableFileError, match="is no collection"):
        load_pretraining_dataset(tmp_path / "c", 4, 512, 0)


def test_a_stopped_training_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    assert train(tmp_path / "whole", BRIEF, TINY) == "converged"

    def stop(report: PretrainingReport) -> None:
        if report.step == 4:
            raise KeyboardInterrupt

    assert train(tmp_path / "parts", BRIEF, TINY, stop) == "interrupted"
    assert train(tmp_path / "parts", BRIEF, TINY) == "converged"
    whole, parts = (load_network(tmp_path / name / NETWORK) for name in ("whole", "parts"))
    for a, b in zip(whole.state_dict().values(), parts.state_dict().values(), strict=True):
        assert torch.equal(a, b)
    with pytest.raises(SettingError, match="other settings"):
        train(tmp_path / "parts", replace(BRIEF, rate=0.1), TINY)
    (tmp_path / "parts" / CHECKPOINT).write_bytes(b"x" * 100)
    with pytest.raises(UnreadableFileError, match="is no checkpoint"):
        train(tmp_path / "parts", BRIEF, TINY)
    assert {path.name for path in (tmp_path / "whole").iterdir()} == {NETWORK, CHECKPOINT, COLLECTION}


def test_it_learns_a_batch_by_heart(few: PretrainingDataset, monkeypatch: pytest.MonkeyPatch) -> None:
    same = few.draw(2, 256, True, np.random.default_rng(0))
    monkeypatch.setattr(PretrainingDataset, "draw", lambda *_: same)
    settings = PretrainingSettings(parts=4, points=512, batch=2, steps=60, rate=0.01, coarse=0.0)
    trainer = Trainer(few, settings, replace(TINY, primitives=64, convexes=8))
    losses = [trainer.advance() for _ in range(settings.steps)]
    assert np.mean(losses[-5:]) < 0.6 * np.mean(losses[:5])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": 0}, "steps: expected 1 or more"),
        ({"batch": 9}, "batch: 9 is more than the 4 parts"),
        ({"rate": float("nan")}, "rate"),
        ({"coarse": 2.0}, "coarse"),
    ],
)
def test_settings_that_cannot_be_used_are_named(changes: dict[str, float], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        replace(BRIEF, **changes)


def test_the_shipped_sizes_fit_in_a_few_megabytes() -> None:
    count = sum(p.numel() for p in CapriNet(SMALL).parameters())
    assert 2 * count < 4e6
