"""Features that explain too little to pay, but without which the surface is far off: they join all the same.

What a tree lacks and what it has too much are bodies, so how far each reaches from the other surface is known
at its corners, slivers between the samples included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold

from partwright.approximation.sketches.bodies import bodies
from partwright.meshing.manifolds import surface_of
from partwright.superfrusta.feature_steps import FeatureTree, with_open_ends_everywhere

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

FAR = 0.054
"""Unit lengths: 3 % of the longest side, by which nothing may be off."""
_MENDS = 8
_LEAST = 1e-7  # of the volume
_LOSS = 3e-4  # of R, that mending one place may cost


def mended(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree with further features, the farthest place first, until nothing is far off or can be mended;
    it knows how far it is off even so."""
    given_up: set[tuple[float, ...]] = set()
    pieces = far_pieces(search, tree)
    for _ in range(_MENDS):
        far = [one for one in pieces if _key(one[2]) not in given_up]
        if not far or len(tree.features) >= search.limit:
            break
        _, added, piece = max(far, key=lambda one: one[0])
        step = _with_best(search, tree, piece, added, [other for _, a, other in far if a is added])
        if step is None:
            given_up.add(_key(piece))
        else:
            tree = step
            pieces = far_pieces(search, tree)
    return replace(tree, off=_farthest(search, tree, [reach for reach, _, _ in pieces]))


def far_pieces(search: FeatureSearch, tree: FeatureTree) -> list[tuple[float, bool, Manifold]]:
    """Pieces that reach further than `FAR`: how far, whether they are to be added, and the piece."""
    found: list[tuple[float, bool, Manifold]] = []
    for added, residual in ((True, tree.missed), (False, tree.excess)):
        for _, piece in bodies(residual, _LEAST * search.volume, 0.0):
            corners = np.asarray(piece.to_mesh().vert_properties)[:, :3].astype(np.float32)
            off = tree.distance(corners) if added else search.samples.measure(corners)
            reach = float(off.max())
            if reach > FAR:
                found.append((reach, added, piece))
    return found


def _farthest(search: FeatureSearch, tree: FeatureTree, reaches: Sequence[float]) -> float:
    """How far the farthest of pieces reaches, unit lengths; 0 where none is further than `FAR`.

    Skins that a cut leaves of what it goes around are no pieces, and may be far off all the same; but over
    holes none is left, as those go on where they end in the open.
    """
    measure = search.samples.measure
    features = [f if f.added else with_open_ends_everywhere(f, measure, search.reach) for f in tree.features]
    corners = surface_of(FeatureTree(features).body())[0].astype(np.float32)
    skins = float(measure(corners).max()) if len(corners) else 0.0
    return max([*reaches, *([skins] if skins > FAR else [])], default=0.0)


def _with_best(
    search: FeatureSearch, tree: FeatureTree, piece: Manifold, added: bool, alike: list[Manifold]
) -> FeatureTree | None:
    """The tree and the candidate that takes the most of a piece, of those that cost hardly anything."""
    best: tuple[float, FeatureTree] | None = None
    for candidate in search.candidates_of(piece):
        if added and candidate.beyond:
            continue
        _, outer = candidate.bodies
        left = float((piece - outer).volume()) / float(piece.volume())
        if left > 0.5 or (best is not None and left >= best[0]):
            continue
        step = search.extended(tree, candidate, added, alike)
        if step.score >= tree.score - _LOSS:
            best = left, step
    return best[1] if best is not None else None


def _key(piece: Manifold) -> tuple[float, ...]:
    return tuple(np.round([*piece.bounding_box(), piece.volume()], 4).tolist())
