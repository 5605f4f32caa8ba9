"""What every kind of field says of itself, and kinds of other packages."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any, ClassVar

import numpy as np
import pytest

from partwright import registry
from partwright.assembly import Part
from partwright.fields import KINDS, Field, Quadric, from_dict
from partwright.fields.base import scale_lengths
from tests.fields.test_solids import ALL

POINTS = np.random.default_rng(1).uniform(-1.5, 1.5, (20_000, 3))
FIELDS = [*ALL, Quadric.ellipsoid((0.3, 0.5, 0.4), (0.1, 0.0, 0.2))]


@dataclass(frozen=True)
class Diamond(Field):
    """An octahedron; all it says of itself beyond its distance is its box."""

    kind: ClassVar[str] = "diamond"
    size: float

    def __call__(self, points: Any) -> Any:
        return (abs(points).sum(-1) - self.size) / np.sqrt(3.0)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.full(3, -self.size), np.full(3, self.size)

    def scaled(self, factor: float) -> Diamond:
        return scale_lengths(self, factor, ("size",))  # type: ignore[no-any-return]


@pytest.mark.parametrize("field", [*FIELDS, Diamond(0.7)], ids=lambda field: field.kind)
def test_support_holds_the_inside_in_every_direction_and_at_every_level(field: Field) -> None:
    directions = np.random.default_rng(2).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    distance = field(POINTS)
    for level in (0.0, 0.2):
        reach = field.support(directions, level)
        assert ((POINTS[distance < level] @ directions.T).max(axis=0) <= reach + 1e-5).all()


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.kind)
def test_another_form_is_the_same_solid(field: Field) -> None:
    forms = [form for form in (field.superfrustum(), field.quadric()) if form is not None]
    assert len(forms) == 1
    np.testing.assert_allclose(forms[0](POINTS), field(POINTS), atol=1e-6)


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.kind)
def test_near_its_surface_the_value_changes_no_faster_than_the_lipschitz_bound(field: Field) -> None:
    near = POINTS[np.abs(field(POINTS)) < 0.15]
    step = 1e-2 * np.random.default_rng(3).normal(size=near.shape)
    change = np.abs(field(near + step) - field(near))
    assert len(near) > 100
    assert (change <= field.lipschitz * np.linalg.norm(step, axis=1) + 1e-5).all()


def test_every_kind_in_the_table_is_the_class_of_that_name() -> None:
    assert all(KINDS[kind].kind == kind for kind in KINDS.own if kind != "neural")


def test_a_kind_of_another_package_is_read_named_and_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("diamond", f"{__name__}:Diamond", "partwright.fields")
    monkeypatch.setattr(registry, "_installed", lambda group: (point,) if group == point.group else ())
    field = Diamond(0.7)
    assert from_dict(field.to_dict()) == field
    part = Part(field, (1.0, 0.0, 0.0)) | Part(field)
    assert [leaf.name for leaf in part.parts] == ["diamond_01", "diamond_02"]
    assert part.bounds() == pytest.approx(np.array([[-0.7] * 3, [1.7, 0.7, 0.7]]))
    assert part.distance(np.array([[1.0, 0.0, 0.0]])) == pytest.approx([-0.7 / np.sqrt(3)])
