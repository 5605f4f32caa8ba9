"""Ten parts as a person would model them, beside the features that a fit finds, with pictures.

    python benchmarks/solids.py --shapes FOLDER --sets cad --variants solids --fits FITS
    python benchmarks/by_hand.py --shapes FOLDER --fits FITS/solids

BY_HAND was written down from pictures of the inputs and is one person's view, numbers estimated: each feature
with the dimensions that a drawing of it needs; a pattern, and a hole with its counterbore, is one. Dimensions
of a fit are counted after cleaning: levels of faces and centres along each axis, but for one that is the
origin, and radii, each that differs once.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from fit import machine
from PIL import Image, ImageOps

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.cleaning.feature_cleaning import groups
from partwright.cleaning.feature_levels import levels, lying, sizes
from partwright.render import sheet

HERE = Path(__file__).parent
PICTURE = HERE.parent / "docs" / "images" / "by_hand.png"
PANEL = 300, 270
BY_HAND: dict[str, list[tuple[str, int]]] = {
    "ttt_c_clamp_base": [
        ("bent arm, its outline extruded", 9),
        ("boss", 4),
        ("bore of the boss", 1),
        ("round end of the arm with its hole", 3),
        ("relief of the arm, twice", 3),
    ],
    "ttt_corner_tie": [
        ("base plate with slanting sides", 5),
        ("counterbored hole, twice", 6),
        ("tilted plate with a round end", 5),
        ("large hole in it", 1),
        ("upright ear with a round top", 5),
        ("hole in the ear", 2),
    ],
    "ttt_angle_bracket": [
        ("stepped boss with its bore", 6),
        ("bent arm, extruded", 6),
        ("slot in the foot", 3),
        ("round end of the arm about the boss", 2),
        ("web between arm and boss", 3),
    ],
    "ttt_bearing_jig": [
        ("round body", 2),
        ("bore with keyway", 4),
        ("upper arms with round ends", 5),
        ("lower arms with round ends", 4),
        ("web between the arms", 3),
        ("hole in the arms, twice", 2),
    ],
    "ttt_post_cap": [("cup, turned, with round edges", 8), ("hook, part of a ring", 5)],
    "bdw_pipe_elbow": [("pipe swept along two lines and an arc", 5)],
    "bdw_snap_ring": [("ring with two ears, extruded", 9), ("hole in an ear, twice", 3)],
    "bdw_weld_neck_flange": [("flange and neck with bore, turned", 12), ("bolt hole, four times", 2)],
    "bd_slide_latch": [
        ("box", 4),
        ("cavity, open at one side", 4),
        ("slot in the top", 3),
        ("ear, four times", 5),
        ("hole in an ear, four times", 1),
    ],
    "f360_rotor": [("drum with slots, extruded", 8), ("stepped shaft, turned", 6)],
}


def dimensions(assembly: pw.Assembly) -> int:
    """How many a drawing of the assembly needs."""
    lower, upper = assembly.bounds()
    same = 1e-6 * float((upper - lower).max())
    frames: list[np.ndarray] = [np.eye(3)]
    parts = [lying(part, frames, same) for part in assembly.parts]
    count = 0
    for frame in frames:
        own = [level for i, one in enumerate(parts) if one.frame is frame for level in levels(i, one, same)]
        for axis in range(3):
            along = [level for level in own if level.axis == axis]
            count += max(0, len(groups(along, lambda level: level.value, same)) - 1)
    radii = [size for i, one in enumerate(parts) for size in sizes(i, one, same)]
    return count + len(groups(radii, lambda size: size.value, same))


def main() -> int:
    options = parser().parse_args()
    lines, pictures, captions, ours, theirs = [], [], [], 0, 0
    for name, features in BY_HAND.items():
        folder = options.fits / name
        if not (folder / "assembly.json").exists():
            continue
        fitted = pw.load_assembly(folder / "assembly.json")
        (path,) = options.shapes.rglob(f"{name}.ply")
        made = pw.clean(fitted, pw.load_shape(path))
        names = ", ".join(
            f"{p.name} x {len(p.copies)}" if p.instances else p.name for p in made.assembly.parts
        )
        count = sum(number for _, number in features)
        ours, theirs = ours + len(fitted), theirs + len(features)
        lines.append(
            f"| {name} | {len(features)} ({count}) | {len(fitted)} ({dimensions(made.assembly)}) | "
            f"{made.after.iou:.3f} | {'; '.join(text for text, _ in features)} | {names} |"
        )
        print(lines[-1], flush=True)
        panels = np.array_split(np.asarray(Image.open(folder / "preview.png").convert("RGB"))[56:], 4, axis=1)
        pictures += [np.asarray(ImageOps.pad(Image.fromarray(p), PANEL, color="white")) for p in panels[:2]]
        said = len(json.loads((folder / "report.json").read_text("utf-8")).get("warnings", []))
        captions += [
            f"{name}: {len(features)} by hand",
            f"{len(fitted)} found" + (", with a warning" if said else ""),
        ]
    head = [
        "# Ten parts by hand and by a fit",
        "",
        f"`python benchmarks/by_hand.py --shapes {options.shapes.name} --fits {options.fits.name}` on "
        f"{machine()}.",
        "",
        f"Features, and in brackets the dimensions that they need: {theirs} features by hand, {ours} found, "
        f"over {len(lines)} parts. A person lists what is drawn; a fit's dimensions are levels and radii of "
        "its cleaned parts: slanting corners, which have none, do not count. IoU: of the cleaned fit.",
        "",
        "| part | by hand | found | IoU | features by hand | found |",
        "|---|---|---|---:|---|---|",
    ]
    write_bytes(options.output, ("\n".join([*head, *lines]) + "\n").encode())
    image = Image.fromarray(sheet(pictures, captions, columns=4)).quantize(256, dither=Image.Dither.NONE)
    image.save(options.picture, optimize=True)
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="where the meshes are")
    option("--fits", type=Path, required=True, metavar="FOLDER", help="fits, as FOLDER/NAME/assembly.json")
    option("-o", "--output", type=Path, default=HERE / "results" / "by_hand.md", metavar="FILE")
    option("--picture", type=Path, default=PICTURE, metavar="FILE", help="pictures of both (.png)")
    return result


if __name__ == "__main__":
    sys.exit(main())
