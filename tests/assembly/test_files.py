"""The file format: exact round trips, the published schema, and files that are broken on purpose."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from partwright.assembly import Assembly, Part, load_assembly
from partwright.assembly.file_text import to_text
from partwright.assembly.files import MAX_BYTES, from_text
from partwright.errors import AssemblyFileError, NewerVersionError, OutputError, UnreadableFileError
from partwright.fields import KINDS, Sphere
from tests.assembly.strategies import ASSEMBLIES, SWEPT

SCHEMA = json.loads((Path(__file__).parents[2] / "docs" / "assembly.schema.json").read_text())
jsonschema.validators.validator_for(SCHEMA).check_schema(SCHEMA)
VALIDATOR = jsonschema.validators.validator_for(SCHEMA)(SCHEMA)


@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ASSEMBLIES | SWEPT.map(lambda part: Assembly((part,))))
def test_round_trip_is_exact_and_the_schema_holds(tmp_path: Path, assembly: Assembly) -> None:
    assembly.save(tmp_path / "a.json")
    loaded = load_assembly(tmp_path / "a.json")
    if loaded != assembly:  # groups that happen to be copies come back but for rounding
        assert '"instances": [\n' in to_text(assembly)
        for one, other in zip(loaded.parts, assembly.parts, strict=True):
            assert replace(one, translation=other.translation, rotation=other.rotation) == other
            assert one.translation == pytest.approx(other.translation, rel=1e-10, abs=1e-10)
            assert abs(np.dot(one.rotation, other.rotation)) == pytest.approx(1, abs=1e-10)
    loaded.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    VALIDATOR.validate(json.loads(to_text(assembly)))


def test_schema_names_every_kind() -> None:
    named: set[str] = set()
    for choice in SCHEMA["$defs"]["field"]["oneOf"]:
        kind = choice["properties"]["kind"]
        named |= set(kind.get("enum", [kind.get("const")]))
    assert named == set(KINDS.own)


def test_saving_leaves_nothing_else_behind(tmp_path: Path, mug: Assembly) -> None:
    mug.save(tmp_path / "mug.json")
    assert [p.name for p in tmp_path.iterdir()] == ["mug.json"]


def test_unwritable_place(tmp_path: Path, mug: Assembly) -> None:
    with pytest.raises(OutputError, match="missing"):
        mug.save(tmp_path / "missing" / "mug.json")
    with pytest.raises(OutputError, match="in the way"):
        mug.save(tmp_path)


def test_defaults_may_be_left_out() -> None:
    text = '{"format": "partwright-assembly", "version": 1, "operation": "union", "children": [%s]}'
    assembly = from_text(text % '{"name": "ball", "field": {"kind": "sphere", "radius": 2}}')
    assert assembly == Assembly((Part(Sphere(2.0), name="ball"),))


def broken(mug: Assembly, place: list[Any], value: Any) -> str:
    """The mug's file with the value at `place` replaced."""
    data = json.loads(to_text(mug))
    target = data
    for key in place[:-1]:
        target = target[key]
    target[place[-1]] = value
    return json.dumps(data)


