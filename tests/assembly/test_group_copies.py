"""Groups that are copies, in files: written once with a move each, read back as they were."""

from __future__ import annotations

import json
import math
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, copies_of, line, mirrored, ring
from partwright.assembly.file_text import to_text
from partwright.assembly.files import from_text
from partwright.errors import AssemblyFileError
from partwright.fields import Box, Cylinder, Extrusion, Profile
from tests.assembly.strategies import ASSEMBLIES, MOVES, SIMILARITIES
from tests.assembly.test_files import SCHEMA
from tests.assembly.test_repeated_groups import FOOT, RIB, table


@settings(max_examples=15, deadline=None)
@given(ASSEMBLIES, st.lists(MOVES, min_size=1, max_size=3), st.sampled_from(["x", "y", "z"]), SIMILARITIES)
def test_copies_and_images_come_back(group: Assembly, moves: list[Any], axis: str, whole: Any) -> None:
    copies = Assembly((group, *copies_of(group, moves)))
    assert from_text(to_text(copies)) == copies
    made = Assembly((*copies.children, mirrored(group, axis)))
    text = to_text(made)
    data = json.loads(text)
    jsonschema.validate(data, SCHEMA)
    assert len(data["children"]) == 1
    assert len(data["children"][0]["instances"]) == len(moves) + 1
    for one in (made, made.transformed(whole)):  # off by rounding, once
        text = to_text(one)
        loaded = from_text(text)
        assert to_text(loaded) == text
        for part, other in zip(one.parts, loaded.parts, strict=True):
            assert (part.field, part.name, part.blend) == (other.field, other.name, other.blend)
            np.testing.assert_allclose(part.translation, other.translation, atol=1e-10)


def test_each_group_is_in_the_file_once_also_within_others() -> None:
    pair = Assembly((RIB, *copies_of(RIB, line(2, (5, 0, 0)))), name="pair")
    wheel = Assembly((pair, *copies_of(pair, ring(3))), unit="mm")
    text = to_text(wheel)
    assert text.count('"kind"') == 2
    assert from_text(text) == wheel
    assert wheel["tip_02_03"].field == Box((2, 2, 2))


def test_a_file_of_copies_is_a_fraction_of_them_all() -> None:
    profile = Profile(((-2, 0), (2, 0), (1, 3, 0.2), (-1, 3)))
    tooth = Part(Extrusion(profile, 8), (0, 20, 0), name="tooth") - Part(
        Cylinder(0.5, 9), (0, 21, 0), name="hole"
    )
    group = Assembly((Part(Cylinder(20, 8), name="body"), tooth, *copies_of(tooth, ring(24))))
    assert len(to_text(group)) < 24 * len(to_text(tooth)) / 4
    assert from_text(to_text(group)) == group


def test_what_is_changed_alone_is_written_out() -> None:
    feet = (FOOT, *copies_of(FOOT, ring(4)))
    other = feet[2].replace_part("foot_03", Part(Cylinder(6, 10), (-30, -20.001, -5)))
    stand = Assembly((feet[0], feet[1], other, feet[3]))
    data = json.loads(to_text(stand))
    assert [len(child.get("instances", [])) for child in data["children"]] == [1, 0, 0]
    assert from_text(to_text(stand)) == stand
    told = Assembly((FOOT, Assembly(copies_of(FOOT, ring(2))[0].children, "difference", metadata={"a": 1})))
    assert from_text(to_text(told)) == told
    for operation in ("difference", "intersection"):  # of their first children no copies are made
        assert '"instances"' not in to_text(Assembly(feet[:2], operation))
    cut = Assembly((Part(Box((90, 90, 2)), name="plate"), *feet), "difference")
    assert to_text(cut).count('"kind"') == 3
    assert from_text(to_text(cut)) == cut


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (3, r"children\[1\].instances\[0\]: expected an object, got 3"),
        ({"mirror": "w"}, r'instances\[0\].mirror: expected x, y or z, got "w"'),
        ({"mirror": None}, r"instances\[0\].mirror: expected x, y or z, got null"),
        ({"mirror": []}, r"instances\[0\].mirror: expected x, y or z"),
        ({"names": ["a"]}, r"instances\[0\]: names: expected one for each of 2 parts, got 1"),
        ({"names": "ab"}, r"instances\[0\].names: expected a list of names"),
        ({"names": ["a", 3]}, r"instances\[0\]: name: expected at most"),
        ({"names": ["a", ""]}, r"instances\[0\].names\[1\]: expected a name"),
        ({"names": ["a", "plate"]}, r"instances\[0\].names\[1\]: expected a name that no other part has"),
        ({"translation": [0, 0]}, r"translation: expected 3 numbers"),
        ({"scale": 2}, r"instances\[0\].scale: unknown key"),
    ],
)
def test_broken_copies_are_refused_at_their_place(entry: Any, message: str) -> None:
    data = json.loads(to_text(table()))
    data["children"][1]["instances"] = [entry]
    with pytest.raises(AssemblyFileError, match=message):
        from_text(json.dumps(data))


def test_copies_where_there_are_none_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = json.loads(to_text(table()))
    for wrong, message in (
        ({"instances": []}, "instances: unknown key"),
        ({"operation": "intersection"}, "only groups"),
    ):
        with pytest.raises(AssemblyFileError, match=message):
            from_text(json.dumps(data | wrong))
    data["children"][1]["instances"] = {}
    with pytest.raises(AssemblyFileError, match="expected a list, got an object"):
        from_text(json.dumps(data))
    node: dict[str, Any] = {"name": "a", "field": {"kind": "sphere", "radius": 1}}
    monkeypatch.setattr("partwright.assembly.files.MAX_PARTS", 500)
    for _ in range(40):  # copies of copies: 2 ** 40 parts
        node = {"operation": "union", "children": [node], "instances": [{}]}
    data["children"] = [node]
    with pytest.raises(AssemblyFileError, match="more than 500 parts"):
        from_text(json.dumps(data))


def test_moves_are_the_plain_numbers_that_they_are() -> None:
    data = json.loads(to_text(table()))
    turns = [one["rotation"] for one in data["children"][1]["instances"]]
    assert turns[1] == [0, 0, 0, 1]
    assert turns[0] == pytest.approx([math.sqrt(0.5), 0, 0, math.sqrt(0.5)], abs=1e-15)
    assert [one["translation"] for one in data["children"][2]["instances"]] == [[12, 0, 0], [24, 0, 0]]
    image = json.loads(to_text(Assembly((table(), mirrored(table(), "y", 50)))))["children"][0]["instances"][
        0
    ]
    assert (image["mirror"], image["translation"], image["rotation"]) == ("y", [0, 100, 0], [1, 0, 0, 0])
