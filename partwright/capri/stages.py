"""The stages of training by name, with their losses (section 3.3), weights and thresholds (section 4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from torch import Tensor

from partwright.capri import layers

Stage = Literal["weighted_union", "exact_union", "binary_selection"]  # the paper's 0, 1 and 2
STAGES: tuple[Stage, ...] = ("weighted_union", "exact_union", "binary_selection")

BETA = 0.5  # a+ above it counts as inside (eq. 10)
GAMMA = 0.01  # a* below it counts as inside (eq. 13-14)
ETA = 0.01  # an entry of T above it is selected (stage 2)
WEIGHT_LEFT = 10.0  # w_l (eq. 13): the left side covers all of the shape
WEIGHT_RIGHT = 2.5  # w_r (eq. 14): the right side covers what is too much of it


@dataclass(frozen=True)
class Sides:
    """a_l and a_r (B, n) of one stage: the union that is added and the one that is subtracted."""

    left: Tensor
    right: Tensor


def binary(selection: Tensor) -> Tensor:
    """T_hard: 1 where T > eta."""
    return (selection > ETA).to(selection.dtype)


def sides(stage: Stage, distance: Tensor, selection: Tensor, weights: Tensor, leaks: bool = False) -> Sides:
    """Both unions in the form of the stage; D (B, n, p), T (p, c), W (c,). leaks: of the intersection."""
    chosen = binary(selection) if stage == "binary_selection" else selection
    convexes = layers.intersection(distance, chosen, leaks)
    half = convexes.shape[-1] // 2
    left, right = convexes[..., :half], convexes[..., half:]
    if stage == "weighted_union":
        return Sides(
            layers.union_weighted(left, weights[:half]), layers.union_weighted(right, weights[half:])
        )
    return Sides(layers.union_exact(left), layers.union_exact(right))


def loss(stage: Stage, found: Sides, inside: Tensor, selection: Tensor, weights: Tensor) -> Tensor:
    """Eq. 7 (weighted_union) or 11 (the others, stage 2 without L_T, for T_hard has no gradient)."""
    if stage == "weighted_union":
        return weighted_loss(found, inside) + selection_loss(selection) + weight_loss(weights)
    if stage == "exact_union":
        return exact_loss(found, inside) + selection_loss(selection)
    return exact_loss(found, inside)


def selection_loss(selection: Tensor) -> Tensor:
    """Eq. 8: L_T, 0 where every entry of T lies in [0, 1]; a sum."""
    return (-selection).relu().sum() + (selection - 1).relu().sum()


def weight_loss(weights: Tensor) -> Tensor:
    """Eq. 9: L_W = sum |W - 1|."""
    return (weights - 1).abs().sum()


def weighted_loss(found: Sides, inside: Tensor) -> Tensor:
    """Eq. 10: each side is asked only where the other does not settle the matter; inside (B, n) is g."""
    left_mask = inside.maximum((found.right < BETA).to(inside.dtype))
    right_mask = inside.maximum((found.left > BETA).to(inside.dtype))
    left = left_mask * (inside - found.left) ** 2
    right = right_mask * ((1 - inside) - found.right) ** 2
    return (left + right).mean()


def exact_loss(found: Sides, inside: Tensor) -> Tensor:
    """Eq. 12-14. Values of a* above 1 are clamped: outside is outside."""
    left, right = layers.clamp(found.left), layers.clamp(found.right)
    left_mask = inside.maximum((found.right > GAMMA).to(inside.dtype))
    right_mask = inside.maximum((found.left < GAMMA).to(inside.dtype))
    first = left_mask * ((1 - inside) * (1 - left) + WEIGHT_LEFT * inside * left)
    second = right_mask * (inside * (1 - right) + WEIGHT_RIGHT * (1 - inside) * right)
    return (first + second).mean()
