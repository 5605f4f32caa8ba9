"""Who is warned of: new shapes of each family, of the others, and real ones, by each model that ships."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

import numpy as np
from partsdf_real import SHAPES
from partsdf_scores import command_line, write

import partwright as pw
from partwright.datasets.families.recipes import FAMILIES, make_shape
from partwright.partsdf.familiarity import POOR, STRANGE, Familiarity, familiarity
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct_standing
from partwright.partsdf.starts import ways_to_stand
from partwright.partsdf.targets import Target
from partwright.shapes import Shape

UNSEEN = 1  # no model that ships was trained on shapes of this seed
# Real things that no model is of.
STRANGERS = ("airplane", "motorcycle", "duck", "hammer")
HEAD = [
    "| model | shapes of | shapes | warned of | residual % | layout | oddest | strangeness, least and most |",
    "|---|---|---:|---:|---:|---:|---:|---:|",
]


def strangers(arguments: argparse.Namespace) -> None:
    """Reconstructed from plain surfaces, as `pw.fit` does."""
    settings = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    lines = [
        "# PartSDF: which shapes are told to be strangers",
        "",
        f"New shapes of the made families, and real ones, in {arguments.iterations} iterations of "
        f"{arguments.points:,} points. Residual: mean error of the distance near the surface, as a share of "
        "the clamp. Layout: the Mahalanobis distance of the poses of all parts, as a multiple of what is "
        "usual among training shapes. Oddest: the part whose latent is farthest from the mean, as a "
        "multiple of the farthest training shape's. All three are means over the shapes. Strangeness is the "
        "product, the latter two where they are above 1, the oddest up to 2. There is a warning where it is "
        f"above {STRANGE}, or the residual above {100 * POOR:.0f} %. Cars are vehicles, too. Limits were "
        "chosen on other shapes, but for the real chairs and vehicles, of which there are no more.",
        "",
        command_line(),
        "",
        *HEAD,
    ]
    toys = {name: arguments.shapes_from / "toys" / f"{name}.ply" for name in STRANGERS}
    for name in arguments.names.split(","):
        sources: dict[str, Iterable[Shape]] = {
            other: _made(other, arguments.shapes if other == name else arguments.others)
            for other in (name, *(other for other in FAMILIES if other != name))
        }
        if real := [arguments.shapes_from / path for model, path in SHAPES if model == name]:
            sources[f"real {name}"] = map(pw.load_shape, real)
        sources[f"real: {', '.join(toys)}"] = map(pw.load_shape, toys.values())
        model = load_model(name)
        for label, shapes in sources.items():
            found = [_known(model, shape, settings) for shape in shapes]
            strange = [one.strangeness for one in found]
            oddest = np.mean([max(one.latents.values()) for one in found])
            lines.append(
                f"| {name} | {label} | {len(found)} | {sum(bool(one.warnings()) for one in found)} | "
                f"{100 * np.mean([one.residual for one in found]):.1f} | "
                f"{np.mean([one.layout for one in found]):.2f} | {oddest:.2f} | "
                f"{min(strange):.3f}, {max(strange):.3f} |"
            )
            print(lines[-1], flush=True)
    write("familiarity", lines)


def _made(family: str, count: int) -> Iterable[Shape]:
    return (
        pw.load_shape(make_shape(family, FAMILIES[family], UNSEEN, number).whole, up="z")
        for number in range(count)
    )


def _known(model: Model, shape: Shape, settings: ReconstructionSettings) -> Familiarity:
    target = Target.of_shape(shape)
    found, turn = reconstruct_standing(model, target, ways_to_stand(shape.up, model.up), settings)
    return familiarity(found, target.turned(turn))
