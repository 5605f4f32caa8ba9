"""The kinds of field an assembly file can name. A new kind is a new class and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from reprlib import repr as brief
from typing import Any

from partwright.errors import ParameterError
from partwright.fields.base import Field
from partwright.fields.quadric import Quadric
from partwright.fields.solids import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Frustum,
    HollowBox,
    HollowFrustum,
    Sphere,
    Torus,
    Tube,
)
from partwright.fields.superfrustum import SuperFrustum

KINDS: dict[str, type[Field]] = {
    field.kind: field
    for field in (
        SuperFrustum,
        Box,
        Cylinder,
        Cone,
        Frustum,
        Sphere,
        Capsule,
        Tube,
        Torus,
        HollowBox,
        HollowFrustum,
        Quadric,
    )
}

# Kinds whose fields need more than this room: module and class, imported when a file names one.
LEARNED = {"neural": ("partwright.partsdf.field", "NeuralField")}


def from_dict(data: object) -> Field:
    """The field written by `Field.to_dict`; raises ParameterError for anything else."""
    if not isinstance(data, Mapping):
        raise ParameterError(f"a field is {brief(data)}; expected an object with a kind and its parameters")
    kind: Any = data.get("kind")
    if not isinstance(kind, str) or kind not in {*KINDS, *LEARNED}:
        known = ", ".join([*KINDS, *LEARNED])
        raise ParameterError(f"a field's kind is {brief(kind)}; expected one of {known}")
    chosen = KINDS[kind] if kind in KINDS else _learned(kind)
    return chosen.from_dict({name: value for name, value in data.items() if name != "kind"})


def _learned(kind: str) -> type[Field]:
    module, name = LEARNED[kind]
    found: type[Field] = getattr(import_module(module), name)
    return found
