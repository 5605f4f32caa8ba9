"""Workers that only write down what they were given."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import partwright as pw
from partwright.batch.pool import Worker

FAKE = (sys.executable, str(Path(__file__).with_name("fake_worker.py")))


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The log of what fake workers were given."""
    monkeypatch.setattr(Worker, "command", FAKE)
    monkeypatch.setenv("PYTHONPATH", str(Path(pw.__file__).parents[1]))
    monkeypatch.setenv("FAKE_LOG", str(tmp_path / "log"))
    return tmp_path / "log"
