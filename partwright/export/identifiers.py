"""Names of parts as identifiers of a programming language, as text that may stand in a comment,
and beside names that are taken."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Sequence
from itertools import count

from partwright.assembly.names import unique_names

_LONGEST = 40


def identifiers(names: Sequence[str], reserved: Collection[str] = ()) -> list[str]:
    """A snake_case ASCII identifier a name, none twice, and none of `reserved`; "part" where nothing is left.

    None begins with a digit or `gl_`, ends with an underscore or holds two underscores in a row.
    """
    wanted = [*reserved, *(_identifier(name) for name in names)]
    return unique_names(wanted, wanted)[len(reserved) :]


def comment(text: str) -> str:
    """`text` for the rest of a comment line: ASCII, one line, and not continued by a backslash at its end."""
    plain = text.encode("ascii", "backslashreplace").decode()
    return " ".join(plain.replace("\\", "/").split())


def file_name(text: str) -> str:
    """`text` for the name of a file: letters, digits, `_`, `.` and `-`."""
    return re.sub(r"[^\w.-]", "_", text, flags=re.ASCII)


def free_name(wanted: str, taken: set[str]) -> str:
    """The name, or it with the first free number behind it, which is then taken."""
    name = next(n for i in count(1) if (n := wanted if i == 1 else f"{wanted}_{i:02d}") not in taken)
    taken.add(name)
    return name


def _identifier(name: str) -> str:
    ascii_name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    words = re.sub(r"[^a-z0-9]+", "_", ascii_name.lower())[:_LONGEST].strip("_")
    plain = words and not words[0].isdigit() and not words.startswith("gl_")
    return words if plain else f"part_{words}".rstrip("_")
