"""Whether an answer is a GLB at all, and what it is if not."""

from __future__ import annotations

import re
import struct

from partwright.errors import GeneratorError

_HEADER = struct.Struct("<4sII")  # magic, version, length of all
_QUOTED = 120  # characters of an answer that a message shows


def check_glb(data: bytes, name: str) -> None:
    """Whether what `name` gave is a whole binary glTF 2.0.

    Raises:
        GeneratorError: it is nothing, a page, some text, another format, or cut.
    """
    if not data:
        raise GeneratorError(f"{name} answered with nothing; expected a GLB")
    if data[:4] != b"glTF":
        raise GeneratorError(f"{name} answered with {_kind(data)}; expected a GLB")
    if len(data) < _HEADER.size:
        raise GeneratorError(f"{name} answered with a GLB of {len(data)} bytes, which is cut")
    _, version, length = _HEADER.unpack_from(data)
    if version != 2:
        raise GeneratorError(f"{name} answered with a GLB of version {version}; expected version 2")
    if length > len(data):
        raise GeneratorError(f"{name} answered with a GLB of {length} bytes, of which {len(data)} are there")


def _kind(data: bytes) -> str:
    """What data that is no GLB looks like, in a few words."""
    start = data[:2000].lstrip(b"\xef\xbb\xbf \t\r\n")
    text = quoted(start)
    if re.match(rb"<!doctype html|<html|<head|<body", start, re.IGNORECASE):
        title = re.search(rb"<title[^>]*>(.*?)</title>", start, re.IGNORECASE | re.DOTALL)
        return "an HTML page" + (f" ({quoted(title[1])})" if title else "")
    if start[:1] in (b"{", b"["):
        return f"JSON: {text}"
    if start.startswith(b"PK\x03\x04"):
        return "a ZIP file"
    if start and text and all(c.isprintable() for c in text):
        return f"text: {text}"
    return f"{len(data)} bytes of something else"


def quoted(data: bytes) -> str:
    """The beginning of some text on one line; nothing where it is none."""
    try:
        text = " ".join(
            data[: 4 * _QUOTED].decode(errors="strict" if len(data) < 4 * _QUOTED else "ignore").split()
        )
    except UnicodeDecodeError:
        return ""
    return text if len(text) <= _QUOTED else f"{text[:_QUOTED]} [...]"
