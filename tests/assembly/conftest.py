"""An assembly to test with."""

from __future__ import annotations

import pytest

from partwright.assembly import Assembly, Part
from partwright.fields import Cylinder, SuperFrustum


@pytest.fixture
def mug() -> Assembly:
    """A hollow body, a bent handle, and a sphere taken out of both."""
    body = Part(Cylinder(0.5, 1.0), name="body")
    handle = Part(
        SuperFrustum((0.1, 0.1, 0.8), roundness=1.0, bulge=0.8), (-0.5, 0, 0), blend=0.05, name="handle"
    )
    cavity = Part(Cylinder(0.4, 1.0), (0, 0, 0.1), blend=0.02, name="cavity")
    return Assembly((Assembly((body, handle)), cavity), "difference", unit="mm", up="z")
