"""One step of the search: the quadratic model, its bounds and its constraints.

After the conservative convex separable approximation of Svanberg (2002): the objective's slope and a
curvature that makes the step as long as the trust region allows, constraints by their slopes, all within a
box. It is separable, so that only the constraints' multipliers are searched for.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

PENALTY = 20.0  # on what a constraint is broken by: multipliers do not exceed it


def best_step(
    slope: np.ndarray,
    constraints: np.ndarray,
    jacobian: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    radius: float,
) -> np.ndarray:
    """(D,) change of the variables within lower <= change <= upper and +-radius.

    slope: (D,) of the objective. constraints: (M,) now, kept where <= 0; jacobian: (M, D) of them.
    """
    low, high = np.maximum(lower, -radius), np.minimum(upper, radius)
    steepest = float(np.abs(slope).max(initial=0.0))
    if len(constraints):
        steepest = max(steepest, 1e-3 * float(np.abs(jacobian).max(initial=0.0)))
    curvature = max(steepest, 1e-12) / radius

    def change(multipliers: np.ndarray) -> np.ndarray:
        return np.clip(-(slope + multipliers @ jacobian) / curvature, low, high)

    if not len(constraints):
        return change(np.zeros(0))

    def dual(multipliers: np.ndarray) -> tuple[float, np.ndarray]:
        d = change(multipliers)
        left = constraints + jacobian @ d
        return -float(slope @ d + curvature / 2 * d @ d + multipliers @ left), -left

    start = np.zeros(len(constraints))
    found = minimize(dual, start, jac=True, method="L-BFGS-B", bounds=[(0.0, PENALTY)] * len(start))
    return change(found.x)
