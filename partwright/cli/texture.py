"""`partwright texture`: a shape's colours as maps of the parts."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.atomic_io import report_path
from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output, given


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "texture",
        help="give an assembly's parts the colours of the shape that they stand for",
        description="Bakes the colours of a mesh (of vertices, faces, materials and their images) into a map "
        "for each part, and its normals into another where that pays: in the part's own coordinates, so that "
        "they stay right when the part is changed. The maps are optimised against views from all around. "
        "Writes the assembly with its maps to FILE (.json), and to FILE.report.json the PSNR of eight other "
        "views before and after; `partwright export` then writes the maps to GLB, USD, Blender's script and "
        "HTML (the latter without normals).",
    )
    option = command.add_argument
    add_assembly(command)
    option("shape", metavar="SHAPE", type=Path, help="a mesh with colours: GLB, glTF, OBJ, PLY or OFF")
    add_output(command, "FILE", "where to write", reads=_reads, writes=_writes)
    option("--size", metavar="N", type=int, default=128, help="texels a side (default: %(default)s)")
    command.set_defaults(run="texture")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return given(arguments.assembly, arguments.shape)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, report_path(arguments.output)]
