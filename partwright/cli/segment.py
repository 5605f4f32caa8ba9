"""`partwright segment`: every face of a shape labelled by its part."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.outputs import add_output, given

NODES = "nodes"


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "segment",
        help="label every face of a shape by its part",
        description="Labels every face of SHAPE by the part of ASSEMBLY that is nearest to it. Writes the "
        "faces in a colour a part to FILE (.glb or .ply), and FILE.labels.json.",
    )
    command.add_argument("shape", metavar="SHAPE", type=Path, help="the mesh or scene to label")
    command.add_argument("assembly", metavar="ASSEMBLY", type=Path, help="an assembly file (.json)")
    add_output(command, "FILE", "where to write", reads=_reads, writes=_writes)
    command.add_argument(
        "--within",
        metavar="LABELS",
        type=Path,
        help="labels that parts must not cross: a file with one a face (.json, .npy or text), "
        f"or {NODES!r} for the nodes of the scene",
    )
    command.add_argument(
        "--split", action="store_true", help="cut faces along the borders between parts; their number grows"
    )
    command.set_defaults(run=run)


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return given(arguments.shape, arguments.assembly, arguments.within)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    from partwright.shapes.labels import labels_path

    return [arguments.output, labels_path(arguments.output)]


def run(arguments: argparse.Namespace) -> int:
    from partwright.assembly import load_assembly
    from partwright.cleaning.label_files import check_suffix, write_segments
    from partwright.cleaning.segmentation import check_within, node_labels, segment_faces
    from partwright.cleaning.splitting import split_at_borders
    from partwright.cli.terminal import say
    from partwright.shapes import load_shape
    from partwright.shapes.labels import read_labels

    check_suffix(arguments.output)
    assembly = load_assembly(arguments.assembly)
    shape = load_shape(arguments.shape, unit=assembly.unit, up=assembly.up)
    within = None
    if arguments.within is not None:
        within = node_labels(shape) if str(arguments.within) == NODES else read_labels(arguments.within)
    vertices, faces = shape.input_vertices, shape.input_faces
    if arguments.split:
        vertices, faces, source = split_at_borders(vertices, faces, assembly)
        within = None if within is None else check_within(within, len(shape.input_faces))[source]
    labels, names = segment_faces(vertices, faces, assembly, within)
    write_segments(arguments.output, vertices, faces, labels, names, assembly)
    say(f"{len(labels)} faces, {len(set(labels.tolist()))} labels: {arguments.output}")
    return 0
