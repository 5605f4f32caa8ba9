"""What `partwright segment` does."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from partwright.assembly import load_assembly
from partwright.cleaning.coarse_labels import colour_labels, property_labels
from partwright.cleaning.segmentation import check_within, node_labels, segment_paths
from partwright.cleaning.splitting import split_at_borders
from partwright.cli.segment import COLOURS, NODES, PROPERTY
from partwright.cli.terminal import say
from partwright.export.label_files import check_suffix, write_segments
from partwright.shapes import Shape, load_shape
from partwright.shapes.labels import read_labels


def run(arguments: argparse.Namespace) -> int:
    check_suffix(arguments.output)
    assembly = load_assembly(arguments.assembly)
    shape = load_shape(arguments.shape, assembly.unit, assembly.up, arguments.thickness)
    if arguments.copies:
        assembly = assembly.expanded()
    within = None if arguments.within is None else _coarse(arguments.within, arguments.shape, shape)
    vertices, faces = shape.input_vertices, shape.input_faces
    if arguments.split:
        vertices, faces, source = split_at_borders(vertices, faces, assembly)
        within = None if within is None else check_within(within, len(shape.input_faces))[source]
    labels, paths = segment_paths(vertices, faces, assembly, within)
    write_segments(arguments.output, vertices, faces, labels, paths, assembly)
    say(f"{len(labels)} faces, {len(set(labels.tolist()))} labels: {arguments.output}")
    return 0


def _coarse(said: str, path: Path, shape: Shape) -> Any:
    """The labels that parts must not cross, as --within names them."""
    if said == NODES:
        return node_labels(shape)
    if said == COLOURS:
        return colour_labels(path, shape)
    if said.startswith(PROPERTY):
        return property_labels(path, said.removeprefix(PROPERTY), len(shape.input_faces))
    return read_labels(said)
