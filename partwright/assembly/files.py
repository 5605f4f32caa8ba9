"""Reading the assembly file: versioned JSON, strict. `file_text` writes it.

docs/assembly-file.md describes it, docs/assembly.schema.json is its JSON Schema.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from partwright.assembly.file_text import FORMAT, VERSION
from partwright.assembly.group_copies import GroupCopy, numbered_names
from partwright.assembly.similarity import Similarity
from partwright.assembly.tree import MAX_DEPTH, Assembly, Node, Part
from partwright.errors import AssemblyFileError, NewerVersionError, ParameterError, UnreadableFileError
from partwright.fields import from_dict
from partwright.input_files import check_file

SUFFIX = ".json"
MAX_BYTES = 64 * 1024 * 1024
MAX_PARTS = 100_000

# Of a file that is called otherwise: a mesh or a picture, most likely.
_NONE = f"no assembly file ({SUFFIX}), which `partwright fit` makes of a shape; give that"
_PART_KEYS = {"name", "field", "translation", "rotation", "blend", "metadata", "instances"}
_INSTANCE_KEYS = {"translation", "rotation"}
_COPY_KEYS = {*_INSTANCE_KEYS, "mirror", "names"}
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
        if path.suffix.lower() == SUFFIX:
            raise AssemblyFileError(f"{path}: not UTF-8 text, so not an assembly file") from error
        raise AssemblyFileError(f"{path}: {_NONE}") from error
    except AssemblyFileError as error:
        if path.suffix.lower() != SUFFIX and FORMAT.encode() not in data:
            raise AssemblyFileError(f"{path}: {_NONE}") from error
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
        self.names: list[tuple[str, str]] = []  # of each leaf: the place of its name, and that
        self.copies = 0

    def nodes(self, data: Any, place: str, depth: int, copied: bool) -> list[Node]:
        """A node, and its copies where it is a group that has such; copied: whether it may."""
        if not isinstance(data, dict):
            _fail(place, f"expected an object, got {_shown(data)}")
        if "children" not in data:
            return [self.part(data, place)]
        copies = data.get("instances", [])
        if not isinstance(copies, list):
            _fail(f"{place}.instances", f"expected a list, got {_shown(copies)}")
        if copies and not copied:
            _fail(f"{place}.instances", "only groups in a union, or taken away in a difference, have copies")
        before = self.copies
        own = {key: value for key, value in data.items() if key != "instances"}
        group = self.assembly(own, place, depth)
        self.copies += (self.copies - before) * len(copies)
        if self.copies > MAX_PARTS:
            _fail(place, f"more than {MAX_PARTS:,} parts, counting every instance")
        made = (self.copy(group, one, f"{place}.instances[{i}]", i + 2) for i, one in enumerate(copies))
        return [group, *made]

    def copy(self, group: Assembly, data: Any, place: str, number: int) -> Assembly:
        move = self.instance(data, place, _COPY_KEYS)
        if data.get("mirror", "x") not in ("x", "y", "z"):
            _fail(f"{place}.mirror", f"expected x, y or z, got {_shown(data['mirror'])}")
        names = data.get("names", [])
        if not isinstance(names, list):
            _fail(f"{place}.names", f"expected a list of names, got {_shown(names)}")
        try:
            made = GroupCopy(move, data.get("mirror"), tuple(names)).of(group, number)
        except ParameterError as error:
            raise AssemblyFileError(f"{place}: {error}") from error
        wanted = names or numbered_names(group, number)
        self.names += [(f"{place}.names[{i}]", name) for i, name in enumerate(wanted)]
        return made

    def part(self, data: dict[str, Any], place: str) -> Part:
        _check_keys(data, place, _PART_KEYS, required=("field", "name"))
        self.names.append((f"{place}.name", data["name"]))
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

    def instance(self, data: Any, place: str, known: set[str] = _INSTANCE_KEYS) -> Similarity:
        if not isinstance(data, dict):
            _fail(place, f"expected an object, got {_shown(data)}")
        _check_keys(data, place, known, required=())
        _check_lists(data, place)
        values = {key: data[key] for key in _INSTANCE_KEYS if key in data}
        result: Similarity = self.build(Similarity, values, place)
        return result

    def assembly(self, data: dict[str, Any], place: str, depth: int) -> Assembly:
        _check_keys(data, place, _ASSEMBLY_KEYS, required=("operation", "children"))
        if depth > MAX_DEPTH:
            _fail(place, f"assemblies nest at most {MAX_DEPTH} deep")
        children = data["children"]
        if not isinstance(children, list):
            _fail(_join(place, "children"), f"expected a list, got {_shown(children)}")
        operation = data["operation"]
        nodes: list[Node] = []
        for i, child in enumerate(children):
            copied = operation == "union" or (operation == "difference" and i > 0)
            nodes += self.nodes(child, _join(place, f"children[{i}]"), depth + 1, copied)
        return self.build(Assembly, {**data, "children": tuple(nodes)}, place)

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
                _fail(place, f"expected a name that no other part has, got {_shown(name)}")


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
