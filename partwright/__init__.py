"""Partwright: a shape goes in, an editable assembly of parts comes out."""

from __future__ import annotations

import importlib

# Not lazy: the function has the name of the package it lives in, and whichever is bound last stays.
from partwright.export import export

TYPE_CHECKING = False  # as of typing, which takes longer to import than all that is here
if TYPE_CHECKING:
    from typing import Any

__version__ = "0.1.0"

# Public name -> module that defines it, and its name there if it is another. Imported on first use, so that
# `import partwright` stays cheap.
_PUBLIC = {
    "load_shape": "partwright.shapes",
    "Shape": "partwright.shapes",
    "shape_from_image": "partwright.generators",
    "fit": "partwright.fitting",
    "fit_nodes": "partwright.fitting",
    "fit_many": "partwright.batch",
    "Result": "partwright.fitting",
    "Start": "partwright.fitting",
    "Tolerance": "partwright.fitting",
    "Clean": "partwright.fitting",
    "Cancellation": "partwright.methods",
    "SuperFrusta": "partwright.superfrusta:Settings",
    "Solids": "partwright.superfrusta.solids:Settings",
    "Capri": "partwright.capri:Settings",
    "LearnedParts": "partwright.partsdf:Settings",
    "Part": "partwright.assembly",
    "Assembly": "partwright.assembly",
    "load_assembly": "partwright.assembly",
    "with_numbers": "partwright.assembly.editing",
    "evaluate": "partwright.metrics",
    "clean": "partwright.cleaning",
    "optimise": "partwright.goals",
}
_METHODS = ("capri", "partsdf")
_MODULES = (
    "fields",
    "shapes",
    "assembly",
    "meshing",
    "render",
    "metrics",
    "errors",
    "datasets",
    "textures",
    "goals",
    *_METHODS,
)

__all__ = ["__version__", "export", *_PUBLIC, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        module, _, own_name = _PUBLIC[name].partition(":")
        return getattr(importlib.import_module(module), own_name or name)
    if name in _MODULES:
        return importlib.import_module(f"partwright.{name}")
    raise AttributeError(f"module 'partwright' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
