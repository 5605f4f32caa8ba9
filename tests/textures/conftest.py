"""Smaller pictures than a user's: what the tests say of colours and normals does not depend on their size."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("partwright.textures.sightings._SIDE", 128)  # pixels, of 384
        for module in ("partwright.textures.likeness", "partwright.cli.commands.texture"):
            patch.setattr(f"{module}.SIDE", 192)  # of 512
        yield
