"""How an assembly shows itself where something asks it to, as a notebook does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from partwright.registry import Registry

# name -> what makes, of an assembly, what is shown by media type
DISPLAYS: Registry[Callable[[Any], dict[str, str]]] = Registry(
    "display", "partwright.displays", {"notebook": "partwright.studio.notebook:bundle"}
)
