"""Reading the assembly file: versioned JSON, strict. `file_text` writes it.

docs/assembly-file.md describes it, docs/assembly.schema.json is its JSON Schema.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from partwright.assembly.file_text import FORMAT, VERSION
from partwright.assembly.similarity import Similarity
from partwright.assembly.tree import MAX_DEPTH, Assembly, Node, Part
from partwright.errors import AssemblyFileError, NewerVersionError, ParameterError, UnreadableFileError
from partwright.fields import from_dict
from partwright.input_files import check_file

MAX_BYTES = 64 * 1024 * 1024
MAX_PARTS = 100_000

_PART_KEYS = {"name", "field", "translation", "rotation", "blend", "metadata", "instances"}
_INSTANCE_KEYS = {"translation", "rotation"}
_ASSEMBLY_KEYS = {"name", "operation", "blend", "unit", "up", "metadata", "children"}


def load_assembly(path: str | Path) -> Assembly:
    """Read an assembly file.

    Raises:
        UnreadableFileError: the file is missing or cannot be opened.
        NewerVersionError: it was written by a newer version.
        AssemblyFileError: it is truncated, too large, or breaks the schema; the message names the place.
    """
    path = Path(path)
    size = check_file(path)
    try:
        if size > MAX_BYTES:
            raise AssemblyFileError(f"{path}: {size:,} bytes; an assembly file has at most {MAX_BYTES:,}")
        data = path.read_bytes()
    except OSError as error:
        raise UnreadableFileError(f"cannot read {path}: {error.strerror or error}") from error
    try:
        return from_text(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise AssemblyFileError(f"{path}: not UTF-8 text, so not an assembly file") from error
    except AssemblyFileError as error:
        raise type(error)(f"{path}: {error}") from error


def from_text(text: str) -> Assembly:
    """The assembly of an assembly file's text; raises as `load_assembly` does."""
    try:
        data = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique_keys)
    except RecursionError as error:
        raise AssemblyFileError(f"nested too deep; assemblies nest at most {MAX_DEPTH} deep") from error
    except ValueError as error:
        raise AssemblyFileError(f"not complete JSON ({error}); was the file cut short?") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise AssemblyFileError(f'not an assembly file: expected an object with "format": "{FORMAT}"')
    version = data.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise AssemblyFileError(f"version: expected a number from 1 to {VERSION}, got {_shown(version)}")
    if version > VERSION:
        raise NewerVersionError(
            f"version {version}; this Partwright reads up to {VERSION}: upgrade it to open the file"
        )
    reader = _Reader()
    assembly = reader.assembly({k: v for k, v in data.items() if k not in ("format", "version")}, "", 1)
    reader.check_names(assembly)
    return assembly


class _Reader:
    """Walks the JSON, naming the place of whatever is wrong."""

    def __init__(self) -> None:
        self.names: list[tuple[str, str]] = []  # (place, name) of each leaf
        self.copies = 0

    def node(self, data: Any, place: str, depth: int) -> Node:
        if not isinstance(data, dict):
            _fail(place, f"expected an object, got {_shown(data)}")
        return self.assembly(data, place, depth) if "children" in data else self.part(data, place)

    def part(self, data: dict[str, Any], place: str) -> Part:
        _check_keys(data, place, _PART_KEYS, required=("field", "name"))
        self.names.append((place, data["name"]))
        instances = data.get("instances", [])
        if not isinstance(instances, list):
            _fail(f"{place}.instances", f"expected a list, got {_shown(instances)}")
        self.copies += 1 + len(instances)
        if self.copies > MAX_PARTS:
            _fail(place, f"more than {MAX_PARTS:,} parts, counting every instance")
        try:
            values = {**data, "field": from_dict(data["field"])}
        except ParameterError as error:
            raise AssemblyFileError(f"{place}.field: {error}") from error
        _check_lists(values, place)
        values["instances"] = tuple(
            self.instance(move, f"{place}.instances[{i}]") for i, move in enumerate(instances)
        )
        return self.build(Part, values, place)

    def instance(self, data: Any, place: str) -> Similarity:
        if not isinstance(data, dict):
            _fail(place, f"expected an object, got {_shown(data)}")
        _check_keys(data, place, _INSTANCE_KEYS, required=())
        _check_lists(data, place)
        result: Similarity = self.build(Similarity, data, place)
        return result

    def assembly(self, data: dict[str, Any], place: str, depth: int) -> Assembly:
        _check_keys(data, place, _ASSEMBLY_KEYS, required=("operation", "children"))
        if depth > MAX_DEPTH:
            _fail(place, f"assemblies nest at most {MAX_DEPTH} deep")
        children = data["children"]
        if not isinstance(children, list):
            _fail(_join(place, "children"), f"expected a list, got {_shown(children)}")
        nodes = tuple(
            self.node(child, _join(place, f"children[{i}]"), depth + 1) for i, child in enumerate(children)
        )
        return self.build(Assembly, {**data, "children": nodes}, place)

    def build(self, kind: Any, values: dict[str, Any], place: str) -> Any:
        metadata = values.get("metadata", {})
        if not isinstance(metadata, dict):
            _fail(_join(place, "metadata"), f"expected an object, got {_shown(metadata)}")
        try:
            return kind(**values)
        except ParameterError as error:
            raise AssemblyFileError(_join(place, str(error))) from error

    def check_names(self, assembly: Assembly) -> None:
        """The assembly has renamed leaves without a name of their own; in a file that is an error."""
        for (place, name), part in zip(self.names, assembly.parts, strict=True):
            if name != part.name:
                _fail(f"{place}.name", f"expected a name that no other part has, got {_shown(name)}")


def _check_keys(data: dict[str, Any], place: str, known: set[str], required: tuple[str, ...]) -> None:
    for key in required:
        if key not in data:
            _fail(_join(place, key), "is missing")
    for key in data:
        if key not in known:
            _fail(_join(place, key[:40]), f"unknown key; expected {', '.join(sorted(known))}")


def _check_lists(data: dict[str, Any], place: str) -> None:
    for key in ("translation", "rotation"):
        if not isinstance(data.get(key, []), list):
            _fail(f"{place}.{key}", f"expected a list of numbers, got {_shown(data[key])}")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON number")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        raise ValueError("a key is given twice in one object")
    return result


def _join(place: str, rest: str) -> str:
    return f"{place}.{rest}" if place else rest


def _shown(value: object) -> str:
    """`value` as JSON would show it, cut to a reasonable length."""
    text = "an object" if isinstance(value, dict) else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _fail(place: str, message: str) -> NoReturn:
    raise AssemblyFileError(f"{place}: {message}")
