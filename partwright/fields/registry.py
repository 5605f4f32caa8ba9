"""The kinds of field an assembly file can name. A new kind is a new class and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr as brief
from typing import Any

from partwright.errors import ParameterError
from partwright.fields.base import Field
from partwright.registry import Registry

KINDS: Registry[type[Field]] = Registry(
    "kind of field",
    "partwright.fields",
    {
        "superfrustum": "partwright.fields.superfrustum:SuperFrustum",
        "box": "partwright.fields.solids:Box",
        "cylinder": "partwright.fields.solids:Cylinder",
        "cone": "partwright.fields.solids:Cone",
        "frustum": "partwright.fields.solids:Frustum",
        "sphere": "partwright.fields.solids:Sphere",
        "capsule": "partwright.fields.solids:Capsule",
        "tube": "partwright.fields.solids:Tube",
        "torus": "partwright.fields.solids:Torus",
        "hollow_box": "partwright.fields.solids:HollowBox",
        "hollow_frustum": "partwright.fields.solids:HollowFrustum",
        "extrusion": "partwright.fields.extrusion:Extrusion",
        "revolution": "partwright.fields.revolution:Revolution",
        "pipe": "partwright.fields.pipe:Pipe",
        "quadric": "partwright.fields.quadric:Quadric",
        "neural": "partwright.partsdf.field:NeuralField",
    },
)


def from_dict(data: object) -> Field:
    """The field written by `Field.to_dict`; raises ParameterError for anything else."""
    if not isinstance(data, Mapping):
        raise ParameterError(f"a field is {brief(data)}; expected an object with a kind and its parameters")
    kind: Any = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ParameterError(f"a field's kind is {brief(kind)}; expected one of {', '.join(KINDS)}")
    return KINDS[kind].from_dict({name: value for name, value in data.items() if name != "kind"})
