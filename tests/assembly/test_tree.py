"""Names, edits, operators and checks of parts and assemblies."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.names import unique_names
from partwright.assembly.parts_from_rows import parts_from_rows
from partwright.assembly.rows import rows
from partwright.errors import ParameterError
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum
from tests.assembly.strategies import ASSEMBLIES, PARTS, SIMILARITIES

BALL = Part(Sphere(1.0), name="ball")


def _similarity(part: Part) -> Similarity:
    return Similarity(1.0, part.rotation, part.translation)


def names(assembly: Assembly) -> list[str]:
    return [part.name for part in assembly.parts]


def test_unnamed_parts_are_named_after_their_kind() -> None:
    frustum = Part(SuperFrustum((1, 1, 1)))
    assembly = Assembly((frustum, Part(Cylinder(1, 1)), frustum, Assembly((frustum, Part(Box((1, 1, 1)))))))
    assert names(assembly) == ["part_02", "cylinder_01", "part_03", "part_01", "box_01"]


def test_given_names_win_over_numbered_ones() -> None:
    assert unique_names(["", "part_01", "leg", "leg", ""], ["part"] * 5) == [
        "part_02", "part_01", "leg", "leg_02", "part_03",
    ]  # fmt: skip


@settings(max_examples=60)
@given(ASSEMBLIES)
def test_leaf_names_are_unique_and_stay(assembly: Assembly) -> None:
    assert all(names(assembly))
    assert len(set(names(assembly))) == len(assembly) == len(assembly.parts)
    assert names(Assembly((assembly,))) == names(assembly)


def test_operators_continue_an_unnamed_fold() -> None:
    a, b, c = (Part(Sphere(1.0), name=name) for name in "abc")
    assert (a | b | c) == Assembly((a, b, c))
    assert (a - b - c) == Assembly((a, b, c), "difference")
    assert (a & (b | c)) == Assembly((a, Assembly((b, c))), "intersection")
    assert (Assembly((a, b), name="pair") | c).children[0].name == "pair"


def test_operators_refuse_two_units() -> None:
    with pytest.raises(ParameterError, match="unit"):
        Assembly((BALL,), unit="mm") | Assembly((BALL,), unit="m")
    assert (Assembly((BALL,), unit="mm") | BALL).unit == "mm"


def test_edits_leave_the_original_alone(mug: Assembly) -> None:
    assert names(mug) == ["body", "handle", "cavity"]
    assert names(mug.renamed("handle", "grip")) == ["body", "grip", "cavity"]
    assert names(mug.without("handle")) == ["body", "cavity"]
    replaced = mug.replace_part("handle", Part(Sphere(0.1)))
    assert names(replaced) == names(mug)
    assert replaced["handle"].field == Sphere(0.1)
    assert names(mug) == ["body", "handle", "cavity"]
    assert mug.without("handle").unit == "mm"


def test_edits_that_cannot_be(mug: Assembly) -> None:
    with pytest.raises(ParameterError, match="no part is named 'lid'; the names are: body, handle, cavity"):
        mug.without("lid")
    with pytest.raises(ParameterError, match="already there"):
        mug.renamed("handle", "body")
    with pytest.raises(ParameterError, match="nothing would be left"):
        Assembly((BALL,)).without("ball")
    with pytest.raises(ParameterError, match="nothing would be left"):
        (BALL - Part(Sphere(0.5), name="hole")).without("ball")


@settings(max_examples=40)
@given(SIMILARITIES, SIMILARITIES, PARTS)
def test_similarities_form_a_group(a: Similarity, b: Similarity, part: Part) -> None:
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert np.allclose((a @ b)(points), a(b(points)))
    assert np.allclose(a.inverse()(a(points)), points)
    assert np.allclose(Similarity.from_matrix(a.matrix())(points), a(points))
    once, twice = (part.transformed(a @ b), part.transformed(b).transformed(a))
    for p, q in zip(once.copies, twice.copies, strict=True):  # the rotation's sign means nothing
        assert np.allclose(_similarity(p).matrix(), _similarity(q).matrix())
        assert np.allclose(rows([p])[0, 7:], rows([q])[0, 7:])


def test_matrices_that_are_no_similarity() -> None:
    for diagonal in ([1, 2, 1, 1], [-1, 1, 1, 1], [0, 0, 0, 1]):
        with pytest.raises(ParameterError, match="shears, mirrors or scales"):
            Similarity.from_matrix(np.diag(diagonal))


@settings(max_examples=40)
@given(PARTS)
def test_rows_round_trip(part: Part) -> None:
    back, *copies = parts_from_rows(rows([part]))
    assert len(copies) == len(part.instances)
    assert (back.field, back.blend) == (part.field.superfrustum(), part.blend)
    assert back.translation == part.translation
    assert back.rotation == part.rotation


def test_float32_rows_keep_short_decimals() -> None:
    row = np.array([[0.1, 0, 0, 1, 0, 0, 0, 0.3, 0.3, 0.3, 0.7, 0, 1, 0, 0, 0.01]], dtype=np.float32)
    part = parts_from_rows(row)[0]
    assert (part.translation[0], part.field.size, part.blend) == (0.1, (0.3, 0.3, 0.3), 0.01)


def test_assemblies_can_be_sent_to_other_processes(mug: Assembly) -> None:
    mug.distance(np.zeros((1, 3)))
    assert pickle.loads(pickle.dumps(mug)) == mug


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"translation": (0, float("nan"), 0)}, r"translation\[1\]: expected a finite number, got nan"),
        ({"translation": 3}, "translation: expected 3 numbers"),
        ({"rotation": (0, 0, 0, 0)}, "is no rotation"),
        ({"blend": -0.1}, "blend: expected a number of at least 0, got -0.1"),
        ({"name": "a\nb"}, "name: expected at most 200 printable characters"),
        ({"metadata": {"a": [1]}}, r"metadata\['a'\]: expected a string or a number"),
        ({"field": 3}, "field: expected a field such as SuperFrustum, got 3"),
    ],
)
def test_parts_check_themselves(arguments: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Part(**({"field": Sphere(1.0)} | arguments))


def test_assemblies_check_themselves() -> None:
    with pytest.raises(ParameterError, match="at least one part"):
        Assembly(())
    with pytest.raises(ParameterError, match="operation: expected one of union"):
        Assembly((BALL,), "xor")
    with pytest.raises(ParameterError, match="expected parts and assemblies, got Sphere"):
        Assembly((Sphere(1.0),))
    deep = Assembly((BALL,))
    for _ in range(63):
        deep = Assembly((deep,))
    with pytest.raises(ParameterError, match="64 deep"):
        Assembly((deep,))
