"""Who is warned of: held-out shapes of each family, and of the others, given to each model that ships."""

from __future__ import annotations

import argparse

import numpy as np
import torch
from partsdf_scores import command_line, write

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.familiarity import STRANGE, Familiarity, familiarity
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct_unknown
from partwright.partsdf.targets import Target

HEAD = [
    "| model | shapes of | shapes | warned of | residual % | oddest part | strangeness, least and most |",
    "|---|---|---:|---:|---:|---:|---:|",
]


def strangers(arguments: argparse.Namespace) -> None:
    """Reconstructed without labels and poses, as they stand in their families."""
    names = sorted(path.name for path in arguments.families.iterdir() if (path / "family.json").is_file())
    families = {name: PreparedFamily(arguments.families / name) for name in names}
    settings = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    lines = [
        "# PartSDF: which shapes are told to be strangers",
        "",
        f"Held-out shapes in {arguments.iterations} iterations of {arguments.points:,} points. Residual: "
        "mean error of the distance near the surface, as a share of the clamp; oddest part: how far its "
        "latent is from the mean, as a multiple of the farthest training shape's; both means over the "
        f"shapes. Above a strangeness of {STRANGE} there is a warning. Cars are vehicles, too.",
        "",
        command_line(),
        "",
        *HEAD,
    ]
    for name in names:
        for other in [name, *(other for other in names if other != name)]:
            count = arguments.shapes if other == name else arguments.others
            found = _known(load_model(name), families[other], count, settings)
            strange = [one.strangeness for one in found]
            lines.append(
                f"| {name} | {other} | {len(found)} | {sum(bool(one.warnings()) for one in found)} | "
                f"{100 * np.mean([one.residual for one in found]):.1f} | "
                f"{np.mean([max(one.latents.values()) for one in found]):.2f} | "
                f"{min(strange):.3f}, {max(strange):.3f} |"
            )
            print(lines[-1], flush=True)
    write("familiarity", lines)


def _known(
    model: Model, family: PreparedFamily, count: int, settings: ReconstructionSettings
) -> list[Familiarity]:
    found = []
    for index in family.split("test")[-count:]:
        shape = family.load(index)
        target = Target(torch.tensor(shape.points), torch.tensor(shape.sdf))
        found.append(familiarity(reconstruct_unknown(model, target, settings), target))
    return found
