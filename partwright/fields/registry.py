"""The kinds of field an assembly file can name. A new kind is a new class and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr as brief
from typing import Any

from partwright.errors import ParameterError
from partwright.fields.base import Field
from partwright.fields.quadric import Quadric
from partwright.fields.solids import Box, Capsule, Cone, Cylinder, Frustum, Sphere, Torus, Tube
from partwright.fields.superfrustum import SuperFrustum

KINDS: dict[str, type[Field]] = {
    field.kind: field
    for field in (SuperFrustum, Box, Cylinder, Cone, Frustum, Sphere, Capsule, Tube, Torus, Quadric)
}


def from_dict(data: object) -> Field:
    """The field written by `Field.to_dict`; raises ParameterError for anything else."""
    if not isinstance(data, Mapping):
        raise ParameterError(f"a field is {brief(data)}; expected an object with a kind and its parameters")
    kind: Any = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ParameterError(f"a field's kind is {brief(kind)}; expected one of {', '.join(KINDS)}")
    return KINDS[kind].from_dict({name: value for name, value in data.items() if name != "kind"})
