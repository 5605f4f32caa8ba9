"""XML that comes back as it was: comments, order and spaces of what is not changed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.errors import RobotError, UnreadableFileError

if TYPE_CHECKING:
    import trimesh


def parsed(path: Path, tag: str | None) -> Any:
    """The tree of a file whose root has that tag; None: any.

    Raises:
        UnreadableFileError: it is not there, or no XML. RobotError: its root is another.
    """
    from lxml import etree

    # Prefixes that nobody declared are common in robots' files, and their readers take them.
    parser = etree.XMLParser(resolve_entities=False, no_network=True, recover=True)
    try:
        tree = etree.parse(str(path), parser)
        for error in parser.error_log:
            if error.domain != etree.ErrorDomains.NAMESPACE:
                raise UnreadableFileError(f"{path}: it is no XML: line {error.line}: {error.message}")
        if tree.getroot() is None:
            raise UnreadableFileError(f"{path}: it is no XML: it is empty")
    except OSError as error:
        raise UnreadableFileError(
            f"{path}: it cannot be read: {error.strerror or 'it is not there'}"
        ) from error
    except etree.XMLSyntaxError as error:
        raise UnreadableFileError(f"{path}: it is no XML: {error.msg}") from error
    root = tree.getroot()
    if tag is not None and root.tag != tag:
        raise RobotError(f"{path}: it is no robot: its root is <{root.tag}>, expected <{tag}>")
    return tree


def serialised(tree: Any) -> bytes:
    from lxml import etree

    encoding, root = tree.docinfo.encoding or "UTF-8", tree.getroot()

    def written(element: Any) -> str:
        return str(etree.tostring(element, encoding="unicode", with_tail=False))

    # What is beside the root is written by itself: the parser drops the line ends there.
    lines = [f"<?xml version='{tree.docinfo.xml_version}' encoding='{encoding}'?>"]
    lines += [tree.docinfo.doctype] if tree.docinfo.doctype else []
    lines += [written(each) for each in reversed(list(root.itersiblings(preceding=True)))]
    lines += [written(root), *map(written, root.itersiblings())]
    return ("\n".join(lines) + "\n").encode(encoding, "xmlcharrefreplace")


def three(text: str, path: Path, where: str) -> list[float]:
    """Three finite numbers.

    Raises:
        RobotError: they are none.
    """
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != 3 or not np.isfinite(values).all():
        raise RobotError(f"{path}: {where}: expected three numbers, got {text!r}")
    return values


def stl(mesh: trimesh.Trimesh | None) -> bytes:
    from trimesh.exchange.stl import export_stl

    return bytes(export_stl(mesh))
