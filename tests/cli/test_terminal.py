"""Names from files reach the terminal as text, whatever they hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from partwright.cli.main import main
from partwright.cli.terminal import printable
from tests.cli.conftest import BoxMethod

EVIL = "a\x1b[2J\x07\x9b31m\u202e\nb\udcff"


def test_what_a_terminal_would_obey_is_escaped() -> None:
    text = printable(EVIL)
    assert text.isprintable()
    assert text == r"a\x1b[2J\x07\x9b31m\u202e\nb\udcff"
    assert printable("Öse × 3 ½") == "Öse × 3 ½"


def test_a_fit_of_such_a_name_is_written_and_told(
    method: BoxMethod, block: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(block.parent)
    name = EVIL.removesuffix("\udcff")
    evil = block.rename(block.parent / f"{name}.stl")
    assert main(["fit", evil.name]) == 0
    written = block.parent / f"{name}-parts"
    assert (written / "preview.png").exists()
    assert main(["evaluate", str(written / "assembly.json"), evil.name]) == 0
    assert main(["fit", f"{EVIL}.stl", "-o", evil.name]) == 2
    assert main(["describe", f"{EVIL}.json"]) == 2
    out, err = capsys.readouterr()
    for line in (out + err).split("\n"):
        assert line.isprintable() or not line, line


def test_the_longest_name_still_gets_a_folder(
    method: BoxMethod, block: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(block.parent)
    long = block.rename(block.parent / ("ü" * 125 + ".stl"))
    assert main(["fit", long.name]) == 0
    (folder,) = block.parent.glob("*-parts")
    assert (folder / "report.json").exists()


def test_a_wrong_option_of_such_a_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["describe", "a.json", EVIL])
    assert "\x1b" not in capsys.readouterr().err


def test_an_error_has_a_length_that_can_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.json").write_text('{"format": "' + "x" * 1_000_000 + '"}')
    assert main(["describe", str(tmp_path / "a.json")]) == 2
    assert len(capsys.readouterr().err) < 3000
