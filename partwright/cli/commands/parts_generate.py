"""What `partwright parts generate` does."""

from __future__ import annotations

import argparse
import json
import math
import re

from partwright.atomic_io import replacing_files
from partwright.cli.parts_generate import sample_name
from partwright.cli.progress import Work
from partwright.cli.terminal import counted, say
from partwright.errors import SettingError
from partwright.partsdf.assemblies import to_assembly
from partwright.partsdf.generator import load_generator
from partwright.partsdf.meshing import resolution_for_wall
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.novelty import nearest_training_shape
from partwright.partsdf.pictures import picture
from partwright.partsdf.sources import open_source
from partwright.render import Camera, sheet, write_png

_PANEL, _COLUMNS = 240, 4  # pixels
_COARSE, _FINEST = 64, 192  # cells
_STALE = re.compile(r"sample_\d+\.json")


def run(arguments: argparse.Namespace) -> int:
    model = load_model(arguments.model)
    generator = load_generator(model)
    source, keep = _kept(arguments)
    with Work("making") as work:
        samples = generator.generate(
            arguments.count, arguments.seed, source, keep, keep_layout=arguments.poses is not None
        )
        work.stage("comparing")
        nearest = [nearest_training_shape(one) for one in samples]
        work.stage("drawing")
        camera, pictures = Camera(up="z"), []
        for i, one in enumerate(samples):
            pictures.append(picture(one, _resolution(one), _PANEL, camera))
            work.show((i + 1) / len(samples))
        captions = [f"{i}: {100 * far:.1f} from {name}" for i, (name, far) in enumerate(nearest)]
        about = {
            "model": {"name": model.name, "hash": model.hash},
            "seed": arguments.seed,
            "kept": list(keep) or ("poses" if arguments.poses else []),
            "samples": [
                {
                    "file": sample_name(i, len(samples)),
                    "parts": one.names(),
                    "nearest": name,
                    "difference": far,
                }
                for i, (one, (name, far)) in enumerate(zip(samples, nearest, strict=True))
            ],
        }
        with replacing_files(arguments.output, _STALE) as folder:
            for i, one in enumerate(samples):
                to_assembly(one, up="z", source=f"{model.name}, seed {arguments.seed}, sample {i}").save(
                    folder / sample_name(i, len(samples))
                )
            write_png(folder / "samples.png", sheet(pictures, captions, min(_COLUMNS, len(pictures))))
            (folder / "samples.json").write_text(json.dumps(about, indent=1))
    least = min(far for _, far in nearest)
    say(
        f"{counted(len(samples), 'shape')} of {model.name}'s family: {arguments.output}; the least new "
        f"differs by {100 * least:.2f} hundredths of a unit length from one that was trained on"
    )
    return 0


def _resolution(shape: NeuralShape) -> int:
    """Cells along the unit frame that show the thinnest wall, as far as the cost allows."""
    return min(_FINEST, resolution_for_wall(float(shape.walls().min(initial=math.inf)), _COARSE))


def _kept(arguments: argparse.Namespace) -> tuple[NeuralShape | None, list[str]]:
    """The shape of which something stays, and its parts that do."""
    if arguments.poses is not None and (arguments.keep or arguments.of):
        raise SettingError("--poses keeps the poses of all parts, --keep some parts whole; give one of them")
    if bool(arguments.keep) != bool(arguments.of):
        raise SettingError("--keep PARTS and --of SHAPE go together: which parts stay, and of which shape")
    text = arguments.of or arguments.poses
    keep = [name.strip() for name in arguments.keep.split(",")] if arguments.keep else []
    return (open_source(text, arguments.model).shape if text else None), keep
