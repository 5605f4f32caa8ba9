"""Trees of features as they were drawn, for what rewrites them."""

from __future__ import annotations

import numpy as np

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import in_unit_frame
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings


def drawn(*parts: tuple[bool, Part], sides: int) -> tuple[FeatureSearch, FeatureTree, float]:
    """Parts that are added or not, as a tree in the unit frame in which each has so many sides; a search of
    the shape that they make; and the frame's scale."""
    whole = Assembly((parts[0][1],))
    for added, part in parts[1:]:
        whole = Assembly((whole, part), "union" if added else "difference")
    shape, settings = pw.load_shape(mesh_assembly(whole), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    own = in_unit_frame(shape, whole).parts
    features = [
        Feature(added, part, np.zeros(0, bool), sides) for (added, _), part in zip(parts, own, strict=True)
    ]
    return search, FeatureTree(features), shape.frame.scale


def kinds(tree: FeatureTree) -> list[tuple[bool, str, int]]:
    return [(f.added, f.part.field.kind, sum(len(part.copies) for part in f.parts)) for f in tree.features]
