"""Files that are begun while scores are taken are the same as those of a result that is saved later."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
import trimesh

import partwright as pw
from partwright.errors import NothingToExportError
from partwright.fitting import ahead
from tests.cli.conftest import BoxMethod

BOX = trimesh.creation.box((3, 2, 1))


def files(result: pw.fitting.Result, folder: Path) -> dict[str, bytes]:
    result.save(folder)
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "report.json"}


@pytest.fixture
def result(method: BoxMethod, coarse_scores: None, monkeypatch: pytest.MonkeyPatch) -> pw.fitting.Result:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    return pw.fit(pw.load_shape(BOX), saving=True)


def test_files_made_ahead_are_those_made_later(
    result: pw.fitting.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = files(result, tmp_path / "begun")
    later = files(dataclasses.replace(result, ahead=None), tmp_path / "later")
    assert begun == later
    assert set(begun) == {*pw.fitting.FILES} - {"report.json"}
    monkeypatch.setattr(ahead, "_parts", None)  # what was begun is used
    assert files(result, tmp_path / "again") == begun


def test_nothing_is_begun_where_one_thread_or_no_file_is_wanted(
    method: BoxMethod, coarse_scores: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    shape = pw.load_shape(BOX)
    assert pw.fit(shape).ahead is None
    assert pw.fit(shape, saving=True, threads=1).ahead is None
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    assert pw.fit(shape, saving=True).ahead is None


def test_another_assembly_is_written_as_it_is(result: pw.fitting.Result, tmp_path: Path) -> None:
    moved = result.assembly.transformed(pw.assembly.Similarity(translation=(1.0, 0.0, 0.0)))
    other = dataclasses.replace(result, assembly=moved)
    assert files(other, tmp_path / "other")["parts.glb"] != files(result, tmp_path / "own")["parts.glb"]


def test_what_fails_ahead_is_told_where_it_is_written_and_nothing_is(
    method: BoxMethod, coarse_scores: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(assembly: pw.Assembly) -> bytes:
        raise NothingToExportError("no part has a volume")

    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(ahead, "_parts", fails)
    result = pw.fit(pw.load_shape(BOX), saving=True)
    with pytest.raises(NothingToExportError, match="volume"):
        result.save(tmp_path / "out")
    assert not (tmp_path / "out").exists()
