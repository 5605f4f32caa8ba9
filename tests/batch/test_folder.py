"""A folder of shapes: what is finished stays, what was in flight is done again, trouble takes one item."""

from __future__ import annotations

import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
import trimesh

import partwright as pw
from partwright.batch import Limits, Plan, Share, fit_folder, write_index
from partwright.batch.directory import item_folder
from partwright.batch.items import content_name, items_of
from partwright.batch.manifest import Entry, appending, entries, latest
from partwright.cli.main import main
from partwright.errors import OutputError, SettingError
from partwright.methods import Cancellation
from tests.batch.conftest import FAKE


def shapes(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / f"{name}.stl").write_text(name)
    return folder


def test_real_shapes_become_what_a_fit_makes_of_them(tmp_path: Path) -> None:
    source = tmp_path / "in"
    (source / "deeper").mkdir(parents=True)
    trimesh.creation.box((1, 2, 3)).export(source / "deeper" / "block.stl")
    trimesh.creation.box((1, 2, 3)).export(source / "twin.stl")
    (source / "cut.stl").write_bytes((source / "twin.stl").read_bytes()[:300])
    (source / "notes.txt").write_text("no shape")
    out = source / "out"  # is no shape of the folder, though it lies in it
    assert main(["batch", str(source), "-o", str(out), "--quality", "draft", "--at-once", "1"]) == 0
    assert main(["batch", str(source), "-o", str(out), "--quality", "draft"]) == 0
    found = list(entries(out / "manifest.jsonl"))
    assert [(e.file, e.status) for e in found] == [("cut.stl", "failed"), ("twin.stl", "done")]
    assert found[0].reason.startswith("UnreadableFileError")
    done = found[1]
    assert done.peak_memory > 5e7
    assert done.result["scores"]["iou"] > 0.99
    made = item_folder(out, content_name(source / "twin.stl"))
    single = pw.fit(pw.load_shape(source / "twin.stl"), quality="draft", threads=1)
    assert pw.load_assembly(made / "assembly.json") == single.assembly
    assert {p.name for p in made.iterdir()} == {
        "assembly.json", "parts.glb", "surface.ply", "report.json", "preview.png",
    }  # fmt: skip
    rows = list(csv.DictReader((out / "index.csv").open()))
    assert [row["status"] for row in rows] == ["failed", "done"]
    page = (out / "index.html").read_text()
    assert page.count("<figure>") == 1
    assert "cut.stl" in page


def test_trouble_takes_one_item_and_says_its_reason(tmp_path: Path, fake: Path) -> None:
    source = shapes(tmp_path / "in", "a", "big", "broken", "hang", "segfault", "z")
    plan = Plan(source)
    assert fit_folder(plan, tmp_path / "out", at_once=2, limits=Limits(3.0, 150_000_000))
    found = {Path(e.file).stem: e for e in latest(tmp_path / "out").values()}
    assert {name: e.status for name, e in found.items()} == {
        "a": "done", "z": "done", "big": "memory", "broken": "failed", "hang": "time", "segfault": "crashed",
    }  # fmt: skip
    assert found["segfault"].reason == "the worker died by signal 11: about to fall"
    assert found["big"].peak_memory > 150_000_000
    assert 3.0 <= found["hang"].seconds < 15.0
    before = Counter(fake.read_text().split())
    assert fit_folder(plan, tmp_path / "out", at_once=2)  # what failed stays, unless asked for
    assert Counter(fake.read_text().split()) == before
    shapes(source, "late")
    again = Share(again=True, only_failed=True)
    assert fit_folder(plan, tmp_path / "out", again, at_once=4, limits=Limits(3.0, 150_000_000))
    assert Counter(fake.read_text().split()) - before == {
        "big.stl": 1, "broken.stl": 1, "hang.stl": 1, "segfault.stl": 2,
    }  # fmt: skip
    write_index(tmp_path / "out")
    assert (tmp_path / "out" / "index.html").read_text().count("<tr>") == 4


_DRIVER = """
import sys
from pathlib import Path
from partwright.batch import Plan, fit_folder
from partwright.batch.pool import Worker
Worker.command = tuple(sys.argv[3:])
fit_folder(Plan(Path(sys.argv[1])), Path(sys.argv[2]), at_once=3)
"""


