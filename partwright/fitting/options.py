"""The rarer options of a fit, each a small object that checks itself, and which methods take them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.assembly import Assembly
from partwright.errors import SettingError
from partwright.methods import METHODS, Ability, Method

if TYPE_CHECKING:
    from partwright.shapes import Shape

# What a method that lacks an ability cannot do, after its name.
_LACKS = {
    Ability.BUDGET: "keeps to no number of parts",
    Ability.TARGET: "does not stop at an IoU",
    Ability.CURVE: "gives no curve of sizes",
    Ability.START: "does not continue an assembly",
    Ability.LOCK: "keeps no part locked",
    Ability.SYMMETRY: "looks for no symmetry",
    Ability.SUBTRACT: "subtracts no parts",
    Ability.CLEAN: "makes parts that cannot be cleaned",
    Ability.BOUNDS: "keeps no tolerance and no bound",
    Ability.PER_NODE: "does not fit nodes by themselves",
    Ability.CUDA: "does not compute on an accelerator",
}
_SETTINGS = (Ability.BUDGET, Ability.TARGET, Ability.CURVE, Ability.SYMMETRY, Ability.SUBTRACT)
_FARTHEST = 1000  # longest sides of the shape from its middle


@dataclass(frozen=True)
class Start:
    """What a fit refines and continues."""

    assembly: Assembly
    locked: tuple[str, ...] = ()
    """Names of its parts that stay as they are, bit for bit."""

    def __post_init__(self) -> None:
        if isinstance(self.locked, str):
            raise SettingError(f"locked: expected names of parts in a list, got {self.locked!r}")
        object.__setattr__(self, "locked", tuple(self.locked))

    def check_size(self, shape: Shape) -> None:
        """Raise SettingError where a locked part is so large or so far from the shape that no numbers hold
        both, as where the two are in other units."""
        corners = shape.bounds()
        side, middle = float(np.ptp(corners, axis=0).max()), corners.mean(axis=0)
        for part in self.assembly.parts:
            box = part.bounds()
            ends = np.abs(np.asarray(box) - middle).max() / side
            if part.name in self.locked and np.isfinite(ends) and ends > _FARTHEST:
                raise SettingError(
                    f"the locked part {part.name} reaches {ends:.2g} times the shape's longest side away; at "
                    f"most {_FARTHEST} can be held beside it. Check that both are in the same units"
                )

    @classmethod
    def of(cls, given: Assembly | Start | None) -> Start | None:
        """An assembly alone has no locked parts."""
        return cls(given) if isinstance(given, Assembly) else given

    @classmethod
    def locking(cls, given: Assembly | Start | None, names: Iterable[str]) -> Start | None:
        """With these parts locked, if any are named."""
        names, start = tuple(names), cls.of(given)
        if names and start is None:
            raise SettingError("locked parts need an assembly to start from")
        return replace(start, locked=names) if start and names else start


@dataclass(frozen=True)
class Tolerance:
    """Distances between the surfaces that an assembly keeps: in the shape's units, or text as "0.5mm" or
    "1%" of the longest side."""

    within: float | str | None = None
    """The largest distance between the surfaces, both ways, kept with the fewest parts that do."""
    contain: float | str | bool | None = None
    """The shape nowhere sticks out of the assembly by more than this; True is 0."""
    inside: float | str | bool | None = None
    """The assembly nowhere sticks out of the shape by more than this; True is 0."""

    @classmethod
    def of(cls, given: float | str | Tolerance | None) -> Tolerance | None:
        """A length alone holds both ways. None where nothing is asked for."""
        tolerance = given if isinstance(given, Tolerance) else cls(given)
        asked = (tolerance.within, tolerance.contain, tolerance.inside)
        return tolerance if any(one is not None and one is not False for one in asked) else None


@dataclass(frozen=True)
class Clean:
    """Numbers made plain and relations exact after the fit (`partwright.clean`)."""

    tolerance: float | None = None
    """How much further from the shape any part may come to lie by that, on average, in the shape's units;
    None: half a thousandth of the longest side, or the mesh's noise where that is more."""

    @classmethod
    def of(cls, given: bool | Clean | None) -> Clean | None:
        return cls() if given is True else (given or None)

    @classmethod
    def keeping(cls, given: bool | Clean | None, tolerance: float | None) -> Clean | None:
        """With this tolerance, if one is given."""
        clean = cls.of(given)
        if tolerance is not None and clean is None:
            raise SettingError("a clean tolerance was given, but nothing is to be cleaned; add --clean")
        return replace(clean, tolerance=tolerance) if clean and tolerance is not None else clean


def check_able(method: Method[Any], *asked: Ability) -> None:
    """Raises SettingError for the first ability that the method lacks; it names methods that have it."""
    for ability in asked:
        if ability in method.can:
            continue
        able = [name for name in METHODS if ability in METHODS[name].can]
        use = f"; use method {' or '.join(able)}" if able else ""
        raise SettingError(f"{method.name} {_LACKS[ability]} ({ability.value}){use}")


def suitable(method: Method[Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The settings but for those that ask a method for nothing that it lacks: max_parts=None, curve=False.

    Raises:
        SettingError: they do ask for something that the method cannot do.
    """
    lacking = {a.value: a for a in _SETTINGS if a not in method.can and a.value in settings}
    for name, ability in lacking.items():
        if settings[name] is not None and settings[name] is not False:
            check_able(method, ability)
    return {name: value for name, value in settings.items() if name not in lacking}
