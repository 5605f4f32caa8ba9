"""HTML: one page with a viewer and an editor in it, and the assembly as data. It needs no network.

The page (page.html, beside this file) is built from the TypeScript in `studio/`. What it shows and edits is
the text of an assembly file, which stands in the page as it stands in a file.
"""

from __future__ import annotations

from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.assembly.file_text import to_text
from partwright.atomic_io import write_bytes
from partwright.errors import UnsupportedFormatError
from partwright.export.formats import Format, Holds

if TYPE_CHECKING:
    from partwright.assembly import Assembly

DEEPEST = 15
"""How deep groups may be nested in the page."""
MOST_COPIES = 10_000
_TITLE, _DATA = "<title>Partwright</title>", "<!--DATA-->"


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the page.

    Raises:
        UnsupportedFormatError: groups are nested too deep for the page, or there are too many parts.
        OutputError: the file cannot be written.
    """
    write_bytes(path, to_html(assembly).encode())


def to_html(assembly: Assembly) -> str:
    """The text of the page with the assembly in it."""
    check_size(assembly)
    title = f"<title>{escape(assembly.name or 'Assembly')} · Partwright</title>"
    return page().replace(_TITLE, title, 1).replace(_DATA, data_script("assembly", to_text(assembly)), 1)


def check_size(assembly: Assembly) -> None:
    """Raises UnsupportedFormatError where the page could not show the assembly."""
    copies = sum(len(part.copies) for part in assembly.parts)
    if assembly.depth > DEEPEST:
        raise UnsupportedFormatError(
            f"HTML shows groups nested at most {DEEPEST} deep, these are {assembly.depth}: "
            "export a mesh instead"
        )
    if copies > MOST_COPIES:
        raise UnsupportedFormatError(
            f"HTML shows at most {MOST_COPIES:,} parts, these are {copies:,}: export a mesh instead"
        )


def page() -> str:
    """The page as it is built, without data."""
    return files("partwright.export").joinpath("page.html").read_text("utf-8")


def data_script(name: str, json_text: str) -> str:
    """JSON as an element of a page: no text in it can end the element or begin another."""
    inert = json_text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    return f'<script type="application/json" id="{name}">{inert}</script>'


FORMAT = Format("HTML", write, frozenset(Holds) - {Holds.LEARNED})
