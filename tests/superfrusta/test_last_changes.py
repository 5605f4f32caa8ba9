"""Parts that change in the end, where they are furthest off."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from partwright.fields.columns import Column
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings, last_polish
from partwright.superfrusta import last_changes as last_changes_module
from partwright.superfrusta.close_look import CloseLook
from partwright.superfrusta.last_changes import _State as State
from partwright.superfrusta.last_changes import last_changes
from partwright.superfrusta.last_polish import Polish
from partwright.superfrusta.mending import Mending
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded
from partwright.superfrusta.symmetry import Isometry
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row

SETTINGS = dataclasses.replace(Settings.for_quality("draft"), looks=24, changes=6)
BODY, TAB = ((1.4, 0.8, 0.5), (-0.2, 0.0, 0.0)), ((0.4, 0.2, 0.3), (0.7, 0.0, 0.0))
MIRROR = Isometry(np.diag([-1.0, 1.0, 1.0]), np.zeros(3))

Leaves = list[RepeatedPart]


def plain(*boxes: tuple[tuple[float, ...], tuple[float, ...]]) -> Leaves:
    return [RepeatedPart(box_row(*one)) for one in boxes]


def changed(shape: Shape, leaves: Leaves, moving: list[bool] | None = None, **changes: object) -> Leaves:
    settings = dataclasses.replace(SETTINGS, **changes)
    where = np.ones(len(leaves), bool) if moving is None else np.array(moving)
    for better in last_changes(shape, FitSamples.of(shape, settings), leaves, settings, where):
        leaves = better
    return leaves


def off(shape: Shape, leaves: Leaves) -> float:
    return CloseLook.at(shape, FitSamples.of(shape, SETTINGS)).deviations(expanded(leaves)).norm


@pytest.fixture(scope="module")
def notched() -> Shape:
    """A body with a slot across its top, that a box goes past by a tenth of the longest side."""
    whole = trimesh.creation.box((1.8, 0.8, 0.5))
    slot = trimesh.creation.box((0.2, 2.0, 0.4))
    slot.apply_translation((0.3, 0, 0.25))
    return load_shape(trimesh.boolean.difference([whole, slot]))


@pytest.fixture(scope="module")
def tabbed() -> Shape:
    return load_shape(union(box(*BODY), box(*TAB)))


def test_what_is_covered_is_cut_unless_that_is_forbidden(notched: Shape) -> None:
    before = plain(((1.8, 0.8, 0.5), (0.0, 0.0, 0.0)))
    after = changed(notched, before)
    assert [leaf.row[Column.SIGN] for leaf in after] == [1, -1]
    assert off(notched, after) < 0.3 * off(notched, before)
    assert all(leaf.row[Column.SIGN] > 0 for leaf in changed(notched, before, subtract=False))


def test_what_glares_is_worth_several_parts(notched: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    before = plain(((1.8, 0.8, 0.5), (0.0, 0.0, 0.0)))
    assert len(changed(notched, before, alpha=0.28)) == 2
    monkeypatch.setattr(last_polish, "_GLARES", 0.0)
    assert changed(notched, before, alpha=0.28) is before


def test_pockets_that_are_as_deep_are_cut_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """While one is left, the others gain little: what is furthest off stays as far."""
    monkeypatch.setattr(last_polish, "_GLARES", 0.0)
    places = [(-0.5, 0.2), (0.1, -0.15), (0.6, 0.1)]
    pockets = [box((0.14, 0.1 + 0.05 * i, 0.3), (*place, 0.25)) for i, place in enumerate(places)]
    shape = load_shape(trimesh.boolean.difference([trimesh.creation.box((1.8, 0.8, 0.5)), *pockets]))
    before = plain(((1.8, 0.8, 0.5), (0.0, 0.0, 0.0)))
    after = changed(shape, before, alpha=0.03)
    assert [leaf.row[Column.SIGN] for leaf in after] == [1, -1, -1, -1]
    assert off(shape, after) < 0.3 * off(shape, before)
    monkeypatch.setattr(last_changes_module, "_TOGETHER", 1)
    assert len(changed(shape, before, alpha=0.03)) < len(after)


def test_where_no_way_is_known_others_of_the_part_are_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The deeper of two slots finds no cut; the other is cut none the less."""
    slots = [box((0.2, 2.0, depth), (x, 0.0, 0.25 - depth / 2)) for x, depth in ((-0.5, 0.3), (0.5, 0.2))]
    shape = load_shape(trimesh.boolean.difference([trimesh.creation.box((1.8, 0.8, 0.5)), *slots]))
    cuts, asked = last_changes_module._LastChanges.cuts, []

    def only_right(self: object, best: State, worst: int) -> list[np.ndarray]:
        asked.append(best.trial.off.points[worst][0])
        return cuts(self, best, worst) if asked[-1] > 0 else []

    monkeypatch.setattr(last_changes_module._LastChanges, "cuts", only_right)
    after = changed(shape, plain(((1.8, 0.8, 0.5), (0.0, 0.0, 0.0))))
    assert asked[0] < 0
    assert [leaf.row[Column.SIGN] for leaf in after] == [1, -1]
    assert after[1].row[Column.TX] == pytest.approx(0.5, abs=0.03)


