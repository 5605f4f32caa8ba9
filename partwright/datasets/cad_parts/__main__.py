"""`python -m partwright.datasets.cad_parts FOLDER --count N`: CAD parts as PLY and assembly files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from partwright.datasets.cad_parts.drawing import KINDS, cad_parts, write_cad_parts
from partwright.errors import PartwrightError


def main(given: Sequence[str] | None = None) -> int:
    """Exit code of the command with these arguments (the process's own if None)."""
    parser = argparse.ArgumentParser(prog="python -m partwright.datasets.cad_parts", description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="where to write")
    parser.add_argument("--count", metavar="N", type=int, default=100, help="how many (default: 100)")
    parser.add_argument("--seed", metavar="S", type=int, default=0, help="which (default: 0)")
    parser.add_argument("--kind", choices=list(KINDS), help="of one kind only (default: all in turn)")
    parser.add_argument("--sheet", metavar="PNG", type=Path, help="also draw them, side by side")
    arguments = parser.parse_args(given)
    try:
        write_cad_parts(arguments.folder, arguments.count, arguments.seed, arguments.kind)
        if arguments.sheet:
            _draw(arguments)
    except PartwrightError as error:
        print(f"cad_parts: error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _draw(arguments: argparse.Namespace) -> None:
    from partwright.render import render_mesh, sheet, write_png

    parts = list(cad_parts(arguments.count, arguments.seed, arguments.kind))
    pictures = [render_mesh(part.mesh, size=(220, 220)) for part in parts]
    columns = max(1, round(len(parts) ** 0.5 * 1.3))
    write_png(arguments.sheet, sheet(pictures, [part.name for part in parts], columns))


if __name__ == "__main__":
    sys.exit(main())
