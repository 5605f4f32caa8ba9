"""What may be asked of an assembly: lengths with units, and which of them contradict each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

from partwright.errors import BoundsError, SettingError
from partwright.shapes import LONGEST_SIDE, Length, Shape, length_text, own_length
from partwright.tolerances.noise import roughness

# Of the longest side. Samples 0.7 % apart on each surface tell no finer difference reliably.
RESOLUTION = 1e-3
_NOISE = 3.0  # deviations of the noise that a tolerance has to leave room for


@dataclass(frozen=True)
class DistanceBounds:
    """How far surfaces may be apart, in unit lengths; None where nothing is asked."""

    tolerance: float | None = None
    """The surfaces are nowhere further apart, both ways."""
    contain: float | None = None
    """The shape nowhere sticks out of the assembly by more."""
    inside: float | None = None
    """The assembly nowhere sticks out of the shape by more."""

    @classmethod
    def of(
        cls,
        shape: Shape,
        tolerance: Length | None = None,
        contain: Length | bool | None = None,
        inside: Length | bool | None = None,
    ) -> DistanceBounds:
        """Bounds from lengths in the shape's own units, or text: "0.5", "0.5mm", "1%" of the longest side.

        `contain` and `inside` may be True: no slack at all.

        Raises:
            BoundsError: a length that is none, bounds that no assembly can keep, or a tolerance finer than
                the shape's own noise or than samples can tell.
        """
        bounds = cls(
            _length("tolerance", tolerance, shape),
            _slack("contain", contain, shape),
            _slack("inside", inside, shape),
        )
        bounds._check(shape)
        return bounds

    @property
    def only_tolerance(self) -> bool:
        return self.tolerance is not None and self.contain is None and self.inside is None

    @property
    def out(self) -> float:
        """How far the shape may stick out of the assembly; infinite where that is not bounded."""
        return min((b for b in (self.contain, self.tolerance) if b is not None), default=math.inf)

    @property
    def beyond(self) -> float:
        """How far the assembly may stick out of the shape; infinite where that is not bounded."""
        return min((b for b in (self.inside, self.tolerance) if b is not None), default=math.inf)

    @property
    def within(self) -> float:
        return math.inf if self.tolerance is None else self.tolerance

    def narrowed(self, margin: float, share: float = 1.0) -> DistanceBounds:
        """Bounds that ask for `margin` (unit lengths) more, of a tolerance for this share."""
        return DistanceBounds(
            None if self.tolerance is None else max(share * self.tolerance - margin, self.tolerance / 2),
            None if self.contain is None else self.contain - margin,
            None if self.inside is None else self.inside - margin,
        )

    def _check(self, shape: Shape) -> None:
        least = RESOLUTION * LONGEST_SIDE
        if self.tolerance is not None:
            asked, noise = format_length(self.tolerance, shape), _NOISE * roughness(shape)
            if self.tolerance < least:
                raise BoundsError(
                    f"tolerance {asked} is finer than a surface's samples can tell; "
                    f"the least for this shape is {format_length(least, shape)}"
                )
            if self.tolerance < noise:
                raise BoundsError(
                    f"tolerance {asked} is less than the noise of the shape's own surface; "
                    f"give at least {format_length(noise, shape)}, or smooth the shape"
                )
        if self.contain is not None and self.inside is not None and self.contain + self.inside < least:
            raise BoundsError(
                f"contain {format_length(self.contain, shape)} and inside "
                f"{format_length(self.inside, shape)} leave no room between the two surfaces; "
                f"give one of them at least {format_length(least, shape)}"
            )


def format_length(length: float, shape: Shape) -> str:
    """A unit length in the shape's own units, for people; never rounded down to less than it is."""
    own = float(shape.frame.length_from_unit(length))
    if own > 0:
        digit = 10.0 ** (math.floor(math.log10(own)) - 2)
        own = math.ceil(own / digit - 1e-6) * digit
    return length_text(own, shape.unit)


def _slack(name: str, given: Length | bool | None, shape: Shape) -> float | None:
    if isinstance(given, bool):
        return 0.0 if given else None
    return _length(name, given, shape)


def _length(name: str, given: Length | None, shape: Shape) -> float | None:
    """A length in the unit frame."""
    if given is None:
        return None
    longest = float(shape.frame.length_from_unit(LONGEST_SIDE))
    try:
        return float(shape.frame.length_to_unit(own_length(given, shape.unit, longest)))
    except SettingError as error:
        raise BoundsError(f"{name}: {error}") from error
