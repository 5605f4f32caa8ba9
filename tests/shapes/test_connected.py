"""Components of the compiled kernel against those of SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from partwright._kernel import connected


@given(seed=st.integers(0, 10_000), nodes=st.integers(1, 60), groups=st.integers(0, 60))
def test_components_are_those_of_scipy_and_numbered_like_them(seed: int, nodes: int, groups: int) -> None:
    faces = np.random.default_rng(seed).integers(0, nodes, (groups, 3))
    ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    graph = coo_array((np.ones(3 * groups, bool), ends), shape=(nodes, nodes))
    np.testing.assert_array_equal(connected(faces, nodes), connected_components(graph, directed=False)[1])
