"""What a piece of a shape may be drawn as: one that a tree lacks, or has too much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import candidates, silhouettes
from partwright.approximation.sketches.directions import frames, long_axis
from partwright.approximation.sketches.pipe_paths import pipe_candidates

Frames = Sequence[NDArray[np.float64]]

_MOST = 150  # pieces that are looked at: a part of hundreds is no part that was drawn
_OWN, _ASKEW = 2, 0.9995  # directions of a piece, and the cosine to others that a new one has at most
_PLAIN = 4  # sides at most of what a piece is seen as from end to end
_SAME = 0.9  # IoU of a piece and what it can be drawn as by itself
_ALIKE = 0.6  # IoU of a piece and what is drawn along it where no face says so


class PieceCandidates:
    """Candidates of each piece, made once: along the frames (3, 3) of the whole, and along its own. Where
    none is the same body, also as it is seen along its own, from end to end: a corner of a block is cut off
    so."""

    def __init__(self, whole: Frames) -> None:
        self._whole = whole
        self._known: dict[tuple[float, ...], list[Candidate]] = {}

    def __call__(self, piece: Manifold) -> list[Candidate]:
        low, high = np.reshape(piece.bounding_box(), (2, 3))
        key = tuple(np.round([*low, *high, piece.volume()], 5).tolist())
        if key not in self._known:
            if len(self._known) >= _MOST:
                return []
            own, along = self._own_frames(piece)
            slanted = candidates(piece, along, holes=True)
            found = [
                *candidates(piece, [*self._whole, *own], holes=True),
                *(candidate for candidate in slanted if stands_for(candidate, piece)),
                *pipe_candidates(piece),
            ]
            seen = [replace(one, beyond=True) for one in silhouettes(piece, own) if one.sides <= _PLAIN]
            if seen and not any(stands_for(candidate, piece, _SAME) for candidate in found):
                found = [*seen, *found]
            self._known[key] = [candidate for candidate in found if not candidate.usual]
        return self._known[key]

    def _own_frames(self, piece: Manifold) -> tuple[Frames, Frames]:
        """The piece's own directions that are none of the whole's, of a hole askew, and that in which it is
        long, of a slanted tooth."""
        mesh = piece.to_mesh64()
        surface = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64)
        known = [frame[:, 2] for frame in self._whole]

        def news(found: Frames) -> list[NDArray[np.float64]]:
            return [f for f in found if np.abs(np.array(known) @ f[:, 2]).max() < _ASKEW]

        own = news(frames(*surface)[:_OWN])
        known += [frame[:, 2] for frame in own]
        along = long_axis(*surface)
        return own, news([along] if along is not None else [])


def stands_for(candidate: Candidate, piece: Manifold, alike: float = _ALIKE) -> bool:
    """Whether a candidate is about the same body as the piece. alike: IoU that they have at least."""
    body = candidate.make(0.0)
    both = float((body ^ piece).volume())
    return both > alike * (float(body.volume()) + float(piece.volume()) - both)
