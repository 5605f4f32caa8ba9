"""What is decided once all solids are there: plainer kinds, and cuts that go all the way through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.similarity import rotation_matrix
from partwright.fields.columns import ROTATION, SIZE, TRANSLATION, Column
from partwright.superfrusta.objective import score
from partwright.superfrusta.pruning import neighbours
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

Row = NDArray[np.float32]

_SCORE_LOSS = 5e-4  # of R: a plainer kind may cost so much
_UNREFITTED_SCORE_LOSS = 0.01  # of R: a kind that costs more before its refit is not tried
_BEYOND = 0.03  # unit lengths by which a cut goes beyond the solid
_ACROSS, _ALONG, _WITHIN = 7, 60, 0.35  # points across and along a cut, and how far out of its middle
_EXTENSION_SCORE_LOSS = 2e-5  # of R: what a cut that goes on may cost


def simplify_kinds(samples: FitSamples, rows: Rows, settings: Settings, locked: int = 0) -> Rows:
    """Each part as the plainest kind that explains as much.

    A frustum that hardly tapers becomes a cylinder, and so does a tube with hardly a hole, or a capsule whose
    ends are flat. The part and its neighbours are refitted before the two are compared.
    """
    whole = score(samples, rows)
    for index in range(locked, len(rows)):
        for plainer in _plainer(rows[index]):
            trial = rows.copy()
            trial[index] = plainer
            if score(samples, trial) < whole - _UNREFITTED_SCORE_LOSS:
                continue
            moving = neighbours(samples, rows, index)
            moving[index], moving[:locked] = True, False
            trial = refine(samples, trial, TOUCH_UP, settings, moving)
            reached = score(samples, trial)
            if reached >= whole - _SCORE_LOSS:
                rows, whole = trial, reached
                break
    return rows


def _plainer(row: Row) -> list[Row]:
    """The row (17,) as kinds of fewer parameters, the plainest first."""
    if row[Column.DILATION] > 0:
        return _of_dilated(row)
    hollow = row[Column.ONION] > 0
    if row[Column.ROUNDNESS] == 0:
        return [_changed(row, onion=0.0)] if hollow else []
    if row[Column.TAPER] in (0, 1):
        return [_changed(row, onion=0.0)] if hollow else []
    width = float(row[Column.SX]) * (1 + float(row[Column.TAPER])) / 2
    straight = _changed(row, sx=width, sy=width, taper=1.0)
    trials = [_changed(straight, onion=0.0)] if hollow else []
    trials += [straight]
    trials += [_changed(row, onion=0.0)] if hollow else []
    trials += [_changed(row, taper=0.0)] if row[Column.TAPER] < 0.3 else []
    return trials


def _of_dilated(row: Row) -> list[Row]:
    """Capsules as spheres, cylinders and boxes; rings as tubes."""
    radius, length = float(row[Column.DILATION]), float(row[Column.SZ])
    if length > 0:
        whole = {"sx": 2 * radius, "sy": 2 * radius, "sz": length + 2 * radius, "dilation": 0.0}
        short = _changed(row, sz=0.0, dilation=radius + length / 4)
        return [short, _changed(row, roundness=1.0, **whole), _changed(row, roundness=0.0, **whole)]
    if row[Column.SX] > 0:
        outer = float(row[Column.SX]) + 2 * radius
        return [_changed(row, sx=outer, sy=outer, sz=2 * radius, dilation=0.0, onion=1 - 4 * radius / outer)]
    return []


def _changed(row: Row, **values: float) -> Row:
    result = row.copy()
    for name, value in values.items():
        result[Column[name.upper()]] = value
    return result


def extend_cuts(samples: FitSamples, rows: Rows, locked: int = 0) -> Rows:
    """Subtracted parts that end in the open end a little beyond what they cut, so that no skin is left.

    A fit does not care how far a cut goes where nothing is; a CAD program does when two faces coincide, and a
    reader when every hole through one plate has another length.
    """
    least = score(samples, rows) - _EXTENSION_SCORE_LOSS
    added = rows[rows[:, Column.SIGN] > 0]
    for index in range(locked, len(rows)):
        if rows[index, Column.SIGN] > 0:
            continue
        for axis, side in _ends(rows[index]):
            trial = rows.copy()
            trial[index] = _ending_beyond(samples, added, rows[index], axis, side)
            if score(samples, trial) >= least:
                rows = trial
    return rows


def _ends(row: Row) -> list[tuple[int, float]]:
    """The faces that may move on their own: all six of a box, both ends of a straight round part."""
    if row[Column.DILATION] > 0 or row[Column.TAPER] != 1:
        return []
    axes = (0, 1, 2) if row[Column.ROUNDNESS] == 0 and row[Column.ONION] == 0 else (2,)
    return [(axis, side) for axis in axes for side in (-1.0, 1.0)]


def _ending_beyond(samples: FitSamples, added: Rows, row: Row, axis: int, side: float) -> Row:
    """The cut (17,) with one end `_BEYOND` further than it meets any added part; longer by as much where
    these go on, which the caller will find costs too much."""
    w, x, y, z = (float(v) for v in row[ROTATION])
    turn, size = rotation_matrix((w, x, y, z)), row[SIZE].astype(np.float64)
    end = size[axis] / 2
    across = [np.linspace(-_WITHIN, _WITHIN, _ACROSS) * size[k] for k in range(3)]
    across[axis] = side * np.linspace(-end, end + _BEYOND, _ALONG)
    local = np.stack(np.meshgrid(*across, indexing="ij"), axis=-1).reshape(-1, 3)
    distance = samples.parts_of(added, (row[TRANSLATION] + local @ turn.T).astype(np.float32)).min(axis=0)
    inside = distance < 0
    if not inside.any():
        return row
    # The outermost point inside lies as deep as the face that it lies behind is away.
    last = float((side * local[inside, axis] - distance[inside]).max())
    result = row.copy()
    change = last + _BEYOND - end
    result[TRANSLATION] += side * change / 2 * turn[:, axis]
    result[(Column.SX, Column.SY, Column.SZ)[axis]] += change
    return result
