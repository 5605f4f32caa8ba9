"""One schema: what the page knows of messages is made from the server's own."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from partwright.errors import MessageError
from partwright.studio.messages import Commit, Fit, Saved, read, typescript, written

GENERATED = Path(__file__).parents[2] / "studio" / "src" / "server" / "messages.ts"


def test_the_pages_types_are_current() -> None:
    assert GENERATED.read_text("utf-8") == typescript(), (
        "python -m partwright.studio.messages > studio/src/server/messages.ts"
    )


def test_what_is_written_is_read_again() -> None:
    for message in (Commit(3, "Move leg", "{}"), Fit("only", ["leg"], "superfrusta", "draft", None)):
        assert read(written(message)) == message
    assert json.loads(written(Saved("a.json"))) == {"type": "saved", "file": "a.json"}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"type": "state"}',
        '{"type": "commit"}',
        '{"type": "commit", "base": "0", "label": "a", "text": "b"}',
        '{"type": "commit", "base": true, "label": "a", "text": "b"}',
        '{"type": "undo", "base": 0, "more": 1}',
        '{"type": "fit", "mode": "all", "names": [], "method": "capri", "quality": "draft"}',
        '{"type": "fit", "mode": "new", "names": [1], "method": "capri", "quality": "draft"}',
        "[" * 100_000,
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(MessageError):
        read(text)
