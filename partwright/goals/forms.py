"""What of a field can be changed: its own numbers, and its distance as a function of them."""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol, cast

import numpy as np
import torch
from torch import Tensor

from partwright.errors import ParameterError
from partwright.fields import Field, Solid, SuperFrustum, reference
from partwright.goals.entry import FORM, MOST, Entry

_STEP = 1e-6  # of a number, for differences of rational functions in double precision
_LEAST = 5e-3  # of the longest side: no length shrinks below
_AXES = "xyz"


class Form(Protocol):
    """The numbers of one field."""

    def entries(self, longest: float) -> list[Entry]:
        """What each number is; `longest` is the longest side of the whole assembly."""

    def field(self, values: np.ndarray) -> Field:
        """The field of these numbers (K,). Raises ParameterError where there is none."""

    def distance(self, points: Tensor, values: Tensor) -> Tensor:
        """(N,) at points (N, 3) of the field's own frame, differentiable by both; values (K,) float64.

        Away from the field's own numbers it may be a linear continuation: its derivative is what counts.
        """


def form_of(field: Field) -> Form:
    """The form of a field that stands for itself (those that are decoded together are another matter)."""
    if isinstance(field, SuperFrustum):
        return FrustumForm(field)
    return SolidForm(field) if field.superfrustum() is not None else NumberForm(field)


class FrustumForm:
    """The eight parameters of a SuperFrustum, by its torch reference."""

    def __init__(self, field: SuperFrustum) -> None:
        self.own = field

    def entries(self, longest: float) -> list[Entry]:
        half = max(min(self.own.size[:2]) / 2, _LEAST * longest)
        share, least = min(longest / half, MOST), _LEAST * longest
        bend = min(2 * longest / max(self.own.size[2], least), MOST)
        values = self.own.parameters()
        result = [
            Entry(f"size_{axis}", FORM, value, longest, min(value, least))
            for axis, value in zip(_AXES, values[:3], strict=True)
        ]
        # A share moves the surface by its part of half the width.
        result += [
            Entry("roundness", FORM, values[3], share, 0.0, 1.0),
            Entry("dilation", FORM, values[4], longest, 0.0),
            Entry("taper", FORM, values[5], share, 0.0, 2.0),
            Entry("bulge", FORM, values[6], bend, 0.0, 1.0),
            Entry("onion", FORM, values[7], share, 0.0, 1.0),
        ]
        return result

    def field(self, values: np.ndarray) -> SuperFrustum:
        return SuperFrustum.from_parameters(values)

    def distance(self, points: Tensor, values: Tensor) -> Tensor:
        return reference.superfrustum(points, values[:3], *values[3:])


class NumberForm:
    """The numbers of any other field, named after its parameters; its distance changes by differences."""

    def __init__(self, field: Field) -> None:
        if not dataclasses.is_dataclass(field):
            raise ParameterError(f"a field of kind {field.kind!r} has no numbers that could be changed")
        self.own: Any = field
        self.slots: list[tuple[str, int | None]] = []
        for entry in dataclasses.fields(field):
            value = getattr(field, entry.name)
            if isinstance(value, tuple) and all(isinstance(v, float) for v in value):
                self.slots += [(entry.name, i) for i in range(len(value))]
            elif isinstance(value, float):
                self.slots.append((entry.name, None))

    def values(self) -> np.ndarray:
        found = [getattr(self.own, name) for name, _ in self.slots]
        return np.array([v if i is None else v[i] for v, (_, i) in zip(found, self.slots, strict=True)])

    def entries(self, longest: float) -> list[Entry]:
        return [
            Entry(_named(self.own, slot), FORM, value, abs(value) or 1.0)
            for slot, value in zip(self.slots, self.values().tolist(), strict=True)
        ]

    def field(self, values: np.ndarray) -> Field:
        changes: dict[str, Any] = {}
        for (name, i), value in zip(self.slots, values.tolist(), strict=True):
            changes[name] = value if i is None else (*changes.get(name, ()), value)
        return cast(Field, dataclasses.replace(self.own, **changes))

    def distance(self, points: Tensor, values: Tensor) -> Tensor:
        result: Tensor = self.own(points)
        for k, slope in enumerate(self._slopes(points.detach())):
            result = result + (values[k] - values[k].detach()) * slope
        return result

    def _slopes(self, points: Tensor) -> list[Tensor]:
        with torch.no_grad():
            return [
                (ahead(points) - behind(points)) / span for ahead, behind, span in self.neighbours() if span
            ]

    def neighbours(self) -> list[tuple[Any, Any, float]]:
        """A little more and a little less of each number, and by how much they differ."""
        values, found = self.values(), []
        for k, value in enumerate(values):
            step = _STEP * (abs(value) or 1.0)
            sides = []
            for sign in (1, -1):
                moved = values.copy()
                moved[k] += sign * step
                try:
                    sides.append((self.field(moved), step))
                except ParameterError:
                    sides.append((self.own, 0.0))
            (ahead, up), (behind, down) = sides
            found.append((ahead, behind, up + down))
        return found


class SolidForm(NumberForm):
    """The own numbers of what is exactly a SuperFrustum: through its eight parameters."""

    def entries(self, longest: float) -> list[Entry]:
        if not isinstance(self.own, Solid):  # another package's kind: what its numbers mean it alone knows
            return super().entries(longest)
        return [
            Entry(_named(self.own, slot), FORM, value, longest, min(value, _LEAST * longest))
            for slot, value in zip(self.slots, self.values().tolist(), strict=True)
        ]

    def distance(self, points: Tensor, values: Tensor) -> Tensor:
        own = np.array(_parameters(self.own))
        change = [
            (_parameters(ahead) - _parameters(behind)) / (span or 1.0)
            for ahead, behind, span in self.neighbours()
        ]
        jacobian = torch.tensor(np.array(change), dtype=values.dtype)
        eight = torch.tensor(own, dtype=values.dtype) + (values - values.detach()) @ jacobian
        return reference.superfrustum(points, eight[:3], *eight[3:])


def _parameters(field: Field) -> np.ndarray:
    own = field.superfrustum()
    assert own is not None
    return np.array(own.parameters())


def _named(field: Field, slot: tuple[str, int | None]) -> str:
    name, i = slot
    if i is None:
        return name
    count = len(getattr(field, name))
    return f"{name}_{_AXES[i] if count == 3 else i}"
