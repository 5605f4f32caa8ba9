"""Files all or none, on every kind of folder, and without a trace of those who were killed."""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from partwright.atomic_io import (
    check_files,
    check_folder,
    check_unread,
    finishing,
    replacing,
    replacing_files,
    write_bytes,
)
from partwright.errors import OutputError

STALE = re.compile(r"curve_\d+\.json")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def save(folder: Path, files: dict[str, str]) -> None:
    with replacing_files(folder, STALE) as staging:
        for name, text in files.items():
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_text(text)


def test_files_in_folders_move_into_folders_of_the_same_names(tmp_path: Path) -> None:
    """Those that were there stay; a failure leaves no folder behind."""
    (tmp_path / "out" / "meshes").mkdir(parents=True)
    (tmp_path / "out" / "meshes" / "other").write_text("stays")
    with replacing_files(tmp_path / "out") as staging:
        (staging / "meshes" / "deep").mkdir(parents=True)
        (staging / "meshes" / "deep" / "a").write_text("new")
    assert (tmp_path / "out" / "meshes" / "deep" / "a").read_text() == "new"
    assert (tmp_path / "out" / "meshes" / "other").read_text() == "stays"
    (tmp_path / "out" / "way").mkdir()
    with pytest.raises(OutputError, match="in the way"):
        save(tmp_path / "out", {"fresh/a": "new", "way": "a folder has this name"})
    assert names(tmp_path / "out") == ["meshes", "way"]


def test_files_are_staged_inside_their_folder_which_may_be_a_mount_point(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    with replacing_files(folder) as staging:
        assert folder in staging.parents
        (staging / "a").write_text("a")
    with replacing(folder / "b.png") as temporary:
        assert (temporary.parent, temporary.suffix) == (folder, ".png")
        temporary.write_text("b")
    assert names(folder) == ["a", "b.png"]


def test_folders_that_were_made_go_again_where_the_work_fails(tmp_path: Path) -> None:
    check_folder(tmp_path / "deep" / "out", ["a"])
    with suppress(ZeroDivisionError), replacing_files(tmp_path / "deep" / "out") as staging:
        (staging / "a").write_text("a")
        raise ZeroDivisionError
    assert names(tmp_path) == []


def test_a_later_result_removes_what_it_does_not_have(tmp_path: Path) -> None:
    save(tmp_path, {"assembly.json": "1", "curve_04.json": "1", "curve_08.json": "1"})
    (tmp_path / "curve_notes.json").write_text("mine")
    save(tmp_path, {"assembly.json": "2", "curve_04.json": "2"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "assembly.json": "2",
        "curve_04.json": "2",
        "curve_notes.json": "mine",
    }


@pytest.mark.parametrize("links", [True, False])
def test_a_move_that_fails_midway_leaves_all_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    before = {"a": "old", "c": "old", "curve_01.json": "old"}
    save(tmp_path, before)
    really = os.replace

    def fails(source: Path, target: Path) -> None:
        if Path(source).parent.name == "new" and Path(target).name == "c":
            raise OSError(errno.EIO, "a broken disk")
        really(source, target)

    def no_links(*_: object, **__: object) -> None:
        raise OSError(errno.EPERM, "no links here")

    monkeypatch.setattr(os, "replace", fails)
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    with pytest.raises(OutputError, match="a broken disk"):
        save(tmp_path, {"a": "new", "b": "new", "c": "new"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before


def test_a_folder_in_the_way_of_a_file_is_found_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "surface.ply").mkdir()
    with pytest.raises(OutputError, match=r"surface\.ply: a folder of that name is in the way"):
        check_folder(tmp_path, ["assembly.json", "surface.ply"])
    with pytest.raises(OutputError, match="in the way"):
        save(tmp_path, {"assembly.json": "new", "surface.ply": "new"})
    with pytest.raises(OutputError, match="in the way"):
        check_files([tmp_path / "surface.ply"])
    assert names(tmp_path) == ["surface.ply"]


def test_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="something that is no file"):
        write_bytes(tmp_path / "pipe", b"")


@pytest.mark.parametrize("refused", [OSError(errno.EROFS, "read-only"), PermissionError(13, "no")])
def test_a_folder_that_cannot_be_written_is_found_by_trying(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: OSError
) -> None:
    def mkdir(*_: object, **__: object) -> None:
        raise refused

    monkeypatch.setattr(os, "mkdir", mkdir)
    for check in (lambda: check_folder(tmp_path), lambda: check_files([tmp_path / "a.json"])):
        with pytest.raises(OutputError, match=str(refused.strerror)):
            check()


def test_what_a_killed_process_left_is_cleared_and_nothing_else(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\nfrom partwright.atomic_io import replacing, replacing_files\n"
        "with replacing_files(sys.argv[1]) as staging, replacing(sys.argv[1] + '/a.glb') as file:\n"
        "    (staging / 'half').write_text('half'); file.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path)])
    assert killed.returncode == -signal.SIGKILL
    left = names(tmp_path)
    assert len(left) == 2
    elsewhere = re.sub(r"-[0-9a-f]{8}-", "-01234567-", left[0])
    others = [elsewhere, ".notes.123.part", ".partwright-notes.part"]
    for name in others:
        (tmp_path / name).touch()
    with replacing(tmp_path / "b") as ours:
        ours.touch()
        check_folder(tmp_path)
        assert names(tmp_path) == sorted([*others, ours.name])


@pytest.mark.parametrize("name", ["line\nbreak", "not utf-8 \udcff", "x" * 250 + ".glb", "\x1b[31mred"])
def test_names_of_every_kind(tmp_path: Path, name: str) -> None:
    write_bytes(tmp_path / name, b"1")
    save(tmp_path / "folder" / name, {name: "1"})
    assert (tmp_path / name).exists()


def test_a_name_that_no_file_can_have_is_found_before_the_work(tmp_path: Path) -> None:
    for check in (
        lambda: check_files([tmp_path / ("x" * 256)]),
        lambda: check_folder(tmp_path / ("x" * 256)),
    ):
        with pytest.raises(OutputError, match="too long"):
            check()


def test_outputs_are_not_inputs_by_any_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "truck.glb").touch()
    (tmp_path / "other.glb").touch()
    (tmp_path / "link.glb").symlink_to("truck.glb")
    os.link(tmp_path / "truck.glb", tmp_path / "hard.glb")
    (tmp_path / "folder").symlink_to(tmp_path)
    monkeypatch.chdir(tmp_path)
    read = [tmp_path / "missing.json", tmp_path / "truck.glb"]
    roundabout = f"./folder/../{tmp_path.name}/truck.glb"
    for output in ("truck.glb", roundabout, "link.glb", "hard.glb", "folder/truck.glb"):
        with pytest.raises(OutputError, match=r"would replace .*truck\.glb, which is read.*--overwrite"):
            check_unread(["new.glb", output], read)
    check_unread(["new.glb", "other.glb"], read)


def test_an_interruption_does_not_undo_what_is_being_finished() -> None:
    done = []
    with finishing():
        os.kill(os.getpid(), signal.SIGINT)
        done.append("written")
    assert done == ["written"]


def test_afterwards_ctrl_c_works_again() -> None:
    with finishing():
        pass
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_who_handles_ctrl_c_otherwise_goes_on_to(monkeypatch: pytest.MonkeyPatch) -> None:
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append(True))
    try:
        with finishing():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [True]


def test_other_threads_may_finish_too() -> None:
    reached: list[bool] = []

    def work() -> None:
        with finishing():
            reached.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert reached == [True]
