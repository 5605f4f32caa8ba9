"""What `partwright edit` does."""

from __future__ import annotations

import argparse
import re

from partwright.assembly import load_assembly
from partwright.assembly.editing import with_numbers
from partwright.errors import ParameterError, UnitError, UnsupportedFormatError
from partwright.shapes import METRES, canonical_unit

_SET = re.compile(r"\s*(.+?)\s*=\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)\s*")


def run(arguments: argparse.Namespace) -> int:
    if arguments.output.suffix.lower() != ".json":
        name = arguments.output.name
        raise UnsupportedFormatError(f"cannot write {name}: use a .json, then partwright export")
    assembly = load_assembly(arguments.assembly)
    values = dict(_value(text, assembly.unit) for text in arguments.values)
    edited = with_numbers(assembly, values, arguments.alone)
    edited.assembly.save(arguments.output)
    for line in (*edited.changed, *(f"  {line}" for line in edited.followed)):
        print(line)
    print(f"written to {arguments.output}")
    return 0


def _value(text: str, unit: str | None) -> tuple[str, float]:
    """Name and value, in the assembly's unit where one was typed.

    Raises:
        ParameterError: it is no NAME=NUMBER.
        UnitError: a unit was typed, and the assembly's is unknown.
    """
    found = _SET.fullmatch(text)
    if found is None:
        raise ParameterError(f"--set {text!r}: expected PART.NUMBER=VALUE, such as hole.diameter=6mm")
    name, value, typed = found[1], float(found[2]), found[3]
    if not typed:
        return name, value
    if unit is None:
        raise UnitError(f"--set {text!r}: the assembly's unit is unknown; give the number without a unit")
    return name, value * METRES[canonical_unit(typed)] / METRES[canonical_unit(unit)]
