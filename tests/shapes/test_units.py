"""Lengths are told in a unit in which they can be read."""

from __future__ import annotations

import pytest

from partwright.shapes import length_text


@pytest.mark.parametrize(
    ("length", "unit", "text"),
    [
        (0.0002, "m", "0.2 mm"),
        (-0.01234, "m", "-12.3 mm"),
        (0.25, "m", "0.25 m"),
        (0.03, "cm", "0.3 mm"),
        (0.02, "mm", "0.02 mm"),
        (0.02, "in", "0.02 in"),
        (0.0, "m", "0 m"),
        (0.0002, None, "0.0002"),
    ],
)
def test_short_lengths_of_metres_are_told_in_millimetres(length: float, unit: str | None, text: str) -> None:
    assert length_text(length, unit) == text
