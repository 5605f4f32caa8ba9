"""`partwright segment`: every face of a shape labelled by its part."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output, given
from partwright.cli.reading import add_thickness

NODES, COLOURS, PROPERTY = "nodes", "colours", "face:"


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "segment",
        help="label every face of a shape by its part",
        description="Labels every face of SHAPE by the part of ASSEMBLY that is nearest to it. Writes the "
        "faces in a colour a part to FILE (.glb, .ply or .usd), and FILE.labels.json.",
    )
    command.add_argument("shape", metavar="SHAPE", type=Path, help="the mesh or scene to label")
    add_assembly(command)
    add_thickness(command)
    add_output(command, "FILE", "where to write", reads=_reads, writes=_writes)
    command.add_argument(
        "--within",
        metavar="LABELS",
        help="labels that parts must not cross: a file with one a face (.json, .npy or text), "
        f"{NODES!r} for the nodes of the scene, {COLOURS!r} for one colour a label, or {PROPERTY}NAME for a "
        "property of a PLY's faces",
    )
    command.add_argument(
        "--copies", action="store_true", help="each copy of a repeated part has a label of its own"
    )
    command.add_argument(
        "--split", action="store_true", help="cut faces along the borders between parts; their number grows"
    )
    command.set_defaults(run="segment")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    within = arguments.within
    named = within in (NODES, COLOURS) or (within or "").startswith(PROPERTY)
    return given(arguments.shape, arguments.assembly, None if named else within)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    from partwright.shapes.labels import labels_path

    return [arguments.output, labels_path(arguments.output)]