HANDLE = ["children", 0, "children", 1]


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (["format"], "obj", "not an assembly file"),
        (["version"], "1", 'version: expected .* got "1"'),
        (["version"], True, "version: expected"),
        (["operation"], "xor", "operation: expected one of"),
        (["children"], [], "at least one part"),
        (["children"], {}, "children: expected a list, got an object"),
        (["children", 1], None, r"children\[1\]: expected an object, got null"),
        (["children", 0, "metadata"], [1], r"children\[0\].metadata: expected an object"),
        (["extra"], 1, "extra: unknown key"),
        (["unit"], 3, "unit: expected a string"),
        ([*HANDLE, "name"], "body", r"children\[0\].children\[1\].name: expected a name that no other"),
        ([*HANDLE, "name"], "", r"children\[0\].children\[1\].name"),
        ([*HANDLE, "name"], 7, r"children\[0\].children\[1\].name: expected at most"),
        ([*HANDLE, "blend"], -1, r"children\[0\].children\[1\].blend: expected .* at least 0, got -1"),
        ([*HANDLE, "blend"], "x", r"children\[0\].children\[1\].blend: expected a finite number, got 'x'"),
        ([*HANDLE, "blend"], True, "blend: expected a finite number"),
        ([*HANDLE, "translation"], [0, 0], r"translation: expected 3 numbers \(x, y, z\), got 2"),
        ([*HANDLE, "translation"], [0, "y", 0], r"translation\[1\]: expected a finite number"),
        ([*HANDLE, "translation"], 3, "translation: expected a list of numbers, got 3"),
        ([*HANDLE, "translation"], [0, 10**400, 0], r"translation\[1\]: expected a finite number"),
        ([*HANDLE, "rotation"], [0, 0, 0, 0], "rotation: .* is no rotation"),
        ([*HANDLE, "rotation"], "1000", "rotation: expected a list"),
        ([*HANDLE, "field"], 3, r"children\[0\].children\[1\].field: "),
        ([*HANDLE, "field", "kind"], "teapot", r"field: .*teapot"),
        ([*HANDLE, "field", "taper"], "x", r"children\[0\].children\[1\].field: .*taper is 'x'"),
        ([*HANDLE, "field", "taper"], 2.5, r"field: .*taper is 2.5"),
        ([*HANDLE, "field", "size"], [1, 1], r"field: .*size"),
        ([*HANDLE, "field", "wings"], 2, r"field: .*wings"),
    ],
)
def test_a_broken_file_is_refused_at_its_place(
    mug: Assembly, place: list[Any], value: Any, message: str
) -> None:
    with pytest.raises(AssemblyFileError, match=message):
        from_text(broken(mug, place, value))


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_none(mug: Assembly, literal: str) -> None:
    text = to_text(mug).replace('"blend": 0.05', f'"blend": {literal}')
    assert literal in text
    with pytest.raises(AssemblyFileError):
        from_text(text)


def test_every_truncation_is_refused(mug: Assembly) -> None:
    text = to_text(mug).strip()
    for end in range(0, len(text) - 1, 7):
        with pytest.raises(AssemblyFileError):
            from_text(text[:end])


def test_a_newer_version_says_so(mug: Assembly) -> None:
    with pytest.raises(NewerVersionError, match="version 2; this Partwright reads up to 1"):
        from_text(broken(mug, ["version"], 2))


def test_hostile_nesting() -> None:
    with pytest.raises(AssemblyFileError, match="nested too deep"):
        from_text("[" * 1_000_000)
    node: dict[str, Any] = {"name": "ball", "field": {"kind": "sphere", "radius": 2}}
    for _ in range(70):
        node = {"operation": "union", "children": [node]}
    node |= {"format": "partwright-assembly", "version": 1}
    with pytest.raises(AssemblyFileError, match="at most 64 deep"):
        from_text(json.dumps(node))


def test_doubled_keys_are_refused(mug: Assembly) -> None:
    with pytest.raises(AssemblyFileError, match="twice"):
        from_text(to_text(mug).replace('"version": 1', '"version": 1, "version": 1'))


def test_too_many_parts(mug: Assembly, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("partwright.assembly.files.MAX_PARTS", 2)
    with pytest.raises(AssemblyFileError, match=r"children\[1\]: more than 2 parts"):
        from_text(to_text(mug))


def test_files_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    with pytest.raises(UnreadableFileError, match=r"a\.json"):
        load_assembly(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(AssemblyFileError, match="not UTF-8"):
        load_assembly(path)
    for name, data in (("a.obj", b"v 0 0 0\n"), ("a.ply", b"ply\n\xff\xfe\x00"), ("a.gltf", b"{}")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(AssemblyFileError, match="`partwright fit` makes of a shape"):
            load_assembly(tmp_path / name)
    path.write_bytes(b"")
    with pytest.raises(AssemblyFileError, match=r"a\.json: not complete JSON"):
        load_assembly(path)
    with path.open("wb") as stream:
        stream.truncate(MAX_BYTES + 1)
    with pytest.raises(AssemblyFileError, match="bytes; an assembly file has at most"):
        load_assembly(path)
