"""Names from files reach the terminal as text, whatever they hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from partwright.cli.main import main
from partwright.cli.terminal import printable

EVIL = "a\x1b[2J\x07\x9b31m\u202e\nb\udcff"


def test_what_a_terminal_would_obey_is_escaped() -> None:
    text = printable(EVIL)
    assert text.isprintable()
    assert text == r"a\x1b[2J\x07\x9b31m\u202e\nb\udcff"
    assert printable("Öse × 3 ½") == "Öse × 3 ½"


def test_a_wrong_option_of_such_a_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["describe", "a.json", EVIL])
    assert "\x1b" not in capsys.readouterr().err


def test_an_error_has_a_length_that_can_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.json").write_text('{"format": "' + "x" * 1_000_000 + '"}')
    assert main(["describe", str(tmp_path / "a.json")]) == 2
    assert len(capsys.readouterr().err) < 3000
