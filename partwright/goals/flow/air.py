"""The air around a body: from where it comes, how fast, over which ground, and how finely it is solved."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from partwright.errors import SettingError
from partwright.goals.objectives.axes import axis

BACKGROUND = 4  # cells along the body's longest side, far away


@dataclass(frozen=True)
class Air:
    """How a body is simulated.

    flow: the axis along which the air moves (x, -y ...). ground: the axis at whose lower end a ground moves
    with the air ("z": below), or "" for free air. turning: pattern of the names of parts that roll on it, or
    "". speed: m/s. cells: along the longest side, near it (4,
    8, 16, 32 ...). iterations: of the steady solver. time_limit: seconds, of all programs together.

    Raises:
        SettingError: a number cannot be used, or the ground stands in the way of the flow.
    """

    flow: str = "x"
    ground: str = ""
    speed: float = 30.0
    cells: int = 32
    iterations: int = 200
    time_limit: float = 1800.0
    turning: str = ""

    def __post_init__(self) -> None:
        if not (self.speed > 0 and self.cells >= BACKGROUND and self.iterations >= 1 and self.time_limit > 0):
            raise SettingError(
                f"expected a positive speed, time and iterations, and {BACKGROUND} cells, got {self}"
            )
        if self.ground and abs(axis(self.ground, "z", "ground") @ self.direction) > 0:
            raise SettingError(
                f"the ground along {self.ground} stands in the way of a flow along {self.flow}"
            )

        if self.turning and not self.ground:
            raise SettingError("air: what turns needs a ground to roll on: y,ground,turning=wheel_*")

    @classmethod
    def of(cls, text: str, up: str | None = None) -> Air:
        """Of AXIS[,ground][,cells=N][,iterations=N][,speed=V][,seconds=S][,turning=PARTS].

        up: of the assembly.

        Raises:
            SettingError: it says something else.
        """
        first, *others = [part.strip() for part in text.split(",")]
        values: dict[str, Any] = {}
        kinds = {"cells": int, "iterations": int, "speed": float, "seconds": float, "turning": str}
        for other in others:
            name, _, value = other.partition("=")
            try:
                if name == "ground" and not value:
                    values["ground"] = up or "z"
                else:
                    values["time_limit" if name == "seconds" else name] = kinds[name](value)
            except (KeyError, ValueError) as error:
                raise SettingError(
                    "air: expected AXIS[,ground][,cells=N][,iterations=N][,speed=V][,seconds=S]"
                    f"[,turning=PARTS], got {text!r:.80}"
                ) from error
        axis(first, "x", "air")
        return cls(flow=first or "x", **values)

    @property
    def direction(self) -> np.ndarray:
        """(3,) unit vector along which the air moves."""
        return axis(self.flow, "x", "flow")

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)
