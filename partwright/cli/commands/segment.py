"""What `partwright segment` does."""

from __future__ import annotations

import argparse

from partwright.assembly import load_assembly
from partwright.cleaning.segmentation import check_within, node_labels, segment_faces
from partwright.cleaning.splitting import split_at_borders
from partwright.cli.segment import NODES
from partwright.cli.terminal import say
from partwright.export.label_files import check_suffix, write_segments
from partwright.shapes import load_shape
from partwright.shapes.labels import read_labels


def run(arguments: argparse.Namespace) -> int:
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
