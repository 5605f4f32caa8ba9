"""Forms mixed from whole shapes: by their layouts, near what was drawn, and of shapes that have the parts."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from partwright.partsdf.matching_forms import WholeShapes

PARTS, POSE, FORM = 3, 12, 4


def shapes_of(count: int, seed: int, present: Tensor | None = None) -> WholeShapes:
    """Whose forms follow from their layouts, as all do that were made by one rule: linearly."""
    random = torch.Generator().manual_seed(seed)
    numbers = torch.randn(count, 2, generator=random)  # of which all else follows
    layouts = numbers @ torch.randn(2, PARTS * POSE, generator=random)
    forms = numbers @ torch.randn(2, PARTS * FORM, generator=random)
    there = torch.ones(count, PARTS) if present is None else present
    layout = torch.cat([layouts.unflatten(1, (PARTS, POSE)), 2 * there[..., None] - 1], dim=-1)
    return WholeShapes(layout, forms.unflatten(1, (PARTS, FORM)), torch.ones(PARTS, FORM))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000))
def test_forms_follow_a_new_layout_as_those_of_whole_shapes_do(seed: int) -> None:
    """Drawn forms that go with neither layout nor one another are off by their noise; matched ones go with
    both by the rule that all shapes share."""
    known = shapes_of(200, seed)
    new = slice(0, 20)
    rest = WholeShapes(known.layouts[20:], known.forms[20:], known.tells)
    noise = torch.randn(known.forms[new].shape, generator=torch.Generator().manual_seed(seed))
    matched = rest.matching(known.layouts[new], known.forms[new] + 0.5 * noise)
    off = (matched - known.forms[new]).flatten(1).square().mean(dim=1).sqrt()
    assert off.median() < 0.15  # of 0.5; those at the edge of what is known are farther


def test_a_known_shape_stays_what_it_is() -> None:
    known = shapes_of(30, 0)
    matched = known.matching(known.layouts, known.forms)
    assert (matched - known.forms).square().mean() < 1e-3 * known.forms.square().mean()


def test_what_was_drawn_chooses_between_forms_of_one_layout() -> None:
    """Half of the shapes have other forms in the same places: never is the mean of both kinds made."""
    plain = shapes_of(30, 0)
    both = WholeShapes(
        plain.layouts.repeat(2, 1, 1), torch.cat([plain.forms + 5, plain.forms - 5]), plain.tells
    )
    for kind in (5, -5):
        matched = both.matching(plain.layouts, plain.forms + kind)
        assert (matched - kind - plain.forms).abs().max() < 1


def test_only_shapes_with_all_parts_are_mixed() -> None:
    """What a shape that lacks a part has in its place is no form; and where none has all, all stays."""
    present = torch.ones(30, PARTS)
    present[:15, 1] = 0
    known = shapes_of(30, 0, present)
    known.forms[:15] = torch.nan
    wanted = known.layouts.clone()
    wanted[..., -1] = 1
    drawn = shapes_of(30, 0).forms
    assert known.matching(wanted, drawn).isfinite().all()
    lacking = WholeShapes(known.layouts[:15], known.forms[:15], known.tells)
    assert torch.equal(lacking.matching(wanted, drawn), drawn)


@pytest.mark.parametrize("change", [0.0, 0.1])
def test_another_shape_takes_part(change: float) -> None:
    """One unlike all, of which little was changed, comes back nearly as it was."""
    known, odd = shapes_of(30, 0), shapes_of(1, 9)
    layout, form = odd.layouts[0] * 3, odd.forms[0] * 3
    layout[:, -1] = 1
    drawn = form + change * torch.randn(form.shape, generator=torch.Generator().manual_seed(0))
    (matched,) = known.with_one(layout, form).matching(layout[None], drawn[None])
    assert (matched - form).abs().max() < 0.2
