"""Mistakes in what was typed: told with the usage of the command that was meant, and a guess."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from partwright.cli.main import main, parser
from partwright.cli.parser import Parser


@pytest.mark.parametrize(
    ("words", "usage", "says"),
    [
        ("fit a.stl --qualty high", "usage: partwright fit ", "did you mean --quality?"),
        ("fit a.stl --max-part=3 --zzz", "usage: partwright fit ", "--zzz"),
        (
            "parts edit mixers:0 -o a.json --mve a=1,2,3",
            "usage: partwright parts edit ",
            "did you mean --move?",
        ),
        ("segmnt a.glb b.json", "usage: partwright [-h]", "did you mean segment?"),
        ("fit a.stl --quality hihg", "usage: partwright fit ", "did you mean high?"),
        ("describe a.json b.json", "usage: partwright describe ", "unrecognized arguments: b.json"),
    ],
)
def test_a_mistake(words: str, usage: str, says: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words.split())
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.startswith(usage)
    assert says in error


def test_an_option_with_an_optional_value_keeps_off_what_is_none() -> None:
    made = Parser()
    made.add_argument("shape")
    made.add_argument("--contain", nargs="?", const="0", type=float)
    for words, contain in (
        ("--contain mug.stl", 0.0),
        ("--contain 0.5 mug.stl", 0.5),
        ("mug.stl --contain", 0.0),
        ("mug.stl --contain=2", 2.0),
        ("mug.stl", None),
    ):
        given = made.parse_args(words.split())
        assert (given.shape, given.contain) == ("mug.stl", contain)


def test_the_cad_measures_keep_off_the_assembly() -> None:
    given = parser().parse_args(["evaluate", "--cad", "a.json", "b.stl"])
    assert (given.cad, given.assembly, given.shape) == (30_000, Path("a.json"), Path("b.stl"))


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    assert "partwright" in capsys.readouterr().out


def test_a_bound_without_a_length_leaves_the_shape_alone() -> None:
    given = parser().parse_args(["fit", "--contain", "mug.stl", "--inside", "2mm"])
    assert (given.shape, given.contain, given.inside) == (Path("mug.stl"), "0", "2mm")
    assert parser().parse_args(["fit", "--inside", "1.stl"]).shape == Path("1.stl")


@pytest.mark.parametrize("value", ["mug.stl", "-1", "1.stl", "5parsecs", "nan", ""])
def test_a_tolerance_that_is_no_length(value: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fit", "a.stl", "--tolerance", value])
    assert "argument --tolerance: expected a length such as 0.5, 0.5mm or 1%" in capsys.readouterr().err


def test_the_many_options_of_fit_stand_under_headings(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fit", "--help"])
    lines = capsys.readouterr().out.splitlines()
    for heading in ("input", "method and budget", "bounds", "start", "output", "running"):
        assert f"{heading}:" in lines
    assert lines[lines.index("options:") + 1].lstrip().startswith("-h")
    assert not lines[lines.index("options:") + 2]


def test_every_command_has_a_module_that_runs_it() -> None:
    for command in leaves(parser()):
        module = import_module(f"partwright.cli.commands.{command.get_default('run')}")
        assert callable(module.run), command.prog


def leaves(parent: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    below = [action for action in parent._actions if isinstance(action, argparse._SubParsersAction)]
    if not below:
        yield parent
    for action in below:
        for child in action.choices.values():
            yield from leaves(child)
