"""HTML: one page with a viewer and an editor in it, and the assembly as data. It needs no network.

The page (page.html, beside this file) is built from the TypeScript in `studio/`. What it shows and edits is
the text of an assembly file, which stands in the page as it stands in a file.
"""

from __future__ import annotations

from html import escape
from importlib.resources import files
from pathlib import Path

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.file_text import to_text
from partwright.assembly.joint import is_joint
from partwright.atomic_io import write_bytes
from partwright.errors import UnsupportedFormatError
from partwright.export.formats import Format, Holds
from partwright.export.part_meshes import part_meshes

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
    """The text of the page with the assembly in it, and with meshes of its learned parts."""
    check_size(assembly)
    title = f"<title>{escape(assembly.name or 'Assembly')} · Partwright</title>"
    data = data_script("assembly", to_text(assembly))
    meshes = part_meshes(assembly)
    if meshes is not None:
        data += data_script("learned", meshes)
    return page().replace(_TITLE, title, 1).replace(_DATA, data, 1)


def check_size(assembly: Assembly) -> None:
    """Raises UnsupportedFormatError where the page could not show the assembly."""
    cut = _cut_learned(assembly)
    if cut is not None:
        raise UnsupportedFormatError(
            f"HTML shows learned parts whole, and {cut} is cut or taken away: export a mesh instead"
        )
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


def _cut_learned(node: Node) -> str | None:
    """A learned part in a group that does anything but join."""
    if isinstance(node, Part):
        return None
    if node.operation != "union":
        return next((part.name for part in node.parts if is_joint(part)), None)
    return next((found for child in node.children if (found := _cut_learned(child))), None)


def page() -> str:
    """The page as it is built, without data."""
    return files("partwright.export").joinpath("page.html").read_text("utf-8")


def data_script(name: str, json_text: str) -> str:
    """JSON as an element of a page: no text in it can end the element or begin another."""
    inert = json_text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    return f'<script type="application/json" id="{name}">{inert}</script>'


FORMAT = Format("HTML", write, frozenset(Holds))
