"""What a notebook shows of an assembly: the page, and where HTML is stripped a still picture."""

from __future__ import annotations

import base64
import io
from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING

from partwright.assembly.palette import palette
from partwright.errors import PartwrightError, UnsupportedFormatError
from partwright.export.formats import format_of
from partwright.export.html import to_html
from partwright.meshing import mesh_assembly
from partwright.render import Camera, render_mesh
from partwright.render.part_colours import surface_parts

if TYPE_CHECKING:
    from partwright.assembly import Assembly

_HEIGHT = 520  # pixels
_STILL = (480, 360)


def bundle(assembly: Assembly) -> dict[str, str]:
    """By media type. What cannot be shown, as an assembly without inside, is left out; the text never is."""
    result = {"text/plain": assembly.describe()}
    try:
        format_of("a.html").check(assembly, {})
        page = escape(to_html(assembly), quote=True)
    except UnsupportedFormatError:
        pass  # learned parts that are cut, or too many: the still shows them
    except PartwrightError:
        return result
    else:
        frame = f'style="width: 100%; height: {_HEIGHT}px; border: 0" sandbox="allow-scripts allow-downloads"'
        result["text/html"] = f'<iframe {frame} srcdoc="{page}"></iframe>'
    with suppress(PartwrightError):
        result["image/png"] = base64.b64encode(still(assembly)).decode("ascii")
    return result


def still(assembly: Assembly) -> bytes:
    """A picture as PNG, each part in its colour.

    Raises:
        NoSurfaceError: nothing is inside of the assembly.
    """
    from PIL import Image

    mesh = mesh_assembly(assembly, 96)
    owners = surface_parts(assembly, mesh.triangles_center, mesh.face_normals)
    picture = render_mesh(mesh, Camera(up=assembly.up or "z"), _STILL, palette(len(assembly))[owners])
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG", optimize=True)
    return out.getvalue()
