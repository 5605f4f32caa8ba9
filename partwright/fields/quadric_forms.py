"""What a quadric is: its normal form, and the name of its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from partwright.fields.quadric import Quadric

SAME = 1e-9


@dataclass(frozen=True)
class NormalForm:
    """f is, but for a positive factor and the sign, k1 u^2 + k2 v^2 + k3 w^2 + slope w - level.

    axes: (3, 3) right-handed, columns u, v, w. centre: (3,) where u = v = w = 0. curvature: (3,) k1, k2, k3:
    k1 > 0 unless all are 0; k1 and k2 have one sign where any two do, and are equal where any two are; k3 is
    0 where any is. slope: >= 0, and only beside k3 = 0; then level is 0. complement: the solid is where
    the form is >= 0, not <= 0.
    """

    axes: np.ndarray
    centre: np.ndarray
    curvature: np.ndarray
    slope: float
    level: float
    complement: bool

    @property
    def round(self) -> bool:
        """A surface of revolution about w."""
        return bool(self.curvature[0] == self.curvature[1])

    @property
    def name(self) -> str:
        """Of the surface: "plane", "sphere", "cylinder" ...; "none" where no point is inside or outside."""
        signs = "".join("-0+"[int(np.sign(k)) + 1] for k in self.curvature)
        end = "slope" if self.slope else "-0+"[int(np.sign(self.level)) + 1]
        name = _NAMES.get((signs, end), "none")
        if self.round:
            name = "sphere" if name == "ellipsoid" and np.ptp(self.curvature) == 0 else _ROUND.get(name, name)
        return name

    @property
    def radii(self) -> np.ndarray:
        """(3,) semi-axes sqrt(|level / k|), infinite along axes without curvature."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.sqrt(np.abs(self.level) / np.abs(self.curvature))

    @property
    def widening(self) -> float:
        """Of a cone: its radius along u at a height of 1 above the apex."""
        return float(np.sqrt(-self.curvature[2] / self.curvature[0]))

    def quadric(self) -> Quadric:
        """The solid again."""
        own = Quadric.from_matrices(np.diag(self.curvature), np.array([0, 0, self.slope]), -self.level)
        own = own.moved(self.axes, self.centre)
        return own.complement() if self.complement else own


# (signs of the curvatures, sign of the level or "slope") -> name
_NAMES = {
    ("+++", "+"): "ellipsoid",
    ("++-", "+"): "hyperboloid of one sheet",
    ("++-", "0"): "elliptic cone",
    ("++-", "-"): "hyperboloid of two sheets",
    ("++0", "+"): "elliptic cylinder",
    ("++0", "slope"): "elliptic paraboloid",
    ("+-0", "slope"): "hyperbolic paraboloid",
    ("+-0", "+"): "hyperbolic cylinder",
    ("+-0", "-"): "hyperbolic cylinder",
    ("+-0", "0"): "crossing planes",
    ("+00", "slope"): "parabolic cylinder",
    ("+00", "+"): "parallel planes",
    ("000", "slope"): "plane",
}
_ROUND = {"elliptic cone": "cone", "elliptic cylinder": "cylinder", "elliptic paraboloid": "paraboloid"}


def normal_form(quadric: Quadric, length: float = 1.0, same: float = SAME) -> NormalForm:
    """The quadric's normal form.

    length: what is small is judged over this distance, say the size of the assembly. same: terms are 0, and
    curvatures equal, where they differ by less than this of the largest term.
    """
    square, linear, constant = quadric.matrices()
    curvature, axes = np.linalg.eigh(square * length**2)
    slope = linear @ axes * length
    size = max(np.abs(curvature).max(), np.abs(slope).max())
    curvature, slope, constant = curvature / size, slope / size, constant / size
    curvature[np.abs(curvature) <= same] = 0.0
    curved = curvature != 0
    shift = np.where(curved, -slope / (2 * np.where(curved, curvature, 1.0)), 0.0)
    level = float((curvature * shift**2).sum() - constant)
    fall = np.where(curved, 0.0, slope)
    steep = float(np.linalg.norm(fall))

    sign = _sign(curvature)
    curvature, level = _equalised(sign * curvature, same), sign * level
    last = axes @ (sign * fall / steep) if steep > same else None
    order = _order(curvature)
    axes, shift, curvature = axes[:, order], shift[order], curvature[order]
    centre = axes @ shift * length
    if last is None:
        steep, level = 0.0, 0.0 if abs(level) <= same else level
    else:
        centre = centre + last * (level / steep) * length
        level = 0.0
        axes = _with_last(axes, last, int(np.count_nonzero(curvature)))
    axes = axes * np.array([np.sign(np.linalg.det(axes)), 1.0, 1.0])
    return NormalForm(axes, centre, curvature / length**2, steep / length, level, sign < 0)


def _sign(curvature: np.ndarray) -> float:
    """What makes the curvatures mostly positive."""
    positive, negative = np.count_nonzero(curvature > 0), np.count_nonzero(curvature < 0)
    return -1.0 if negative > positive else 1.0


def _equalised(curvature: np.ndarray, same: float) -> np.ndarray:
    """Curvatures that differ by rounding become their mean."""
    result = curvature.copy()
    for group in ([0, 1, 2], [0, 1], [1, 2]):  # they are sorted
        if np.ptp(result[group]) <= same * np.abs(result[group]).max():
            result[group] = result[group].mean()
            break
    return result


def _order(curvature: np.ndarray) -> list[int]:
    """The axis that is w comes last: flat before opposite, before the one that differs most."""
    flat = np.flatnonzero(curvature == 0)
    if len(flat):
        return [i for i in np.argsort(-curvature).tolist() if i not in flat] + flat.tolist()
    negative = np.flatnonzero(curvature < 0)
    middle = np.argsort(curvature)[1]
    last = negative[0] if len(negative) else int(np.abs(curvature - curvature[middle]).argmax())
    return [i for i in range(3) if i != last] + [int(last)]


def _with_last(axes: np.ndarray, last: np.ndarray, curved: int) -> np.ndarray:
    """Orthonormal axes that keep the first `curved` ones and end with `last`."""
    kept = [*axes[:, :curved].T, last]
    spare = np.linalg.svd(np.array(kept))[2][len(kept) :]
    return np.stack([*axes[:, :curved].T, *spare, last], axis=1)
