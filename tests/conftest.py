"""What all tests share."""

from __future__ import annotations

import gc
import importlib
import signal
from collections.abc import Generator
from functools import partial

import pytest
from hypothesis import settings

# Here, not where it is used: Playwright runs once a process, so a process has one fixture of it.
from tests.browsers import browser

__all__ = ["browser"]

# A busy machine is no defect: how long an example takes is measured by benchmarks, not by tests.
# The same examples each time, so that a change is judged by what it changes; others, and twice
# as many, are drawn by `--hypothesis-profile=search`.
settings.register_profile("patient", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("search", deadline=None)
settings.load_profile("patient")

# A shell starts background jobs with Ctrl-C ignored, and Python then leaves it so.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The studio's tests first: they take longest and wait much, and files are begun in this order.

    Short files last, so that no process waits long for another.
    """
    place = {"studio": 0, "fields": 2}
    items.sort(key=lambda item: place.get(item.path.parent.name, 1))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What all files import stays: the collector of cycles would go through all of it again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)  # results are arrays, without cycles
        gc.enable()


@pytest.fixture
def coarse_scores(monkeypatch: pytest.MonkeyPatch) -> None:
    """IoU and overlap of an eighth of the cells, and as much less of the points: networks take seconds for
    all of them, and what a fit writes beside its assembly is as well told by few."""
    monkeypatch.setattr(importlib.import_module("partwright.metrics.iou"), "RESOLUTION", 64)
    overlap = importlib.import_module("partwright.metrics.overlap")
    monkeypatch.setattr(overlap, "overlap", partial(overlap.overlap, resolution=64))
    for name in ("bi_surface", "chamfer", "comparison"):
        monkeypatch.setattr(importlib.import_module(f"partwright.metrics.{name}"), "COUNT", 4_000)


@pytest.fixture(scope="module", autouse=True)
def small_previews() -> Generator[None]:
    """Of the picture that every result is saved with a sixth; who tells of it has another such fixture."""
    preview = importlib.import_module("partwright.render.preview")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preview, "_SIDE", 160)  # pixels, of 400
        patch.setattr(preview, "_LEAST_SIDE", 124)
        yield
