"""What `partwright evaluate` does."""

from __future__ import annotations

import argparse
import json

from partwright.assembly import load_assembly
from partwright.cli.tables import print_scores
from partwright.errors import SettingError
from partwright.metrics import evaluate
from partwright.shapes import load_shape


def run(arguments: argparse.Namespace) -> int:
    if arguments.cad is not None and not 100 <= arguments.cad <= 1_000_000:
        raise SettingError(f"--cad {arguments.cad}: expected 100 to 1000000 points")
    assembly = load_assembly(arguments.assembly)
    shape = load_shape(arguments.shape, assembly.unit, assembly.up, arguments.thickness)
    scores = evaluate(assembly, shape, cad_points=arguments.cad)
    if arguments.json:
        print(json.dumps(scores.to_dict(), indent=2))
    else:
        print_scores(arguments.assembly.name, scores, shape.unit)
    return 0
