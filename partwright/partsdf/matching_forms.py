"""Forms that go with one another: mixed from those of whole training shapes.

Forms that are denoised suit a new layout, and one another, only roughly: a roof comes out lower than the
windows in it. Forms of one training shape suit one another to the last edge, and so do those of a few that
are alike, mixed by the same weights for all parts. These are the weights by which the layouts of such shapes
come nearest to the new one (as in locally linear embedding, Roweis and Saul 2000). Which shapes are mixed is
told by the drawn forms, too, and so these choose between kinds of forms that one layout may have; weights are
not, as most of what is drawn is noise, by which all would be alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

MIXED = 3  # with 8, new vehicles were told from held-out ones as often, within chance
_FORM = 0.1  # weight of a form's squared difference, against a layout's: each number in its spread
_RIDGE = 0.01  # of the neighbours' mean squared distance: weights of shapes that lie alike stay small


@dataclass(frozen=True)
class WholeShapes:
    """S shapes with their layouts (S, P, 13), poses' numbers and presence, forms (S, P, K), and how much each
    number of a form tells (P, K), 1 in the mean."""

    layouts: Tensor
    forms: Tensor
    tells: Tensor

    def with_one(self, layout: Tensor, form: Tensor) -> WholeShapes:
        """And another, layout (P, 13) and form (P, K)."""
        return WholeShapes(
            torch.cat([self.layouts, layout[None]]), torch.cat([self.forms, form[None]]), self.tells
        )

    def matching(self, layouts: Tensor, forms: Tensor) -> Tensor:
        """(B, P, K) forms for layouts (B, P, 13), near the drawn forms (B, P, K); as drawn where no shape has
        all parts of a layout."""
        return torch.stack([self._mixed(*one) for one in zip(layouts, forms, strict=True)])

    def _mixed(self, layout: Tensor, form: Tensor) -> Tensor:
        there = layout[:, -1] > 0
        able = ((self.layouts[..., -1] > 0) | ~there).all(dim=1).nonzero().squeeze(1)
        if not len(able):
            return form
        away = (self.layouts[able] - layout)[:, there, :-1].flatten(1)
        unlike = (self.tells * (self.forms[able] - form).square())[:, there].flatten(1)
        near = (away.square().sum(dim=1) + _FORM * unlike.sum(dim=1)).argsort(stable=True)[:MIXED]
        products = (away[near] @ away[near].T).double()
        ridge = _RIDGE * products.diagonal().mean().clamp(min=1e-12)
        weights = torch.linalg.solve(
            products + ridge * torch.eye(len(near), dtype=torch.float64),
            torch.ones(len(near), dtype=torch.float64),
        )
        weights = (weights / weights.sum()).to(form.dtype)
        return torch.einsum("s,spk->pk", weights, self.forms[able[near]])
