"""Random parts and assemblies for property tests."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import (
    Box,
    Capsule,
    Cylinder,
    Extrusion,
    Profile,
    Revolution,
    Sphere,
    SuperFrustum,
    Torus,
)

UNIT = st.floats(0.0, 1.0)
LENGTH = st.floats(0.05, 1.5)
ANGLE = st.floats(30.0, 360.0)
VECTOR = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
ROTATION = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
NAME = st.text(st.characters(categories=("L", "N", "P", "S")), max_size=8)
METADATA = st.dictionaries(NAME, NAME | st.floats(allow_nan=False, allow_infinity=False), max_size=2)

SUPERFRUSTA = st.builds(
    SuperFrustum,
    size=st.tuples(LENGTH, LENGTH, LENGTH),
    roundness=UNIT,
    dilation=st.floats(0.0, 0.3),
    taper=st.floats(0.0, 2.0),
    bulge=UNIT,
    onion=st.floats(0.0, 0.95),
)
SOLIDS = st.one_of(
    st.builds(Box, st.tuples(LENGTH, LENGTH, LENGTH)),
    st.builds(Sphere, LENGTH),
    st.builds(Cylinder, LENGTH, LENGTH),
    st.builds(Capsule, LENGTH, LENGTH),
    st.builds(Torus, st.floats(0.6, 1.0), st.floats(0.1, 0.5)),
)
MOVES = st.builds(Similarity, st.just(1.0), ROTATION, VECTOR)
PARTS = st.builds(
    Part,
    SUPERFRUSTA | SOLIDS,
    VECTOR,
    ROTATION,
    blend=st.floats(0.0, 0.3),
    name=NAME,
    metadata=METADATA,
    instances=st.just(()) | st.lists(MOVES, max_size=2).map(tuple),
)
OPERATIONS = st.sampled_from(["union", "intersection", "difference"])


def assemblies_of(children: st.SearchStrategy) -> st.SearchStrategy:
    return st.builds(
        Assembly,
        st.lists(children, min_size=1, max_size=4).map(tuple),
        OPERATIONS,
        name=NAME,
        blend=st.floats(0.0, 0.3),
        unit=st.sampled_from([None, "mm"]),
        up=st.sampled_from([None, "z"]),
        metadata=METADATA,
    )


ASSEMBLIES = assemblies_of(st.recursive(PARTS, assemblies_of, max_leaves=8))
SIMILARITIES = st.builds(Similarity, st.floats(0.1, 10.0), ROTATION, VECTOR)
SWEPT = st.builds(
    Part,
    st.one_of(
        st.builds(lambda w, h: Extrusion(Profile.rectangle(w, 1.0, 0.2), h), LENGTH, LENGTH),
        st.builds(lambda w, a: Extrusion(Profile.regular(5, 0.5 + w), 0.4, a), LENGTH, st.floats(1.0, 15.0)),
        st.builds(lambda w: Extrusion(Profile.rectangle(1.0, w), w, 0.0, 0.1 * w, 0.0, 0.0, 0.2 * w), LENGTH),
        st.builds(lambda r, a: Revolution(Profile.circle(0.4, (0.5 + r, 0.1)), a), LENGTH, ANGLE),
    ),
    VECTOR,
    ROTATION,
    st.floats(0.0, 0.2),
    NAME,
    instances=st.just(()) | st.lists(MOVES, max_size=2).map(tuple),
)
