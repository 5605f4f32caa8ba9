"""A tiny family of lamps with analytic distances."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from partwright.datasets.poses import Poses, average_poses
from partwright.datasets.prepared import PreparedFamily, PreparedShape, write_family
from partwright.partsdf.config import Config, DecoderSettings, LossSettings, TrainingSettings
from partwright.partsdf.neural import NeuralShape
from partwright.shapes import UnitFrame

PARTS = ("plate", "ball", "knob")
NO_TURN = np.array([1, 0, 0, 0], np.float32)


def lamp(name: str, seed: int, knob: bool = True, count: int = 4000) -> PreparedShape:
    """A plate, a ball that stands on it, and, where there is one, a knob beside the ball."""
    rng = np.random.default_rng(seed)
    half = np.array([rng.uniform(0.7, 0.9), rng.uniform(0.4, 0.8), rng.uniform(0.12, 0.2)])
    radius, small = rng.uniform(0.3, 0.45), rng.uniform(0.15, 0.2)
    centres = np.array([[0, 0, -0.5], [0.2, 0, -0.5 + half[2] + radius], [-0.5, 0, -0.5 + half[2] + small]])
    scale = np.array([half, [radius] * 3, [small] * 3])
    solids = [
        trimesh.creation.box(2 * half),
        trimesh.creation.icosphere(3, radius),
        trimesh.creation.icosphere(2, small),
    ]
    there = [True, True, knob]
    near = np.concatenate(
        [s.sample(count // 4, seed=seed) + c for s, c, t in zip(solids, centres, there, strict=True) if t]
    )
    near = near[rng.integers(len(near), size=3 * count // 4)]
    spread = np.where(rng.random((len(near), 1)) < 0.5, 0.07, 0.02) * rng.standard_normal(near.shape)
    points = np.concatenate([near + spread, rng.uniform(-1, 1, (count - len(near), 3))]).astype(np.float32)
    each = distances(points, centres, half, radius, small)
    each[:, ~np.array(there)] = np.inf
    kept = [i for i in range(3) if there[i]]
    vertices = [solids[i].vertices + centres[i] for i in kept]
    offsets = np.cumsum([0] + [len(v) for v in vertices])
    faces = [solids[i].faces + o for i, o in zip(kept, offsets, strict=False)]
    return PreparedShape(
        name=name,
        points=points,
        sdf=each.min(axis=1).astype(np.float32),
        part=each.argmin(axis=1).astype(np.int8),
        poses=Poses(centres.astype(np.float32), np.tile(NO_TURN, (3, 1)), scale.astype(np.float32)),
        present=np.array(there, np.uint8),
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        label=np.repeat(kept, [len(f) for f in faces]).astype(np.int8),
        frame=UnitFrame((10.0, 20.0, 30.0), 0.5),
    )


def distances(points: np.ndarray, centres: np.ndarray, half: np.ndarray, *radii: float) -> np.ndarray:
    """(N, 3) of plate, ball and knob."""
    q = np.abs(points - centres[0]) - half
    plate = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    balls = [np.linalg.norm(points - c, axis=1) - r for c, r in zip(centres[1:], radii, strict=True)]
    return np.stack([plate, *balls], axis=1)


def exact_distances(shape: NeuralShape, points: np.ndarray) -> np.ndarray:
    """What a decoder without error would answer: (Q, N) of a lamp's parts, whose poses are not turned."""
    poses = shape.poses.numpy()
    half, ball, knob = poses.scale
    each = distances(points, poses.translation, half, ball[0], knob[0])
    return each.T[shape.present.numpy()]


def write_lamps(folder: Path, count: int = 26, samples: int = 4000) -> PreparedFamily:
    """Every third has no knob; the last two are for validation and test."""
    shapes = [lamp(f"lamp{i}", i, knob=i % 3 != 2, count=samples) for i in range(count)]
    present = np.array([s.present.astype(bool) for s in shapes])
    average = average_poses(present, [s.poses for s in shapes])
    for i, there in enumerate(present):
        poses = {}
        for key in ("translation", "rotation", "scale"):
            mine, mean = getattr(shapes[i].poses, key), getattr(average, key)
            poses[key] = np.where(there[:, None], mine, mean)
        shapes[i] = replace(shapes[i], poses=Poses(**poses))
    splits = ["train"] * (count - 2) + ["validation", "test"]
    return write_family(folder, "lamps", PARTS, list(zip(shapes, splits, strict=True)), average)


def small_config(family: PreparedFamily, epochs: int = 2, **training: object) -> Config:
    settings = {
        "epochs": epochs,
        "batch": 4,
        "points": 256,
        "validate": 0,
        "accelerator": "cpu",
        "threads": 1,
    }
    return Config(
        family=str(family.folder),
        name="lamps",
        decoder=DecoderSettings(latent=8, width=32, layers=5),
        losses=LossSettings(ramp=10),
        training=TrainingSettings(**settings | training),  # type: ignore[arg-type]
    )
