"""What goes out: one format a file. A new format is a new file and one line in the table of `formats`."""

from __future__ import annotations

TYPE_CHECKING = False  # `import partwright` imports this room: nothing that is not needed at once
if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any

    from partwright.assembly import Assembly

__all__ = ["export"]


def export(assembly: Assembly, path: str | Path, **options: Any) -> None:
    """Write the assembly in the format that the path's suffix names.

    Options, where the format has them: `resolution` of what is meshed (cells along the longest side),
    `by_part` (each part closed by itself: OBJ, PLY, STL, 3MF), `density`, `tolerance` and `free_joint` (MJCF,
    URDF), `physics` (colliders in GLB, OBJ and USD), `separate` (STEP: one product a part), `joined` (GLB:
    the one surface of all parts, blends and all). Parts that the format cannot hold become the nearest that
    it can, and FILE.report.json says which and how far off.

    Raises:
        UnsupportedFormatError: the suffix names no known format, or the format cannot hold a part at all.
        SettingError: the format has no such option.
        ParameterError: an option's value makes no sense.
        MissingDependencyError: the format needs a package that is not installed.
        UnitError: the format cannot say the assembly's unit.
        OutputError: the file cannot be written.
    """
    from pathlib import Path

    from partwright.export.formats import format_of

    chosen = format_of(path)
    chosen.check(assembly, options)
    chosen.save(assembly, Path(path), options)
