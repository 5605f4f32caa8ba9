"""Parts are matched across a family whatever their order, and whatever pieces a shape has them in."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.datasets.matching import PRICE, Regions, match, regions_of
from partwright.errors import FamilyError

TOP, BACK = 4, 5  # after four legs
PLAIN = np.array([
    [0.0, 0.0, 0.0, 0.1, 0.1, 0.4], [0.9, 0.0, 0.0, 1.0, 0.1, 0.4], [0.0, 0.9, 0.0, 0.1, 1.0, 0.4],
    [0.9, 0.9, 0.0, 1.0, 1.0, 0.4], [0.0, 0.0, 0.4, 1.0, 1.0, 0.5], [0.0, 0.9, 0.5, 1.0, 1.0, 1.0],
])  # fmt: skip
POSTS = np.array(
    [[0.0, 0.9, 0.5, 0.1, 1.0, 1.0], [0.9, 0.9, 0.5, 1.0, 1.0, 1.0], [0.1, 0.9, 0.8, 0.9, 1.0, 1.0]]
)
AREAS = np.array([0.05, 0.05, 0.05, 0.05, 0.5, 0.3])


def chair(seed: int, posts: bool = False, missing: int | None = None) -> tuple[Regions, np.ndarray]:
    """Its regions in any order, a little off, and which part each is."""
    rng = np.random.default_rng(seed)
    boxes, areas, part = PLAIN, AREAS, np.arange(6)
    if posts:
        boxes = np.concatenate([PLAIN[:BACK], POSTS])
        areas, part = np.append(AREAS[:BACK], [0.1, 0.1, 0.1]), np.array([0, 1, 2, 3, TOP, BACK, BACK, BACK])
    if missing is not None:
        boxes, areas, part = (np.delete(rows, missing, axis=0) for rows in (boxes, areas, part))
    order = rng.permutation(len(boxes))
    boxes = boxes + rng.uniform(-0.02, 0.02, boxes.shape)
    return Regions(boxes[order], areas[order] / areas.sum()), part[order]


def found_as(shapes: list[tuple[Regions, np.ndarray]], **options: object) -> list[set[tuple[int, int]]]:
    """Of each shape, which slot goes with which part."""
    made = match([one for one, _ in shapes], **options)  # type: ignore[arg-type]
    assert made.filled.shape == (len(made.slots),)
    return [
        set(zip(of.tolist(), part.tolist(), strict=True))
        for of, (_, part) in zip(made.of, shapes, strict=True)
    ]


def one_to_one(pairs: set[tuple[int, int]]) -> bool:
    return len(pairs) == len({slot for slot, _ in pairs}) == len({part for _, part in pairs})


def test_parts_in_any_order_are_the_same_slots_in_all_shapes() -> None:
    every = found_as([chair(i) for i in range(6)])
    assert len(set.union(*every)) == 6
    assert one_to_one(set.union(*every))


def test_a_missing_part_leaves_its_slot_empty() -> None:
    shapes = [chair(i, missing=BACK if i < 2 else None) for i in range(6)]
    every = found_as(shapes)
    assert one_to_one(set.union(*every))
    made = match([one for one, _ in shapes])
    assert sorted(made.filled.tolist()) == pytest.approx([4 / 6, 1, 1, 1, 1, 1])
    assert made.cost < 0.3 * PRICE


@pytest.mark.parametrize("posts", [2, 3, 4])
def test_posts_and_rail_are_a_back_where_other_shapes_have_one(posts: int) -> None:
    """However many shapes have it in three pieces, they are one slot with those that have it whole."""
    every = found_as([chair(i, posts=i < posts) for i in range(6)])
    assert len(set.union(*every)) == 6
    assert one_to_one(set.union(*every))


def test_no_single_shape_is_the_template() -> None:
    """The first shape lacks the back and has a top in two halves: as a template it tells no more."""
    odd, part = chair(0, missing=BACK)
    top = int(np.flatnonzero(part == TOP)[0])
    left, right = odd.boxes[top].copy(), odd.boxes[top].copy()
    left[3], right[0] = 0.5, 0.5
    boxes = np.concatenate([np.delete(odd.boxes, top, axis=0), [left, right]])
    areas = np.append(np.delete(odd.areas, top), [odd.areas[top] / 2] * 2)
    first = (Regions(boxes, areas), np.append(np.delete(part, top), [TOP, TOP]))
    shapes = [first, *(chair(i) for i in range(1, 6))]
    assert one_to_one(set.union(*found_as(shapes)))
    assert not one_to_one(set.union(*found_as(shapes, template=0)))


def test_regions_are_boxes_in_the_shape_and_shares_of_its_surface() -> None:
    vertices = np.array([[0, 0, 0], [4, 0, 0], [0, 2, 0], [4, 2, 0], [0, 0, 10]], float)
    faces = np.array([[0, 1, 2], [1, 3, 2], [0, 1, 4]])
    made = regions_of(vertices, faces, np.array([0, 0, 2]), 3)
    np.testing.assert_allclose(made.boxes[0], [0, 0, 0, 1, 1, 0])
    np.testing.assert_allclose(made.boxes[2], [0, 0, 0, 1, 0, 1])
    np.testing.assert_allclose(made.areas, [8 / 28, 0, 20 / 28])


def test_shapes_that_have_nothing_alike_are_refused() -> None:
    with pytest.raises(FamilyError, match="1 shapes: at least two"):
        match([chair(0)[0]])
    far = Regions(np.array([[0.0, 0, 0, 0.1, 0.1, 0.1]]), np.array([1.0]))
    wide = Regions(np.array([[0.0, 0, 0, 1.0, 1.0, 1.0]]), np.array([1.0]))
    with pytest.raises(FamilyError, match="no part is alike in enough of the shapes"):
        match([far, wide])