def test_what_is_missing_is_added_within_a_budget(tabbed: Shape) -> None:
    after = changed(tabbed, plain(BODY))
    assert len(after) == 2
    assert off(tabbed, after) < 0.3 * off(tabbed, plain(BODY))
    assert len(changed(tabbed, plain(BODY), max_parts=1)) == 1


def test_what_is_missing_is_found_in_its_own_place(tabbed: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all that is missing is one region too many, as it may go all around the assembly."""
    monkeypatch.setattr(Mending, "missed", lambda *_: [])
    after = changed(tabbed, plain(BODY))
    assert len(after) == 2
    assert off(tabbed, after) < 0.3 * off(tabbed, plain(BODY))


def test_of_new_parts_one_that_sticks_out_is_not_taken(
    tabbed: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    far, near = box_row((0.5, 0.1, 0.9), (0.7, 0.0, 0.0)), box_row(*TAB)
    monkeypatch.setattr(last_changes_module._LastChanges, "fills", lambda *_: np.array([far, near]))
    after = changed(tabbed, plain(BODY), looks=0)
    assert after[1].row[Column.SX : Column.SZ + 1] == pytest.approx(TAB[0], abs=0.05)


def test_what_is_missing_on_both_sides_is_one_part_with_copies() -> None:
    ears = [((0.2, 0.2, 0.3), (x, 0.0, 0.0)) for x in (-0.8, 0.8)]
    feet = [((0.2, 0.8, 0.2), (x, 0.0, -0.3)) for x in (-0.5, 0.5)]
    middle = ((1.4, 0.8, 0.5), (0.0, 0.0, 0.0))
    shape = load_shape(union(*(box(*one) for one in [middle, *ears, *feet])))
    up = np.array(shape.frame.to_unit(np.zeros((1, 3))))[0]
    feet_row = box_row((0.2, 0.8, 0.2), tuple(np.array((0.5, 0.0, -0.3)) + up))
    before = [RepeatedPart(box_row((1.4, 0.8, 0.5), tuple(up))), RepeatedPart(feet_row, (MIRROR,))]
    after = changed(shape, before)
    assert [len(leaf.isometries) for leaf in after] == [0, 1, 1]
    assert off(shape, after) < 0.3 * off(shape, before)


def test_what_nobody_would_miss_goes(tabbed: Shape) -> None:
    within = ((0.5, 0.4, 0.3), (-0.3, 0.0, 0.0))
    samples = FitSamples.of(tabbed, SETTINGS)
    after = changed(tabbed, plain(BODY, TAB, within))
    assert len(after) == 2
    assert score(samples, expanded(after)) > score(samples, expanded(plain(BODY, TAB))) - 0.003


def test_a_part_of_the_wrong_kind_is_fitted_anew() -> None:
    shape = load_shape(trimesh.creation.cylinder(0.5, 1.8, sections=64))
    before = plain(((0.86, 0.86, 1.76), (0.0, 0.0, 0.0)))
    after = changed(shape, before, looks=1)
    assert len(after) == 1
    assert after[0].row[Column.ROUNDNESS] > 0.9
    assert off(shape, after) < 0.3 * off(shape, before)


def test_what_is_locked_or_last_stays(tabbed: Shape) -> None:
    before = plain(BODY, ((0.3, 0.3, 0.3), (-0.4, 0.0, 0.0)), ((0.1, 0.1, 0.1), (-0.6, 0.0, 0.0)))
    after = changed(tabbed, before, [True, False, False])
    assert (after[-2].row == before[1].row).all()
    assert (after[-1].row == before[2].row).all()
    assert len(after) == 4
    locked = changed(tabbed, before[:2][::-1], [False, True])
    assert (locked[0].row == before[1].row).all()


def test_nothing_changes_where_none_is_to_or_an_iou_is_asked_for(tabbed: Shape) -> None:
    before = plain(BODY)
    assert changed(tabbed, before, changes=0) is before
    assert changed(tabbed, before, min_iou=0.5) is before
    assert changed(tabbed, before, [False]) is before


def test_an_exact_assembly_stays(tabbed: Shape) -> None:
    before = plain(BODY, TAB)
    assert changed(tabbed, before) is before


def test_the_same_again(tabbed: Shape) -> None:
    one, other = (changed(tabbed, plain(BODY)) for _ in range(2))
    assert (expanded(one) == expanded(other)).all()


def test_lengths_are_not_bought_with_parts_that_cover_one_another(
    tabbed: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = plain(BODY)
    monkeypatch.setattr(Polish, "overlap", lambda self, rows: len(rows) / 10)
    assert changed(tabbed, before) is before
