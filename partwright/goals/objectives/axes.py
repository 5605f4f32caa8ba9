"""Directions as they are typed: x, -z."""

from __future__ import annotations

import numpy as np

from partwright.errors import SettingError
from partwright.shapes.units import axis_vector


def axis(text: str, default: str, what: str) -> np.ndarray:
    """(3,) unit vector of "x", "-y" ...; of the default where nothing is said.

    Raises:
        SettingError: it is no axis.
    """
    name = (text or default).lower().removeprefix("+")
    if name.removeprefix("-") not in ("x", "y", "z"):
        raise SettingError(f"{what}: expected an axis (x, y, z, -x, -y or -z), got {text!r:.40}")
    return axis_vector(name)
