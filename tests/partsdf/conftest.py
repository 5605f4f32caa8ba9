"""A tiny family, and a model trained on it in seconds."""

from __future__ import annotations

import pytest
import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf import pictures, validation
from partwright.partsdf.model import Model
from partwright.partsdf.training import train
from tests.partsdf.lamps import small_config, write_lamps


@pytest.fixture(scope="session")
def lamps(tmp_path_factory: pytest.TempPathFactory) -> PreparedFamily:
    return write_lamps(tmp_path_factory.mktemp("families") / "lamps")


@pytest.fixture(scope="session")
def model(lamps: PreparedFamily, tmp_path_factory: pytest.TempPathFactory) -> Model:
    """Trained for a few seconds: good enough to be meshed, edited and reconstructed with."""
    torch.set_num_threads(1)
    config = small_config(lamps, epochs=100, batch=8, points=512, rate=5e-3, latent_rate=5e-3)
    return train(config, tmp_path_factory.mktemp("trained")).model


@pytest.fixture(autouse=True)
def coarse(coarse_scores: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was trained for seconds has walls as thin as can be, everywhere: pictures as fine as these take up
    to a minute. How fine they are otherwise is tried in test_meshing.py."""
    monkeypatch.setattr(pictures, "picture_resolution", lambda *_, **__: 64)
    monkeypatch.setattr(validation, "ITERATIONS", 15)
