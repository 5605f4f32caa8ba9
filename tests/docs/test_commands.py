"""Commands in the documentation: each can be parsed, and every option that is named is there.

What they do is seen where they are run: the README's in `.ci/run`, the pages' in `make test-heavy`.
"""

from __future__ import annotations

import argparse
import re
import shlex
from pathlib import Path

import pytest

from partwright.cli.main import parser
from partwright.cli.parser import Parser

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`partwright ([^`]+)`")
QUOTED = re.compile(r'"[^"]*"')  # another program's command
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")

WHOLE = [
    (page.name, line)
    for page in PAGES
    for language, text in BLOCK.findall(page.read_text())
    if language == "sh"
    for line in text.splitlines()
    if line.startswith("partwright ")
]


@pytest.mark.parametrize(("page", "line"), WHOLE, ids=[f"{page}-{i}" for i, (page, _) in enumerate(WHOLE)])
def test_a_command_can_be_parsed(page: str, line: str) -> None:
    words = shlex.split(line, comments=True)[1:]
    assert parser().parse_args(words).run
    for word in words:
        assert not word.startswith("examples/") or (ROOT / word).exists()


def named(page: Path) -> list[str]:
    """What the page says of commands beside those: outlines of their usage, and words within sentences."""
    text = page.read_text()
    outlines = [found for _, block in BLOCK.findall(text) for found in block.split("partwright ")[1:]]
    return [*outlines, *INLINE.findall(BLOCK.sub("", text))]


def command(words: list[str]) -> Parser:
    """The command that the words begin with."""
    found = parser()
    for word in words:
        below = [a.choices for a in found._actions if isinstance(a, argparse._SubParsersAction)]
        name = word if below and word in below[0] else found.implied
        if name is None:
            break
        found = below[0][name]
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_an_option_that_is_named_is_one_of_its_command(page: Path) -> None:
    for text in named(page):
        options = command(text.split())._option_string_actions
        for option in OPTION.findall(QUOTED.sub("", text)):
            assert option in options, f"partwright {text}"