@pytest.mark.skipif(os.name != "posix", reason="kills by signal")
def test_killed_at_any_moment_nothing_is_lost_and_nothing_is_done_twice(
    tmp_path: Path, fake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAKE_SECONDS", "0.05")
    names = [f"s{i:02d}" for i in range(40)]
    source, out = shapes(tmp_path / "in", *names), tmp_path / "out"
    generator = random.Random(3)
    command = [sys.executable, "-c", _DRIVER, str(source), str(out), *FAKE]
    for _ in range(5):
        process = subprocess.Popen(command)
        time.sleep(generator.uniform(0.6, 1.4))
        process.send_signal(signal.SIGKILL)
        process.wait()
        for entry in entries(out / "manifest.jsonl"):
            assert (item_folder(out, entry.item) / "report.json").is_file()
    assert subprocess.run(command, check=True).returncode == 0
    found = list(entries(out / "manifest.jsonl"))
    assert Counter(e.file for e in found) == {f"{name}.stl": 1 for name in names}
    assert all(e.status == "done" for e in found)
    for name in names:
        made = item_folder(out, content_name(source / f"{name}.stl"))
        assert (made / "assembly.json").read_text() == name
    assert not list(out.glob(".staging*"))
    # At most what was in flight at a kill, three at a time, was done again.
    assert len(fake.read_text().split()) <= len(names) + 5 * 3


def test_a_worker_ends_with_the_process_that_asked_for_it(tmp_path: Path, fake: Path) -> None:
    source = shapes(tmp_path / "in", "hang")
    command = [sys.executable, "-c", _DRIVER, str(source), str(tmp_path / "out"), *FAKE]
    process = subprocess.Popen(command)
    while not fake.exists():
        time.sleep(0.05)
    psutil = pytest.importorskip("psutil")
    (worker,) = psutil.Process(process.pid).children()
    process.kill()
    process.wait()
    worker.wait(timeout=5)


def test_a_worker_that_was_killed_costs_nothing(tmp_path: Path, fake: Path) -> None:
    source = shapes(tmp_path / "in", "once", "z")
    assert fit_folder(Plan(source), tmp_path / "out", at_once=1)
    assert all(entry.status == "done" for entry in latest(tmp_path / "out").values())
    assert Counter(fake.read_text().split()) == {"once.stl": 2, "z.stl": 1}


def test_a_cancellation_ends_the_workers_and_the_same_call_goes_on(tmp_path: Path, fake: Path) -> None:
    source = shapes(tmp_path / "in", *"abcdef")
    cancel = Cancellation()
    ended: list[str] = []

    def told(entry: Entry, found: int) -> None:
        ended.append(entry.file)
        cancel.request()

    assert not fit_folder(Plan(source), tmp_path / "out", at_once=1, told=told, cancel=cancel)
    assert 1 <= len(ended) < 6
    assert fit_folder(Plan(source), tmp_path / "out", at_once=1)
    assert Counter(e.file for e in entries(tmp_path / "out" / "manifest.jsonl")) == {
        f"{name}.stl": 1 for name in "abcdef"
    }


def test_shards_are_a_partition_and_limits_are_kept(tmp_path: Path, fake: Path) -> None:
    names = [f"s{i}" for i in range(12)]
    source, out = shapes(tmp_path / "in", *names), tmp_path / "out"
    assert fit_folder(Plan(source), out, Share(limit=2), at_once=2)
    assert len(latest(out)) == 2
    for index in (1, 2, 3):
        assert fit_folder(Plan(source), out, Share(index, 3), at_once=2)
    assert sorted(fake.read_text().split()) == sorted(f"{name}.stl" for name in names)
    assert {p.name for p in out.glob("manifest*")} == {
        "manifest.jsonl", "manifest-1-of-3.jsonl", "manifest-2-of-3.jsonl", "manifest-3-of-3.jsonl",
    }  # fmt: skip


def test_a_manifest_survives_a_torn_line(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    with appending(path) as manifest:
        manifest.append(Entry("1", "a.stl", "done"))
    with path.open("ab") as file:
        file.write(b'{"item":"2","file":"b.s')
    with appending(path) as manifest:
        manifest.append(Entry("3", "c.stl", "failed", "why"))
    assert [(e.item, e.status) for e in entries(path)] == [("1", "done"), ("3", "failed")]


def test_two_batches_do_not_write_at_once(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    with (
        appending(tmp_path / "m"),
        pytest.raises(OutputError, match="another batch"),
        appending(tmp_path / "m"),
    ):
        pass


def test_a_folder_holds_one_batch(tmp_path: Path, fake: Path) -> None:
    source = shapes(tmp_path / "in", "a")
    fit_folder(Plan(source), tmp_path / "out")
    with pytest.raises(SettingError, match="begun with method superfrusta"):
        fit_folder(Plan(source, "solids"), tmp_path / "out")


def test_a_name_is_of_all_that_a_gltf_needs(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_text(json.dumps({"buffers": [{"uri": "a.bin"}]}))
    (tmp_path / "a.bin").write_bytes(b"1")
    before = content_name(tmp_path / "a.gltf")
    (tmp_path / "a.bin").write_bytes(b"2")
    assert content_name(tmp_path / "a.gltf") != before


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_cannot_be_opened_fails_alone(tmp_path: Path) -> None:
    source = shapes(tmp_path / "in", "a")
    (source / "a.stl").chmod(0)
    (item,) = items_of(source)
    assert "cannot be opened" in item.trouble


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nowhere", "-o", "out"], "expected a folder with shapes"),
        (["in", "-o", "in"], "the folder with the shapes"),
        (["in", "-o", "out", "--shard", "4/3"], "--shard 4/3"),
        (["in", "-o", "out", "--shard", "x"], "expected I/N"),
        (["in", "-o", "out", "--limit", "0"], "--limit 0"),
        (["in", "-o", "out", "--time-limit", "-1"], "--time-limit -1"),
        (["in", "-o", "out", "--memory-limit", "nan"], "--memory-limit nan"),
        (["in", "-o", "out", "--at-once", "-1"], "--at-once -1"),
        (["in", "-o", "out", "--method", "magic"], "expected one of"),
        (["in", "-o", "in/a.stl/out"], "cannot write into"),
        (["status", "in"], "expected the output folder of a batch"),
        (["retry", "in"], "expected the output folder of a batch"),
    ],
)
def test_bad_input_is_one_line(
    words: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shapes(tmp_path / "in", "a")
    monkeypatch.chdir(tmp_path)
    assert main(["batch", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "Traceback" not in error
    assert not (tmp_path / "out" / "items").exists()
