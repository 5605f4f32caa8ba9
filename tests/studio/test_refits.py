"""Refits keep what is locked, copies and all, and the names of what they change."""

from __future__ import annotations

import dataclasses

import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import SettingError
from partwright.fields import Box, Frustum
from partwright.meshing import mesh_assembly
from partwright.methods import Cancellation
from partwright.metrics import evaluate
from partwright.shapes import load_shape
from partwright.studio.fits import fitting
from partwright.studio.messages import Fit
from partwright.studio.refits import Refit

MOVES = (Similarity(translation=(0, 240, 0)), Similarity(translation=(240, 0, 0)))
STOOL = Assembly(
    (
        Part(Box((340, 340, 40)), (120, 120, 430), name="seat", metadata={"colour": "#ff0000"}),
        Part(Frustum(20, 24, 420), (0, 0, 210), name="leg", instances=MOVES),
    ),
    unit="mm",
    up="z",
)


def asked(mode: str, *names: str) -> Fit:
    return Fit(mode, list(names), "solids", "draft")  # type: ignore[arg-type]


@pytest.mark.parametrize(("mode", "names"), [("only", ("seat",)), ("except", ("leg",))])
def test_a_seat_is_refitted_beside_legs_that_are_copies(mode: str, names: tuple[str, ...]) -> None:
    shape = load_shape(mesh_assembly(STOOL, 64), unit="mm")
    low = dataclasses.replace(STOOL["seat"], translation=(120, 120, 450), field=Box((300, 340, 40)))
    wrong = STOOL.replace_part("seat", low)
    task = fitting(shape, asked(mode, *names), lambda: wrong)
    assert task.label == "Refit seat"
    done = task.work(lambda step: None, Cancellation()).assembly
    assert {part.name for part in done.parts} == {"seat", "leg"}
    assert done["leg"] == STOOL["leg"]
    assert done["seat"].metadata["colour"] == "#ff0000"
    assert evaluate(done, shape, emd=False).iou > 0.97 > evaluate(wrong, shape, emd=False).iou


def test_what_is_all_locked_is_refused() -> None:
    with pytest.raises(SettingError, match="every part is locked"):
        Refit.of(STOOL, asked("except", "leg", "seat"))
    with pytest.raises(SettingError, match="every part is locked"):
        Refit.of(STOOL, asked("only", "arm"))


def test_parts_that_change_places_change_names_too() -> None:
    one, two = Part(Box((1, 1, 1)), name="one"), Part(Box((1, 1, 1)), (5, 0, 0), name="two")
    refit = Refit.of(Assembly((one, two)), asked("only", "one", "two"))
    fitted = Assembly((dataclasses.replace(two, name="part_01"), dataclasses.replace(one, name="part_02")))
    restored = refit.restored(fitted)
    assert [part.name for part in restored.parts] == ["two", "one"]
    assert restored["one"].translation == (0, 0, 0)
