"""What samples weigh where features are told apart by them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.chord_skins import ChordSkins
from partwright.shapes import Shape
from partwright.superfrusta.samples import FitSamples


def feature_weights(shape: Shape, samples: FitSamples) -> NDArray[np.float64]:
    """(N, 2): of the samples near the surface, and of the others. None in the skins between arcs and the
    chords that the shape has in their place: there a part that was drawn is off its own mesh."""
    weights = np.zeros((len(samples.points), 2))
    weights[: samples.near, 0] = samples.weight[: samples.near]
    weights[samples.near :, 1] = samples.weight[samples.near :]
    skins = ChordSkins.of(*shape.unit_mesh)
    close = np.flatnonzero(np.abs(samples.distance) < skins.reach)
    if len(close):
        weights[close[skins.hold(samples.points[close], *shape.unit_nearest(samples.points[close]))]] = 0.0
    return weights
