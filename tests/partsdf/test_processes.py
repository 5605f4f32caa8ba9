"""Training by several processes is training by one: the same draws, the same gradients."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.logs import read_log
from partwright.partsdf.model import load_model
from partwright.partsdf.training import MODEL, train
from tests.partsdf.lamps import small_config

SCRIPT = """
import json, sys
from pathlib import Path
from partwright.partsdf.training import train
from tests.partsdf.lamps import small_config
from partwright.datasets.prepared import PreparedFamily
family, folder, options = sys.argv[1:]
train(small_config(PreparedFamily(Path(family)), **json.loads(options)), Path(folder))
"""


@pytest.mark.skipif(not torch.distributed.is_available(), reason="PyTorch without processes")
def test_two_processes_learn_what_one_does(lamps: PreparedFamily, tmp_path: Path) -> None:
    """By gloo on the CPU; the last batch of an epoch is one shape, so one process has none of its own."""
    options = {"epochs": 2, "shapes": 23, "batch": 22, "accelerator": "cpu", "threads": 1}
    script = tmp_path / "training.py"
    script.write_text(SCRIPT)
    root = str(Path(__file__).parents[2])
    subprocess.run(
        [sys.executable, script, lamps.folder, tmp_path / "two", json.dumps(options | {"devices": 2})],
        check=True, capture_output=True, timeout=120, env=os.environ | {"PYTHONPATH": root},
    )  # fmt: skip
    one = train(small_config(lamps, **options), tmp_path / "one").model
    two = load_model(tmp_path / "two" / MODEL)
    assert torch.allclose(two.latents, one.latents, atol=1e-5)
    for name, value in one.decoder.state_dict().items():
        assert torch.allclose(two.decoder.state_dict()[name], value, atol=1e-4), name
    first, second = (read_log(tmp_path / folder / "log.csv") for folder in ("one", "two"))
    assert abs(float(first[1]["whole"]) / float(first[0]["whole"]) - 1) > 1e-2  # there is something to tell
    for a, b in zip(first, second, strict=True):
        for name in ("whole", "part", "inter", "latent_norm"):
            assert float(a[name]) == pytest.approx(float(b[name]), rel=1e-4, abs=1e-7)
