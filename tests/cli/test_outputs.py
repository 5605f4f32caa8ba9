"""No command writes over what it read unless told so, and none works for what it cannot write."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.cli.main import main, parser
from partwright.fields import Box


@pytest.fixture
def assembly(tmp_path: Path) -> Path:
    path = tmp_path / "parts.json"
    Assembly((Part(Box((4.001, 2, 1)), (10, 20, 30), name="block"),)).save(path)
    return path


def commands(parent: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    for action in parent._actions:
        if isinstance(action, argparse._SubParsersAction):
            for child in action.choices.values():
                yield child
                yield from commands(child)


def test_every_command_that_writes_says_what_it_reads() -> None:
    keeps_its_own = {"prepare", "train", "family", "simulate", "run"}  # folders that are gone on with
    for command in commands(parser()):
        options = command._option_string_actions
        if "-o" in options and command.prog.split()[-1] not in keeps_its_own:
            assert "--overwrite" in options, command.prog
            assert command.get_default("reads"), command.prog
            assert command.get_default("writes"), command.prog


@pytest.mark.parametrize(
    "words",
    [
        "clean {assembly} -o {assembly}",
        "clean {assembly} -o {folder}/./parts.json",
        "clean {assembly} -o {folder}/link.json",
        "export {assembly} -o {folder}/hard.json",
        "segment {block} {assembly} -o {block_ply}",
        "fit {folder}/surface.ply -o {folder}",
        "fit {block} --start {folder}/curve_04.json -o {folder}/.",
        "parts reconstruct chairs {folder}/surface.ply -o {folder}",
        "segment {block} {assembly} --within {folder}/out.ply.labels.json -o {folder}/out.ply",
        "parts edit {assembly} -o {assembly}",
        "parts train-generator {assembly} -o {assembly}",
        "parts interpolate mixers:0 {assembly} -o {assembly}",
    ],
)
def test_what_is_read_stays(
    words: str, assembly: Path, block: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "link.json").symlink_to(assembly)
    os.link(assembly, tmp_path / "hard.json")
    block_ply = block.rename(tmp_path / "block.ply")
    (tmp_path / "out.ply.labels.json").write_text("[]")
    (tmp_path / "surface.ply").symlink_to(block_ply)
    os.link(assembly, tmp_path / "curve_04.json")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    named = {"assembly": assembly, "folder": tmp_path, "block": block_ply, "block_ply": block_ply}
    assert main(words.format(**named).split()) == 2
    error = capsys.readouterr().err
    assert "which is read" in error
    assert "--overwrite" in error
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_overwriting_on_request(assembly: Path) -> None:
    assembly.write_text("\n" + assembly.read_text())
    assert main(["export", str(assembly), "-o", str(assembly), "--overwrite"]) == 0
    assert assembly.read_text().startswith("{")


def test_what_is_in_the_way_is_found_before_the_work(
    assembly: Path,
    block: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("worked before it looked")

    monkeypatch.setattr("partwright.cli.commands.segment.load_shape", work)
    (tmp_path / "out.ply.labels.json").mkdir()
    assert main(["segment", str(block), str(assembly), "-o", str(tmp_path / "out.ply")]) == 2
    assert "a folder of that name is in the way" in capsys.readouterr().err
    assert main(["segment", str(block), str(assembly), "-o", str(tmp_path / "no" / "out.ply")]) == 2
    assert "No such file or directory" in capsys.readouterr().err
    assert main(["segment", str(block), str(assembly), "-o", "."]) == 2
    assert "give the name of a file" in capsys.readouterr().err
