"""An assembly as the last line of a cell."""

from __future__ import annotations

import base64
import html
import io
import re

from PIL import Image

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.fields import Box, Quadric, Sphere


def test_a_notebook_gets_the_page_a_still_and_words() -> None:
    assembly = Assembly((Part(Box((2, 1, 1)), name='"><b'), Part(Sphere(0.6), (1, 0, 0.5))), up="z")
    shown = assembly._repr_mimebundle_()
    frame = re.fullmatch(r'<iframe [^<>]* srcdoc="([^"]*)"></iframe>', shown["text/html"])
    assert frame is not None
    page = html.unescape(frame[1])
    data = page.split('id="assembly">')[1].split("</script>")[0]
    assert from_text(data) == assembly
    assert "allow-same-origin" not in shown["text/html"]
    picture = Image.open(io.BytesIO(base64.b64decode(shown["image/png"])))
    assert picture.size == (480, 360)
    assert len({picture.convert("RGB").getpixel((x, 180)) for x in range(0, 480, 8)}) > 3
    assert shown["text/plain"] == assembly.describe()


def test_what_has_no_surface_is_told_in_words() -> None:
    nothing = Assembly((Part(Quadric.sphere(1)), Part(Quadric.sphere(1, (5, 0, 0)))), "intersection")
    assert set(nothing._repr_mimebundle_()) == {"text/plain"}
