"""Batches by a Ray cluster: the same path, the same bytes. A stand-in for Ray runs threads."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from partwright.batch import Limits, Plan, fit_folder, on_ray
from partwright.batch.manifest import latest
from partwright.cli.main import main
from partwright.methods import Cancellation


class RayError(Exception):
    pass


class StandIn:
    """As much of Ray as a batch uses: one core, tasks in a thread. A file "lost..." loses its node."""

    exceptions = SimpleNamespace(RayError=RayError)

    def __init__(self) -> None:
        self.threads, self.lost, self.addresses = ThreadPoolExecutor(1), 0, list[str]()

    def init(self, address: str, **_: Any) -> None:
        if address == "nowhere:1":
            raise ConnectionError("refused")
        self.addresses.append(address)

    def remote(self, num_cpus: int, max_retries: int) -> Any:
        def task(function: Any) -> Any:
            return SimpleNamespace(remote=lambda *given: self.threads.submit(self._run, function, *given))

        return task

    def _run(self, function: Any, job: dict[str, Any], limits: Limits) -> Any:
        times = 1 if "lost-once" in job["path"] else 9 if "lost-often" in job["path"] else 0
        if self.lost < times:
            self.lost += 1
            raise RayError("the node died")
        return function(job, limits)

    def wait(self, tasks: list[Future[Any]], timeout: float) -> tuple[list[Any], list[Any]]:
        done, rest = wait(tasks, timeout)
        return list(done), list(rest)

    def get(self, task: Future[Any]) -> Any:
        return task.result()

    def cancel(self, task: Future[Any], force: bool) -> None:
        on_ray._here._cancel.request()  # type: ignore[union-attr]  as the death of the task's process does

    def cluster_resources(self) -> dict[str, float]:
        return {"CPU": 1.0}

    def shutdown(self) -> None:
        self.threads.shutdown()


@pytest.fixture
def ray(fake: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    stand_in = StandIn()
    monkeypatch.setitem(sys.modules, "ray", stand_in)
    monkeypatch.setattr(on_ray, "_here", None)
    yield stand_in
    if on_ray._here is not None:
        on_ray._here.close()


def shapes(folder: Path, *names: str) -> Path:
    folder.mkdir()
    for name in names:
        (folder / f"{name}.stl").write_text(name)
    return folder


def test_a_cluster_does_what_this_machine_does(ray: StandIn, tmp_path: Path) -> None:
    source = shapes(tmp_path / "in", "a", "b", "broken", "segfault", "lost-once")
    assert fit_folder(Plan(source), tmp_path / "here", at_once=1)
    assert fit_folder(Plan(source), tmp_path / "there", ray="auto")
    assert ray.addresses == ["auto"]
    assert ray.lost == 1  # and the item was given out again
    here, there = (
        {entry.file: (entry.status, entry.reason, entry.result) for entry in latest(tmp_path / out).values()}
        for out in ("here", "there")
    )
    assert here == there
    files = [
        {path.relative_to(out): path.read_bytes() for path in out.glob("items/*/*/*")}
        for out in (tmp_path / "here", tmp_path / "there")
    ]
    assert len(files[0]) == 6
    assert files[0] == files[1]


def test_an_item_that_loses_every_node_fails_alone(ray: StandIn, tmp_path: Path) -> None:
    source = shapes(tmp_path / "in", "a", "lost-often", "z")
    assert fit_folder(Plan(source), tmp_path / "out", ray="auto")
    found = {entry.file: entry for entry in latest(tmp_path / "out").values()}
    assert found["lost-often.stl"].status == "crashed"
    assert found["lost-often.stl"].reason == "its node was lost 3 times: the node died"
    assert found["a.stl"].status == found["z.stl"].status == "done"


def test_a_cancellation_reaches_the_cluster(ray: StandIn, tmp_path: Path) -> None:
    source = shapes(tmp_path / "in", "a", "hang")
    cancel = Cancellation()
    assert not fit_folder(
        Plan(source), tmp_path / "out", ray="auto", cancel=cancel, told=lambda entry, found: cancel.request()
    )
    assert len(latest(tmp_path / "out")) == 1


def test_no_cluster_and_no_ray_are_one_line(
    ray: StandIn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = shapes(tmp_path / "in", "a"), tmp_path / "out"
    assert main(["batch", str(source), "-o", str(out), "--ray", "nowhere:1"]) == 2
    assert "--ray nowhere:1: no cluster answers there (refused)" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["batch", str(source), "-o", str(out), "--ray", "auto"]) == 2
    assert 'pip install "partwright[ray]"' in capsys.readouterr().err
    assert not out.exists()
