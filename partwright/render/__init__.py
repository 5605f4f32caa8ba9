"""Pictures by ray casting: stills, contact sheets, turntables and previews. No screen is needed."""

from __future__ import annotations

from partwright.render.camera import Camera
from partwright.render.curve import curve_sheet
from partwright.render.output import write_png
from partwright.render.picture import render_mesh, turntable
from partwright.render.preview import preview
from partwright.render.sheet import sheet

__all__ = ["Camera", "curve_sheet", "preview", "render_mesh", "sheet", "turntable", "write_png"]
