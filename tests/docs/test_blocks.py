"""Python in the documentation: it parses, and every name of the package that it uses is there.

What it does is seen where it is run: the README's blocks and the pages' commands by `.ci/readme_commands`,
whole packages by test_extending.py.
"""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = [(page.name, i, text) for page in PAGES for i, text in enumerate(BLOCK.findall(page.read_text()))]


def named(node: ast.expr) -> list[str]:
    """["pw", "export"] of `pw.export`; empty of anything else."""
    if isinstance(node, ast.Name):
        return [node.id]
    if isinstance(node, ast.Attribute) and (before := named(node.value)):
        return [*before, node.attr]
    return []


@pytest.mark.parametrize(("page", "number", "text"), BLOCKS, ids=[f"{page}-{i}" for page, i, _ in BLOCKS])
def test_a_block_uses_what_there_is(page: str, number: int, text: str) -> None:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "partwright":
            module = import_module(str(node.module))
            for alias in node.names:
                assert hasattr(module, alias.name) or import_module(f"{node.module}.{alias.name}")
        elif isinstance(node, ast.Attribute) and (words := named(node))[:1] == ["pw"]:
            found = import_module("partwright")
            for word in words[1:]:
                found = getattr(found, word)
