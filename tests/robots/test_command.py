"""`partwright collide`, from the command line."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest

from partwright.cli.main import main
from tests.robots.robots import urdf


def test_a_table_a_summary_and_the_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = urdf(tmp_path / "in")
    words = ["--enclose", "--tolerance", "60mm", "--kinds", "box,cylinder"]
    assert main(["collide", str(path), "-o", str(tmp_path / "out"), *words]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 links contained" in said
    assert "colliding pairs at rest: 1 before" in said
    assert {p.name for p in (tmp_path / "out").iterdir()} >= {
        "pair.urdf",
        "pair.urdf.png",
        "pair.urdf.report.json",
    }


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--tolerance", "wide"], "expected a length"),
        (["--max-parts", "0"], "at least 1"),
        (["--kinds", "torus"], "has no 'torus'"),
        (["--enclose", "--inside"], "contradict"),
    ],
)
def test_mistakes_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    path = urdf(tmp_path / "in")
    with pytest.raises(SystemExit) if "wide" in words else nullcontext():
        assert main(["collide", str(path), "-o", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_robot_itself_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = urdf(tmp_path / "in")
    before = path.read_bytes()
    assert main(["collide", str(path), "-o", str(tmp_path / "in")]) == 2
    assert "would replace" in capsys.readouterr().err
    assert path.read_bytes() == before
