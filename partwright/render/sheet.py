"""Pictures side by side with captions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.errors import SettingError
from partwright.render.shading import BACKGROUND

INK, SOFT_INK = (38, 42, 50), (112, 118, 128)
CAPTION_HEIGHT, TITLE_HEIGHT = 30, 34


def sheet(
    images: Sequence[np.ndarray], captions: Sequence[str] = (), columns: int | None = None, title: str = ""
) -> np.ndarray:
    """One picture (H, W, 3) uint8 of equally large pictures in rows, captions above them, title on top.

    Raises SettingError where pictures differ in size or captions in number.
    """
    if not images or len({image.shape for image in images}) > 1:
        raise SettingError("A contact sheet needs at least one picture, and all of one size.")
    if captions and len(captions) != len(images):
        raise SettingError(f"A contact sheet of {len(images)} pictures got {len(captions)} captions.")
    columns = columns or len(images)
    height, width = images[0].shape[:2]
    above = CAPTION_HEIGHT if captions else 0
    top = TITLE_HEIGHT if title else 0
    rows = -(-len(images) // columns)
    page = np.empty((top + rows * (height + above), columns * width, 3), dtype=np.uint8)
    page[:] = BACKGROUND
    for number, image in enumerate(images):
        row, column = divmod(number, columns)
        y = top + row * (height + above) + above
        page[y : y + height, column * width : (column + 1) * width] = image
    labels = [
        (
            (number % columns + 0.5) * width,
            top + (number // columns) * (height + above) + above / 2 + 1,
            text,
        )
        for number, text in enumerate(captions)
    ]
    page = draw_text(page, labels, size=15, colour=SOFT_INK)
    return draw_text(page, [(columns * width / 2, top / 2 + 3, title)], size=18) if title else page


def draw_text(
    image: np.ndarray,
    labels: Sequence[tuple[float, float, str]],
    size: int = 14,
    colour: tuple[int, int, int] = INK,
) -> np.ndarray:
    """The picture with texts centred at (x, y); a text that is wider than the picture is cut short."""
    from PIL import Image, ImageDraw, ImageFont

    canvas = Image.fromarray(image)
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(size=size)
    for x, y, text in labels:
        shown = "".join(c if c.isprintable() else " " for c in text)  # names may hold anything
        while len(shown) > 4 and draw.textlength(shown, font=font) > image.shape[1] - 8:
            shown = shown.removesuffix("...")[:-1] + "..."
        draw.text((x, y), shown, fill=colour, font=font, anchor="mm")
    return np.asarray(canvas)
