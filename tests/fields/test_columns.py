"""The names of columns, and the kernel's signatures, are those that the compiled kernel has."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

import partwright
from partwright import _kernel
from partwright.fields import columns
from partwright.fields.columns import Column, Tangent

STUB = ast.parse((Path(partwright.__file__).parent / "_kernel.pyi").read_text())
FUNCTIONS = {node.name: node for node in STUB.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("table", [Column, Tangent])
def test_the_stub_names_the_columns_that_the_kernel_has(table: type[Column] | type[Tangent]) -> None:
    (declared,) = (
        node for node in STUB.body if isinstance(node, ast.ClassDef) and node.name == table.__name__
    )
    entries = {ast.unparse(line.targets[0]): ast.literal_eval(line.value) for line in declared.body}
    assert entries == {entry.name: entry.value for entry in table}


def test_the_stub_declares_every_function_of_the_kernel() -> None:
    assert set(FUNCTIONS) == {name for name, _ in inspect.getmembers(_kernel, callable) if name[0].islower()}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_the_kernel_name_their_arguments_and_say_what_they_do(name: str) -> None:
    ((signature, doc, *_),) = getattr(_kernel, name).__nb_signature__
    assert re.findall(r"(\w+): ", signature) == [argument.arg for argument in FUNCTIONS[name].args.args]
    assert doc


def test_blocks_of_columns_fill_a_row_and_a_step() -> None:
    row, step = list(Column), list(Tangent)
    pose, shape = row[columns.POSE], row[columns.SHAPE]
    assert pose == [*row[columns.TRANSLATION], *row[columns.ROTATION]]
    assert shape == [*row[columns.SIZE], *row[columns.PROPORTIONS], Column.BLEND]
    assert [*pose, *shape, Column.SIGN] == row
    assert [*step[columns.POSE_STEP], *step[columns.SHAPE_STEP]] == step
    assert step[columns.POSE_STEP] == [*step[columns.TRANSLATION_STEP], *step[columns.ROTATION_STEP]]


def test_a_step_adds_to_the_columns_of_the_same_name() -> None:
    pairs = ((columns.SHAPE, columns.SHAPE_STEP), (columns.TRANSLATION, columns.TRANSLATION_STEP))
    for block, entries in pairs:
        assert [c.name for c in list(Column)[block]] == [t.name for t in list(Tangent)[entries]]
