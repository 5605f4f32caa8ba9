"""Least squares over the numbers that no relation fixes; those that a relation ties move together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from partwright.cleaning.deviation_samples import BAND, State
from partwright.cleaning.model import Model
from partwright.errors import ParameterError
from partwright.fields import kernel
from partwright.least_squares import Damping, minimise

Floats = NDArray[np.float64]

_SOFT = 0.03  # unit lengths: the residual is tanh(F / soft) - tanh(S / soft)
_NUDGE = 1e-3  # unit lengths that a difference quotient moves the surface by
_LONGEST = 0.03  # unit lengths, a step
_DAMPING = Damping(trials=0, start=1e-3, down=0.2, up=8.0, floor=1e-6, ridge=1e-6, settled=1e-4)


def refit(state: State, freedom: Floats, iterations: int) -> State:
    """Moves the vector along the columns of `freedom` (n, d) to the least sum of squares
    (Levenberg-Marquardt); the loss never rises."""
    if freedom.shape[1] == 0:
        return state
    leaves = _moving(state.model, freedom)

    def linearise(at: State) -> tuple[float, Floats, Floats]:
        jacobian = _jacobian(at, freedom, leaves)
        matrix = freedom.T @ (jacobian.T @ jacobian) @ freedom
        gradient = freedom.T @ (jacobian.T @ _residual(at))
        largest = max(float(matrix.diagonal().max()), 1e-12)  # of which floor and ridge are shares
        return _loss(at), gradient / largest, matrix / largest

    def move(at: State, step: Floats) -> State | None:
        along = freedom @ step
        reach = float(np.abs(along * at.model.weights).max() * at.samples.scale)
        along *= min(1.0, _LONGEST / max(reach, 1e-12))
        try:
            return at.changed(at.model, at.vector + along, leaves)
        except ParameterError:  # a length fell below zero, or a ratio left its range
            return None

    return minimise(state, linearise, _loss, move, replace(_DAMPING, trials=iterations)).state


def _moving(model: Model, freedom: Floats) -> list[int]:
    moved = np.abs(freedom).max(axis=1) > 0
    return sorted({v.leaf for v, one in zip(model.variables, moved, strict=True) if one})


def _residual(state: State) -> Floats:
    return np.tanh(state.field / _SOFT) - np.tanh(state.samples.target / _SOFT)


def _loss(state: State) -> float:
    return float((_residual(state).astype(np.float64) ** 2).sum())


def _jacobian(state: State, freedom: Floats, leaves: list[int]) -> sparse.csr_matrix:
    """(N, n) of the residuals: how the whole follows each copy, times the copy's difference quotients."""
    model, samples = state.model, state.samples
    slope = (1 - np.tanh(state.field / _SOFT) ** 2) / _SOFT
    used = np.abs(freedom).max(axis=1) > 0
    data, rows, columns = [], [], []
    for leaf in leaves:
        own = [at for at in np.flatnonzero(model.of_leaf(leaf)).tolist() if used[at]]
        for c in np.flatnonzero(model.leaf_of == leaf):
            index = np.flatnonzero(np.abs(state.distances[c]) < 2 * BAND)
            if not len(index):
                continue
            share = _share(state, int(c), index) * slope[index]
            own_at = [
                at for at in own if model.variables[at].kind != "place" or model.variables[at].copy == c
            ]
            quotients = _quotients(state, int(c), own_at, samples.points[index])
            data.append((share * quotients).ravel())
            rows.append(np.tile(index, len(own_at)))
            columns.append(np.repeat(own_at, len(index)))
    shape = (len(samples.points), len(state.vector))
    if not data:
        return sparse.csr_matrix(shape)
    triple = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_matrix(triple, shape=shape)


def _share(state: State, copy: int, index: NDArray[np.int64]) -> Floats:
    """How much the whole's distance moves with the copy's, at some points."""
    values = state.distances[:, index].copy()
    values[copy] += _NUDGE
    moved = state.model.fold(values, state.model.blends * state.samples.scale)
    return np.clip((moved - state.field[index]) / _NUDGE, -1.0, 1.0).astype(np.float64)


def _quotients(state: State, copy: int, entries: list[int], points: NDArray[np.float32]) -> Floats:
    """(K, N) slopes of a copy's distance by entries of the vector; one-sided at the end of a range."""
    model, samples = state.model, state.samples
    rows, spans = [], []
    for at in entries:
        ends = []
        for sign in (1.0, -1.0):
            vector = state.vector.copy()
            vector[at] += sign * _NUDGE / samples.scale / model.weights[at]
            try:
                rows.append(model.rows([vector], copy, samples.centre, samples.scale))
            except ParameterError:
                vector = state.vector
                rows.append(model.rows([vector], copy, samples.centre, samples.scale))
            ends.append(vector[at])
        spans.append(max(ends[0] - ends[1], 1e-300))
    values = kernel.evaluate_parts(np.concatenate(rows), points).astype(np.float64)
    return np.asarray((values[::2] - values[1::2]) / np.array(spans)[:, None])
