"""What is near is looked for no farther than it takes, to the same numbers as by looking everywhere."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree

from partwright.partsdf.model import Model
from partwright.partsdf.nearness import edges_of, from_others, longest_bridge
from partwright.partsdf.neural import NeuralShape
from partwright.shapes.topology import components


def by_all_pairs(clouds: list[np.ndarray]) -> tuple[float, int, int]:
    apart = np.zeros((len(clouds), len(clouds)))
    for i, cloud in enumerate(clouds):
        for j in range(i):
            apart[i, j] = cKDTree(clouds[j]).query(cloud)[0].min()
    joined = minimum_spanning_tree(apart).toarray()
    i, j = np.unravel_index(joined.argmax(), joined.shape)
    return float(joined[i, j]), int(i), int(j)


@pytest.mark.parametrize("seed", range(6))
def test_the_longest_bridge_is_that_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clouds = [
        rng.uniform(-1, 1, 3) + rng.uniform(0.05, 0.4) * rng.normal(size=(rng.integers(3, 400), 3))
        for _ in range(rng.integers(2, 14))
    ]
    length, i, j = longest_bridge(clouds)
    expected, one, other = by_all_pairs(clouds)
    assert length == expected
    assert {i, j} == {one, other}
    assert i > j


def test_pieces_that_touch_in_a_point_are_at_no_distance() -> None:
    """SciPy's tree has no edge for them, and takes another."""
    points = [[[0.0, 0, 0], [1, 0, 0]], [[1, 0, 0], [2, 0, 0]], [[2.5, 0, 0], [3, 0, 0]]]
    assert longest_bridge([np.array(cloud) for cloud in points]) == (0.5, 2, 1)


def test_edges_and_pieces_are_those_of_trimesh() -> None:
    ball = trimesh.creation.icosphere(2)
    two = trimesh.util.concatenate([ball, ball.copy().apply_translation((3, 0, 0))])
    mine = set(map(tuple, edges_of(two).tolist()))
    assert mine == set(map(tuple, np.sort(two.edges_unique, axis=1).tolist()))
    piece = components(len(two.vertices), *edges_of(two).T)
    assert len(set(piece)) == two.body_count == 2
    assert len(set(piece[: len(ball.vertices)])) == 1


def test_one_pass_tells_how_far_each_part_is_from_the_others(model: Model) -> None:
    shape = NeuralShape.trained(model, "lamp0")
    rng = np.random.default_rng(0)
    parts = {name: trimesh.Trimesh(rng.uniform(-1, 1, (40, 3)), process=False) for name in shape.names()[1:]}
    found = from_others(shape, parts)
    assert list(found) == list(parts)
    for number, name in enumerate(shape.names()):
        if name in parts:
            each = shape.part_distances(np.asarray(parts[name].vertices))
            expected = np.delete(each, number, axis=0).min(axis=0)
            np.testing.assert_allclose(found[name], expected, atol=1e-6)
    assert from_others(shape, {}) == {}
