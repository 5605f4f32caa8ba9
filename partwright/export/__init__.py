"""What goes out: one format a file. A new format is a new file and one line in the table."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright.errors import NothingToExportError, ParameterError, SettingError, UnsupportedFormatError

if TYPE_CHECKING:
    from partwright.assembly import Assembly

# suffix -> module whose `write(assembly, path, **options)` writes it
WRITERS = {
    ".json": "partwright.export.json_file",
    ".glb": "partwright.export.glb",
    ".ply": "partwright.export.ply",
    ".stl": "partwright.export.stl",
    ".obj": "partwright.export.obj",
    ".glsl": "partwright.export.glsl",
    ".step": "partwright.export.step",
    ".stp": "partwright.export.step",
    ".scad": "partwright.export.openscad",
    ".build123d.py": "partwright.export.build123d_source",
    ".blender.py": "partwright.export.blender",
    ".mjcf": "partwright.export.mjcf",
    ".mjcf.xml": "partwright.export.mjcf",
    ".urdf": "partwright.export.urdf",
    ".3mf": "partwright.export.threemf",
    ".usda": "partwright.export.usd",
    ".usdc": "partwright.export.usd",
    ".usd": "partwright.export.usd",
}

__all__ = ["WRITERS", "export"]


def export(assembly: Assembly, path: str | Path, **options: Any) -> None:
    """Write the assembly in the format that the path's suffix names.

    Options, where the format has them: `resolution` of what is meshed (cells along the longest side),
    `by_part` (each part closed by itself: OBJ, PLY, STL, 3MF), `density`, `tolerance` and `free_joint` (MJCF,
    URDF), `separate` (STEP: one product a part). Parts that the format cannot hold become the nearest that it
    can, and FILE.report.json says which and how far off.

    Raises:
        UnsupportedFormatError: the suffix names no known format.
        SettingError: the format has no such option.
        ParameterError: an option's value makes no sense.
        OutputError: the file cannot be written.
    """
    import inspect  # heavy, and this module is imported by every `import partwright`

    suffix = _suffix(Path(path))
    write: Callable[..., None] = import_module(WRITERS[suffix]).write
    known = list(inspect.signature(write).parameters)[2:]
    for name in options:
        if name not in known:
            raise SettingError(
                f"{suffix} has no option {name!r}; it has {', '.join(known) if known else 'none'}"
            )
    cells = options.get("resolution", 1)
    if isinstance(cells, bool) or not isinstance(cells, int) or cells < 1:
        raise ParameterError(f"resolution: expected a number of cells, at least 1, got {cells!r}")
    lower, upper = assembly.bounds()
    if suffix != ".json" and not (upper > lower).any():
        raise NothingToExportError(
            f"cannot export {Path(path).name}: nothing is inside of the assembly; its parts have no size, or "
            "what is intersected does not overlap"
        )
    write(assembly, path, **options)


def _suffix(path: Path) -> str:
    """The key of `WRITERS` with which the name ends: ".blender.py" is one, ".py" is none."""
    found = next((suffix for suffix in WRITERS if path.name.lower().endswith(suffix)), None)
    if found is None:
        raise UnsupportedFormatError(
            f"cannot export {path.name}: the suffix {path.suffix.lower()!r} names no format; "
            f"use one of {', '.join(WRITERS)}"
        )
    return found
