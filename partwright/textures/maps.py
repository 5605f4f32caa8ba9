"""The map of a part: an image, kept in the part's metadata as a PNG in a data URL."""

from __future__ import annotations

import base64
import binascii
import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields import Field
from partwright.textures.coordinates import directions, folded
from partwright.textures.texels import read

KEY = "texture"
"""Of a part's metadata."""
RELIEF = "normals"
"""Of a part's metadata: its normal map, of the same form. Colours are x, y and z from -1 to 1: z is away from
the surface, x along the map's rows and y up its columns."""
LARGEST = 1024  # texels a side
_PREFIX = "data:image/png;base64,"


@dataclass(frozen=True)
class PartMap:
    """Colours (N, N, 3) uint8, sRGB, rows from the bottom; of a hollow part (N, 2 N, 3): outside and inside.

    Raises:
        ParameterError: the image has another form.
    """

    image: NDArray[np.uint8]

    def __post_init__(self) -> None:
        rows, columns, *rest = self.image.shape
        if rest != [3] or columns not in (rows, 2 * rows) or not 1 <= rows <= LARGEST:
            raise ParameterError(
                f"a part's map is {self.image.shape}; expected (N, N, 3), or (N, 2 N, 3) of a hollow part, "
                f"with N up to {LARGEST}"
            )

    @property
    def size(self) -> int:
        return int(self.image.shape[0])

    @property
    def sides(self) -> int:
        """1, or 2 where the inside has a map of its own."""
        return int(self.image.shape[1] // self.size)

    def at(self, field: Field, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Colours (n, 3), 0 to 255, at points (n, 3) of the field's own frame: bilinear."""
        towards, inner = directions(field, points)
        return read(self.image, folded(towards), inner & (self.sides == 2))

    def text(self) -> str:
        """For the metadata."""
        from PIL import Image

        out = io.BytesIO()
        Image.fromarray(self.image[::-1]).save(out, "PNG", optimize=True)
        return _PREFIX + base64.b64encode(out.getvalue()).decode("ascii")

    @classmethod
    def read(cls, text: str) -> PartMap:
        """The inverse of `text`.

        Raises:
            ParameterError: it is no such text, or the image has another form.
        """
        from PIL import Image

        if not text.startswith(_PREFIX):
            raise ParameterError(f"a part's map is a PNG in a data URL ({_PREFIX}...), got {text[:40]!r}")
        try:
            data = base64.b64decode(text.removeprefix(_PREFIX), validate=True)
            with Image.open(io.BytesIO(data), formats=["PNG"]) as opened:
                if max(opened.size) > 2 * LARGEST:
                    raise ParameterError(f"a part's map is {opened.size}; at most {LARGEST} texels a side")
                image = np.asarray(opened.convert("RGB"))
        except (binascii.Error, OSError, ValueError, SyntaxError) as error:
            raise ParameterError(f"a part's map is no PNG that can be read: {error}") from error
        return cls(np.ascontiguousarray(image[::-1]))


def without_maps(metadata: Mapping[str, str | float]) -> dict[str, str | float]:
    """What else a part's metadata says: formats keep the maps as pictures."""
    return {key: value for key, value in metadata.items() if key not in (KEY, RELIEF)}


def part_map(metadata: Mapping[str, str | float] | Part, key: str = KEY) -> PartMap | None:
    """The map of a part, by the part or by its metadata; None where it has none. key: KEY, or RELIEF.

    Raises:
        ParameterError: what it has is no map.
    """
    known = metadata.metadata if isinstance(metadata, Part) else metadata
    text = known.get(key)
    return PartMap.read(str(text)) if text is not None else None
