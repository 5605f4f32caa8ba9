"""Images in an assembly's text, each kept once: they are most of a text that comes again with every edit.

A text without them has a name in each image's place, of which the names begin with `MARK`.
"""

from __future__ import annotations

import hashlib
import re

MARK = "partwright-image:"
_IMAGE = re.compile(r'"(data:image/png;base64,[A-Za-z0-9+/=]{64,})"')
_NAME = re.compile(rf'"{MARK}([0-9a-f]{{32}})"')


class Images:
    """By their names."""

    def __init__(self) -> None:
        self.known: dict[str, str] = {}

    def taken_out(self, text: str) -> tuple[str, list[str]]:
        """The text with names in place of images, and the names of those that were not known before."""
        new: list[str] = []

        def name(match: re.Match[str]) -> str:
            found = hashlib.sha256(match[1].encode()).hexdigest()[:32]
            if found not in self.known:
                self.known[found] = match[1]
                new.append(found)
            return f'"{MARK}{found}"'

        return _IMAGE.sub(name, text), new

    def put_back(self, text: str) -> str:
        """The inverse; a name that is not known stays."""

        def image(match: re.Match[str]) -> str:
            return f'"{self.known[match[1]]}"' if match[1] in self.known else match[0]

        return _NAME.sub(image, text)
