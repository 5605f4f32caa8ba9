"""Real shapes, found in models of made families: which come out, how near, and what is said of them."""

from __future__ import annotations

import argparse
from pathlib import Path

from partsdf_scores import command_line, write

import partwright as pw
from partwright.render import Camera, preview, sheet, write_png

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "parts" / "real.png"
# Of which model, and where in the folder of shapes.
SHAPES = (
    ("chairs", "toys/armchair.ply"),
    ("chairs", "toys/chair_kk.ply"),
    ("chairs", "toys/couch.ply"),
    ("vehicles", "toys/pickup.ply"),
    ("vehicles", "parts/truck/truck_green/_whole.ply"),
    ("vehicles", "parts/truck/truck_purple/_whole.ply"),
    ("vehicles", "parts/truck/truck_red/_whole.ply"),
    ("vehicles", "parts/truck/truck_yellow/_whole.ply"),
)
HEAD = [
    "| shape | model | IoU | bi-surface IoU | deviation % | parts | residual % | oddest | warned of | s |",
    "|---|---|---:|---:|---:|---:|---:|---:|---|---:|",
]
PANEL = (260, 190)


def reality(arguments: argparse.Namespace) -> None:
    """`pw.fit` of a plain mesh by a learned model, as it stands in its file; default settings, seed 0."""
    lines = [
        "# PartSDF: real shapes by models of made families",
        "",
        "Whole shapes without labels, by `pw.fit(shape, pw.LearnedParts(MODEL))`. Deviation: the largest, "
        "both ways, of the longest side. Residual: mean error of the distance near the surface, as a share "
        "of the clamp; oddest: the part whose latent is farthest from the mean, as a multiple of the "
        "farthest training shape's; both before numbers move freely.",
        "",
        command_line(),
        "",
        *HEAD,
    ]
    panels, captions = [], []
    for model, path in SHAPES:
        shape = pw.load_shape(arguments.shapes_from / path)
        result = pw.fit(shape, pw.LearnedParts(model))
        learned = result.report["learned"][0]
        part, odd = max(learned["oddness"].items(), key=lambda item: item[1])
        name = Path(path).parent.name if Path(path).stem == "_whole" else Path(path).stem
        strange = any("no shape of the family" in line for line in result.warnings)
        scores, off = result.scores, 100 * learned["residual"]
        lines.append(
            f"| {name} | {model} | {scores.iou:.3f} | {scores.bi_surface_iou:.3f} | "
            f"{100 * scores.max_deviation_share:.1f} | {len(result.assembly)} | {off:.1f} | "
            f"{part} {odd:.1f} | {'yes' if strange else ''} | {sum(result.report['seconds'].values()):.0f} |"
        )
        print(lines[-1], flush=True)
        whole = preview(
            shape, result.assembly, result.surface, camera=Camera(up=shape.up or "z", margin=0.1), panel=PANEL
        )
        panels.append(whole[:, : whole.shape[1] // 2])
        captions.append(f"{name}, in the model of {model}: IoU {scores.iou:.2f}")
    write("real", lines)
    write_png(PICTURE, sheet(panels, captions, columns=2))
