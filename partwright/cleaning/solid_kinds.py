"""Parts become plainer: named solids, ratios at 0 or 1, no blend."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator

from partwright.approximation.nearest import nearest_solid
from partwright.approximation.recognise import exact_solid
from partwright.assembly import Part
from partwright.cleaning.acceptance import AcceptanceTest
from partwright.cleaning.deviation_samples import State
from partwright.cleaning.dimensions import dimensions, values
from partwright.cleaning.grid import Grid
from partwright.errors import NoSurfaceError
from partwright.fields import Cone, Cylinder, Field, Frustum, SuperFrustum

_NEAR = 0.2  # ratios this near to a plain value are tried there
_SQUARE = 0.1  # relative difference of sides that are tried as one
_DILATED = 0.1  # of the longest side: a dilation under this is tried as none


def plainer(state: State, acceptance: AcceptanceTest, grid: Grid) -> State:
    """Each leaf with the plainest blend and as the plainest field that cost little enough."""
    for leaf in range(len(state.model.leaves)):
        part = state.model.leaves[leaf]
        if not is_plain(part.field, grid):
            state = _simplified(_blended(state, acceptance, grid, leaf, (0.0,)), acceptance, leaf)
        blend = state.model.leaves[leaf].blend
        near = grid.nearest(blend, acceptance.tolerance / state.samples.scale)
        state = _blended(state, acceptance, grid, leaf, (0.0, *near))
        if not grid.plain(state.model.leaves[leaf].blend):
            state = _blended(state, acceptance.without_limit(), grid, leaf, grid.finest(blend))
    return state


def _blended(
    state: State, acceptance: AcceptanceTest, grid: Grid, leaf: int, blends: Iterable[float]
) -> State:
    """With the first of these blends that costs little enough; one that is plain stays."""
    part = state.model.leaves[leaf]
    if grid.plain(part.blend):
        return state
    trials = (_tried(state, acceptance, leaf, dataclasses.replace(part, blend=blend)) for blend in blends)
    return next((trial for trial in trials if trial is not None), state)


def is_plain(field: Field, grid: Grid) -> bool:
    """Whether all numbers are such as a person types: those stay."""
    return all(
        grid.plain(value, dimension.ratio)
        for dimension, value in zip(dimensions(type(field)), values(field), strict=True)
    )


def _simplified(state: State, acceptance: AcceptanceTest, leaf: int) -> State:
    part = state.model.leaves[leaf]
    if isinstance(part.field, SuperFrustum):
        named = _named(state, acceptance, leaf)
        if named is None:
            state = _plain_ratios(state, acceptance, leaf)
            part = state.model.leaves[leaf]
            exact = exact_solid(part.field)
            if exact is not None:
                state = _tried(state, acceptance, leaf, dataclasses.replace(part, field=exact)) or state
        else:
            state = named
    for other in _special_cases(state.model.leaves[leaf]):
        found = _tried(state, acceptance, leaf, other)
        if found is not None:
            return found
    return state


def _named(state: State, acceptance: AcceptanceTest, leaf: int) -> State | None:
    """As the nearest named solid."""
    try:
        near = nearest_solid(state.model.leaves[leaf])
    except NoSurfaceError:
        return None
    return _tried(state, acceptance, leaf, near.part_with_solid)


def _plain_ratios(state: State, acceptance: AcceptanceTest, leaf: int) -> State:
    """One ratio after the other to 0 or 1, each for good."""
    locked: list[str] = []
    for name in ("bulge", "onion", "taper", "square", "roundness", "dilation"):
        field = state.model.leaves[leaf].field
        assert isinstance(field, SuperFrustum)
        for other in _plain_values(field, name):
            part = dataclasses.replace(state.model.leaves[leaf], field=other)
            found = _tried(state, acceptance, leaf, part, (*locked, name))
            if found is not None:
                state = found
                locked.append(name)
                break
    return state


def _plain_values(field: SuperFrustum, name: str) -> Iterator[SuperFrustum]:
    x, y, z = field.size
    if name == "square":
        if 0 < abs(x - y) < _SQUARE * max(x, y) and field.roundness > 1 - _NEAR:
            yield dataclasses.replace(field, size=((x + y) / 2, (x + y) / 2, z))
    elif name == "dilation":
        d = field.dilation
        if 0 < d < _DILATED * max(x, y, z):
            yield dataclasses.replace(field, dilation=0.0, size=(x + 2 * d, y + 2 * d, z + 2 * d))
    elif name == "onion":
        if field.onion and (not field.hollow or field.onion < _NEAR):
            yield dataclasses.replace(field, onion=0.0)
    else:
        value = getattr(field, name)
        for plain in {"bulge": (0.0,), "taper": (1.0, 0.0)}.get(name, (0.0, 1.0)):
            if 0 < abs(value - plain) < _NEAR:
                yield dataclasses.replace(field, **{name: plain})  # type: ignore[arg-type]


def _special_cases(part: Part) -> Iterator[Part]:
    """A frustum as a cylinder or a cone."""
    field = part.field
    if isinstance(field, Frustum):
        low, top = field.bottom_radius, field.top_radius
        if abs(top - low) < _NEAR * low:
            yield dataclasses.replace(part, field=Cylinder((low + top) / 2, field.height))
        if top < _NEAR * low:
            yield dataclasses.replace(part, field=Cone(low, field.height))


def _tried(
    state: State, acceptance: AcceptanceTest, leaf: int, part: Part, locked: tuple[str, ...] = ()
) -> State | None:
    model = state.model.with_leaf(leaf, part.copies)
    return acceptance.leaf(state, leaf, model, locked)
