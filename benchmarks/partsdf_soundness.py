"""How many shapes are told to be broken: trained ones, new ones as they come, and those made anew."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from partsdf_generation import POINTS, points_on
from partsdf_scores import command_line, write

import partwright as pw
from partwright.datasets.inputs import MadeShape
from partwright.errors import NoSurfaceError
from partwright.metrics.sets import chamfer_matrix, scores_of_distances
from partwright.partsdf.generator import load_generator
from partwright.partsdf.insets import STANDS_OUT
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.resampling import TRIES, Sample, sound_samples
from partwright.partsdf.soundness import GAP, OFFSET, THIN, THROUGH, Judge, largest_offset

_FOLDS = 8
_RESOLUTION = 96
_DRAWS = 200


def sounding(arguments: argparse.Namespace) -> None:
    """Faults by kind, and what resampling costs in coverage and seconds."""
    count = arguments.count
    lines = [
        "# PartSDF: which new shapes hang together", "",
        f"{count} shapes a row. Apart: a piece of a part is more than {GAP} (of 1.8) from all others, or "
        f"more than in training shapes; odd: two parts lie by more than {OFFSET} beyond the range of the "
        f"training shapes to each other (for trained ones: of those of the other {_FOLDS - 1} eighths); "
        f"empty: a part has no surface; thin: a part's wall is less than {THIN} times the thinnest in "
        f"training shapes; through: more than {100 * THROUGH:.1f} % of a part's surface came out of "
        "another part's far side, beyond the most in a few training shapes; out: more than "
        f"{100 * STANDS_OUT:.0f} % of the surface of a part that lies in others, as a window, is farther "
        "from them than in those; covered: less of a part shows than half of the least in those. Anew: parts "
        "that came through are drawn back, what stands out or is covered is put "
        f"back, and each shape is made up to {TRIES} times. MMD-CD and COV-CD against "
        f"{count} held-out shapes, made with another seed, {POINTS} points each, meshes of {_RESOLUTION}^3. "
        f"After the coverage: its standard deviation over {_DRAWS} draws of three quarters of either set. "
        "At fault: broken, or a part is seen out of place still, of which `faults` tell. Seconds of the "
        "processor a shape, to make and to judge.", "",
        command_line(), "",
        "| family | shapes | at fault % | broken % | apart | odd | empty | thin | through | out | covered "
        "| tries | MMD-CD x1e4 | COV-CD % | s |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]  # fmt: skip
    for name in arguments.names.split(","):
        model = load_model(name)
        generator, judge = load_generator(model), Judge(model)
        held = [made_cloud(name, i) for i in range(count)]
        rows = np.unique(np.linspace(0, len(model.shapes) - 1, count).round().astype(int)).tolist()
        for label, make in (
            ("trained", lambda judge=judge, rows=rows: [trained(judge, i) for i in rows]),
            ("new", lambda generator=generator: [*sound_samples(generator, count, arguments.seed, tries=1)]),
            ("anew", lambda generator=generator: [*sound_samples(generator, count, arguments.seed)]),
        ):
            start = time.process_time()
            samples = make()
            seconds = (time.process_time() - start) / len(samples)
            lines.append(f"| {name} | {label} | {cells(samples, held)} | {seconds:.1f} |")
            print(lines[-1], flush=True)
            write("soundness", lines)


def cells(samples: Sequence[Sample], held: list[np.ndarray]) -> str:
    """Faults, tries and scores of a row."""
    clouds = [cloud for cloud in (cloud_of(one.shape) for one in samples) if cloud is not None]
    between = chamfer_matrix(clouds, held)
    scores = scores_of_distances(chamfer_matrix(clouds), between, chamfer_matrix(held))
    judged = [one.soundness for one in samples]
    broken = (
        [bool(one.faults()) for one in judged],
        [bool(one.breaks()) for one in judged],
        [one.gap > one.allowed for one in judged],
        [one.offset > OFFSET for one in judged],
        [bool(one.empty) for one in judged],
        [one.thickness < THIN for one in judged],
        [bool(one.through) for one in judged],
        [bool(one.standing_out) for one in judged],
        [bool(one.covered) for one in judged],
    )
    shares = " | ".join(f"{100 * np.mean(one):.0f}" for one in broken)
    tries = np.mean([one.tries for one in samples])
    covered = f"{100 * scores.coverage:.0f} ± {100 * chance(between):.0f}"
    return f"{shares} | {tries:.1f} | {1e4 * scores.mmd:.1f} | {covered}"


def chance(between: np.ndarray) -> float:
    """By how much the coverage of (A, B) distances moves with which shapes happen to be drawn."""
    rng = np.random.default_rng(0)

    def some(count: int) -> np.ndarray:
        return rng.choice(count, 3 * count // 4, replace=False)

    made, real = between.shape
    draws = [between[np.ix_(some(made), some(real))] for _ in range(_DRAWS)]
    return float(np.std([len(np.unique(one.argmin(axis=1))) / one.shape[1] for one in draws]))


def trained(judge: Judge, row: int) -> Sample:
    """A training shape, whose parts' places are judged by a model that knows neither it nor an eighth of the
    others."""
    model = judge.model
    kept = torch.tensor([i for i in range(len(model.shapes)) if i % _FOLDS != row % _FOLDS])
    others = replace(
        model, latents=model.latents[kept], poses=model.poses.map(lambda t: t[kept]),
        present=model.present[kept], shapes=tuple(model.shapes[i] for i in kept.tolist()),
    )  # fmt: skip
    shape = NeuralShape.trained(model, model.shapes[row])
    offset, between = largest_offset(replace(shape, model=others))
    return Sample(shape, replace(judge(shape), offset=offset, offset_between=between), 1)


def cloud_of(shape: NeuralShape) -> np.ndarray | None:
    try:
        surface = mesh_shape(shape, _RESOLUTION, parts=False).whole
    except NoSurfaceError:
        return None
    return points_on(np.asarray(surface.vertices), np.asarray(surface.faces), POINTS)


def made_cloud(family: str, number: int) -> np.ndarray:
    """Of a shape of a made family with a seed that no model that ships was trained on."""
    (piece,) = MadeShape(family, 1, number).read().whole
    return points_on(*pw.load_shape((piece.vertices, piece.faces)).unit_mesh, POINTS)
