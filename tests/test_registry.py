from __future__ import annotations

import math
from importlib.metadata import EntryPoint

import pytest

from partwright import registry
from partwright.errors import SettingError
from partwright.registry import Registry


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> Registry[object]:
    """Two names of our own, and two of an installed package, one of which is taken already."""
    added = (EntryPoint("half", "math:tau", "group"), EntryPoint("root", "math:isqrt", "group"))
    monkeypatch.setattr(registry, "_installed", lambda group: added if group == "numbers" else ())
    return Registry("number", "numbers", {"pi": "math:pi", "half": "math:e"})


def test_names_are_the_projects_own_and_then_what_is_installed(table: Registry[object]) -> None:
    assert list(table) == ["pi", "half", "root"]
    assert len(table) == 3
    assert table.own == ("pi", "half")
    assert "root" in table
    assert "pie" not in table


def test_a_name_is_imported_when_asked_for_and_none_of_ours_is_replaced(table: Registry[object]) -> None:
    assert table["pi"] == math.pi
    assert table["root"] is math.isqrt
    assert table["half"] == math.e


def test_an_unknown_name_is_a_setting_error_that_lists_the_names_and_the_nearest(
    table: Registry[object],
) -> None:
    with pytest.raises(SettingError, match=r"unknown number 'hall'.* pi, half, root; did you mean 'half'"):
        table["hall"]


def test_own_names_need_no_look_at_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def look(group: str) -> tuple[EntryPoint, ...]:
        raise AssertionError("looked")

    monkeypatch.setattr(registry, "_installed", look)
    table: Registry[float] = Registry("number", "numbers", {"pi": "math:pi"})
    assert table["pi"] == math.pi
    assert table.own == ("pi",)
    assert "pi" in table
