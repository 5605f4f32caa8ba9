"""Names of fitted parts say form and place, and stay when the same parts are met in another order."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Similarity
from partwright.fields.columns import Column
from partwright.superfrusta.part_names import form, part_names
from tests.superfrusta.rows import row

SIDES = np.array([1.8, 1.8, 1.8])
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def part(
    size: tuple[float, float, float], place: tuple[float, float, float] = (0, 0, 0), **shape: float
) -> np.ndarray:
    return row(place, UPRIGHT, size, **shape)


@pytest.mark.parametrize(
    ("name", "one"),
    [
        ("block", part((0.5, 0.5, 0.6))),
        ("plate", part((1.0, 0.8, 0.05))),
        ("plate", part((0.05, 0.8, 1.0))),
        ("disc", part((0.9, 0.9, 0.1), roundness=1.0)),
        ("drum", part((0.5, 0.5, 0.6), roundness=1.0)),
        ("rod", part((0.1, 0.1, 1.0), roundness=1.0)),
        ("bar", part((0.1, 0.1, 1.0))),
        ("ring", part((0.9, 0.9, 0.2), roundness=1.0, onion=0.8)),
        ("tube", part((0.3, 0.3, 0.9), roundness=1.0, onion=0.8)),
        ("cone", part((0.6, 0.6, 0.8), roundness=1.0, taper=0.1)),
        ("wedge", part((0.6, 0.6, 0.8), taper=0.1)),
        ("arc", part((0.1, 0.1, 0.8), roundness=1.0, bulge=0.8)),
        ("ball", part((0.02, 0.02, 0.02), dilation=0.2)),
    ],
)
def test_forms(name: str, one: np.ndarray) -> None:
    assert form(one) == name


@pytest.mark.parametrize(("name", "roundness"), [("hole", 1.0), ("cut", 0.0)])
def test_what_is_subtracted(name: str, roundness: float) -> None:
    one = part((0.2, 0.2, 0.6), roundness=roundness)
    one[Column.SIGN] = -1
    assert form(one) == name


def test_places_and_twins() -> None:
    rows = np.stack(
        [part((0.4, 0.4, 0.4), at) for at in ((0, 0, 0.8), (-0.8, -0.8, 0), (0.1, 0.1, 0.8), (0.0, 0.0, 0.0))]
    )
    names = part_names(rows, SIDES, "z")
    assert names == ["block_upper", "block_front_left", "block_upper_02", "block_middle"]
    turned = part_names(rows[[3, 1, 0, 2]], SIDES, "z")
    assert turned == ["block_middle", "block_front_left", "block_upper", "block_upper_02"]


def test_a_part_with_copies_is_called_by_what_their_places_share() -> None:
    rows = np.stack([part((0.1, 0.1, 0.6), at, roundness=1.0) for at in ((-0.8, -0.8, -0.8), (-0.8, 0, 0))])
    across = Similarity(translation=(1.6, 0, 0))
    legs = (across, Similarity(translation=(0, 1.6, 0)), Similarity(translation=(1.6, 1.6, 0)))
    assert part_names(rows, SIDES, "z", moves=[legs, (across,)]) == ["rod_lower", "rod_both_sides"]
    assert part_names(rows[1:], SIDES, "z", moves=[(across, across)]) == ["rod_all_around"]


def test_fixed_names_stay_and_are_not_given_again() -> None:
    rows = np.stack([part((0.4, 0.4, 0.4)), part((0.4, 0.4, 0.4))])
    assert part_names(rows, SIDES, None, ["block_middle"]) == ["block_middle", "block_middle_02"]
