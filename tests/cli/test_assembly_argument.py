"""Where an assembly is asked for, the folder that a fit wrote will do."""

from __future__ import annotations

from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part, load_assembly
from partwright.cli.main import main
from partwright.fields import Box


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "fit").mkdir()
    Assembly((Part(Box((1.0, 2.0, 3.0)), name="block"),)).save(tmp_path / "fit" / "assembly.json")
    return tmp_path / "fit"


def test_a_fits_folder_is_described(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", str(folder)]) == 0
    said = capsys.readouterr().out
    assert main(["describe", str(folder / "assembly.json")]) == 0
    assert "block: box size (1, 2, 3)" in said
    assert capsys.readouterr().out == said


def test_a_fits_folder_is_edited(folder: Path, tmp_path: Path) -> None:
    assert main(["edit", str(folder), "--set", "block.size.x=4", "-o", str(tmp_path / "wide.json")]) == 0
    assert load_assembly(tmp_path / "wide.json").parts[0].field == Box((4.0, 2.0, 3.0))


def test_another_folder_is_still_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", str(tmp_path)]) == 2
    assert "is a folder; name a file in it" in capsys.readouterr().err
