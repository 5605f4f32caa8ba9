"""Scores of what is edited: none is worked out for nothing, and none twice."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.file_text import to_text
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from partwright.studio import messages, session
from partwright.studio.server import opened

PATIENCE = 60.0  # seconds
STOOL = Assembly((Part(Box((6, 4, 1)), name="seat"), Part(Cylinder(1, 4), (0, 0, -2), name="leg")))


def test_only_the_last_of_many_edits_is_scored_and_a_page_that_joins_gets_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the first assembly is scored three edits are made, each after the pause that scores wait for."""
    begun, free, scored = threading.Event(), threading.Event(), []

    def evaluate(assembly: Assembly, *_: Any, **__: Any) -> Any:
        scored.append(assembly.parts[-1].name)
        begun.set()
        assert free.wait(PATIENCE)
        return SimpleNamespace(iou=0.5, chamfer=0.0, max_deviation=0.0, deviation_95=0.0, overlap=0.0)

    async def scores(told: list[Any]) -> list[messages.Scored]:
        while not (found := [one for one in told if isinstance(one, messages.Scored)]):
            await asyncio.sleep(0.01)
        return found

    async def edited() -> None:
        one: list[Any] = []
        studio.join(one.append)
        assert await asyncio.to_thread(begun.wait, PATIENCE)
        for revision, name in enumerate(("one", "two", "three")):
            text = to_text(STOOL.renamed("leg", name))
            studio.heard(messages.Commit(revision, name, text), one.append)
            await asyncio.sleep(0.1)
        free.set()
        first = await scores(one)
        other: list[Any] = []
        studio.join(other.append)
        assert [told.revision for told in first] == [3]
        assert await scores(other) == first

    monkeypatch.setattr(session, "_QUIET", 0.01)
    monkeypatch.setattr(session, "evaluate", evaluate)
    mesh_assembly(STOOL, 16).export(tmp_path / "stool.stl")
    STOOL.save(tmp_path / "stool.json")
    studio = opened(tmp_path / "stool.json", tmp_path / "stool.stl", tmp_path / "state")
    with ThreadPoolExecutor(1) as apart:  # from Playwright's loop, which other tests leave running here
        apart.submit(asyncio.run, edited()).result()
    assert scored == ["leg", "three"]
