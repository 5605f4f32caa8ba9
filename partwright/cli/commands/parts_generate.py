"""What `partwright parts generate` does."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from partwright.atomic_io import replacing_files
from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.parts_generate import CHANGE, sample_name
from partwright.cli.progress import Work
from partwright.cli.terminal import counted, say, warn
from partwright.errors import SettingError
from partwright.methods import Cancellation, check_count
from partwright.partsdf.assemblies import to_assembly
from partwright.partsdf.from_photo import reconstruct_photo
from partwright.partsdf.generator import load_generator
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.novelty import nearest_training_shape
from partwright.partsdf.pictures import picture
from partwright.partsdf.resampling import Sample, sound_samples
from partwright.partsdf.soundness import layout_faults
from partwright.partsdf.sources import found_in, open_source
from partwright.render import Camera, sheet, write_png
from partwright.shapes import PICTURE_SUFFIXES, SUFFIXES

_PANEL, _COLUMNS = 240, 4  # pixels
_STALE = re.compile(r"sample_\d+\.json")


def run(arguments: argparse.Namespace) -> int:
    _check(arguments)
    model = load_model(arguments.model)
    keep = _names(arguments.keep, model)
    generator = load_generator(model)
    change = (CHANGE if arguments.change is None else arguments.change) if arguments.like else 0.0
    camera, cancel = Camera(up=model.up), Cancellation()
    made: list[Sample] = []
    nearest: list[tuple[str, float]] = []
    panels: list[np.ndarray] = []
    with Work("reading") as work, ExitStack() as hearing:
        source = _kept(arguments, model)
        odd = layout_faults(source) if arguments.poses and source is not None else []
        warn([f"in {arguments.poses} {fault}; so they do in all samples" for fault in odd])
        hearing.enter_context(stopping(cancel.request))
        work.stage("making")
        for one in sound_samples(
            generator, arguments.count, arguments.seed, source, keep,
            keep_layout=arguments.poses is not None, change=change, tries=arguments.tries, told=work.show,
        ):  # fmt: skip
            # Each with all that is told of it, so that what is done may be kept.
            nearest.append(nearest_training_shape(one.shape))
            panels.append(picture(one.shape, None, _PANEL, camera))
            made.append(one)
            if cancel.requested:
                break
        captions = [f"{i}: {100 * far:.1f} from {name}" for i, (name, far) in enumerate(nearest)]
        if arguments.like and source is not None:
            panels.insert(0, picture(source, None, _PANEL, camera))
            captions.insert(0, "like this")
        about = {
            "model": {"name": model.name, "hash": model.hash},
            "seed": arguments.seed,
            "asked": arguments.count,
            "kept": list(keep) or ("poses" if arguments.poses else []),
            "layout_faults": odd,
            "like": {"shape": arguments.like, "change": change} if arguments.like else None,
            "samples": [
                {
                    "file": sample_name(i, arguments.count),
                    "parts": one.shape.names(),
                    "nearest": name,
                    "difference": far,
                    "tries": one.tries,
                    "faults": one.soundness.faults(),
                }
                for i, (one, (name, far)) in enumerate(zip(made, nearest, strict=True))
            ],
        }
        with replacing_files(arguments.output, _STALE) as folder:
            for i, one in enumerate(made):
                source_text = f"{model.name}, seed {arguments.seed}, sample {i}"
                to_assembly(one.shape, up=model.up, source=source_text).save(
                    folder / sample_name(i, arguments.count)
                )
            write_png(folder / "samples.png", sheet(panels, captions, min(_COLUMNS, len(panels))))
            (folder / "samples.json").write_text(json.dumps(about, indent=1))
    warn(_broken(made))
    again = sum(one.tries > 1 for one in made)
    least = min(far for _, far in nearest)
    say(
        f"{counted(len(made), 'shape')} of {model.name}'s family: {arguments.output}; the least new "
        f"differs by {100 * least:.2f} hundredths of a unit length from one that was trained on"
        + (f"; {again} of them made anew, as parts came apart or out of place" if again else "")
    )
    if cancel.requested:
        warn([f"interrupted: {counted(len(made), 'sample')} of {arguments.count} written"])
        return INTERRUPTED
    return 0


def _broken(made: Sequence[Sample]) -> list[str]:
    """One line where samples are still broken, else nothing."""
    broken = [(i, one.soundness.faults()) for i, one in enumerate(made) if one.soundness.faults()]
    if not broken:
        return []
    number, faults = broken[0]
    tries = "try" if made[number].tries == 1 else "tries"
    return [
        f"{counted(len(broken), 'sample')} may be broken after {made[number].tries} {tries}: in {number}, "
        f"{' and '.join(faults)}; look at samples.png"
    ]


def _check(arguments: argparse.Namespace) -> None:
    check_count("--count", arguments.count, low=1)
    check_count("--tries", arguments.tries, low=1)
    given = [name for name in ("keep", "poses", "like") if getattr(arguments, name)]
    if len(given) > 1:
        raise SettingError(
            "--poses keeps the poses of all parts, --keep some parts whole, --like nothing quite; "
            "give one of them"
        )
    if bool(arguments.keep) != bool(arguments.of):
        raise SettingError("--keep PARTS and --of SHAPE go together: which parts stay, and of which shape")
    if arguments.change is not None and not arguments.like:
        raise SettingError("--change says how far from --like; give --like SHAPE, too")
    if arguments.change is not None and not 0 < arguments.change <= 1:
        raise SettingError(f"--change is {arguments.change}; expected above 0 and at most 1")


def _kept(arguments: argparse.Namespace, model: Model) -> NeuralShape | None:
    """The shape of which something stays."""
    text = arguments.of or arguments.poses or arguments.like
    return _source(text, arguments, model) if text else None


def _names(text: str | None, model: Model) -> list[str]:
    """Of parts that stay, before anything is read or made; raises SettingError for what is none."""
    names = [name.strip() for name in text.split(",")] if text else []
    for name in names:
        model.index(name)
    return names


def _source(text: str, arguments: argparse.Namespace, model: Model) -> NeuralShape:
    """A shape of the model, or what is found in a mesh, points or a picture; says what is odd about that."""
    suffix = Path(text).suffix.lower()
    if suffix in PICTURE_SUFFIXES:
        seen = reconstruct_photo(model, text)
        warn(seen.warnings)
        return seen.shape
    if suffix in SUFFIXES:
        found, warnings = found_in(model, text, seed=arguments.seed)
        warn(warnings)
        return found
    return open_source(text, arguments.model).shape
