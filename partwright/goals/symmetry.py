"""Changes that are the same on both sides of a plane, for any kind of part.

The field is compared at points of the surface and at their mirror images, by constraints: parts need not be
named as pairs, nor have parameters that mirror one another, which learned ones do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import trimesh

from partwright.assembly import Assembly
from partwright.goals.composite import Composite
from partwright.goals.objectives.axes import axis
from partwright.goals.parameters import Parameters
from partwright.goals.steady import WEIGHT, well_apart_first

_POINTS = 64  # of the surface on one side, well apart
_LIMIT = 5e-4  # of the longest side: what the sides may come to differ by there; a little more between them
_SAMPLED = 4000  # vertices of a surface that are looked at to say how symmetric it is


@dataclass(frozen=True)
class Mirror:
    """points (2, K, 3): of the surface, and their images. apart: (K,) the field's difference at the start."""

    points: np.ndarray
    apart: np.ndarray

    @classmethod
    def of(cls, assembly: Assembly, surface: trimesh.Trimesh, name: str) -> Mirror:
        """Across the plane normal to an axis (x, y, z), through the middle of the surface's box.

        Raises:
            SettingError: it is no axis.
        """
        vertices = np.asarray(surface.vertices)
        normal = np.abs(axis(name, "x", "symmetric"))
        points = well_apart_first(vertices[(vertices - surface.bounds.mean(axis=0)) @ normal > 0], _POINTS)
        pairs = np.stack([points[:_POINTS], _images(points[:_POINTS], surface, normal)])
        return cls(pairs, _apart(assembly, pairs))

    def broken_by(self, assembly: Assembly, longest: float) -> list[float]:
        """By how much more each pair has come to differ than it may: one way, then the other."""
        off = (_apart(assembly, self.points) - self.apart) / longest
        return [float(WEIGHT * (side - _LIMIT)) for way in (off, -off) for side in way]

    def gradients(self, parameters: Parameters, longest: float) -> np.ndarray:
        """(2 K, D) derivatives of `broken_by`."""
        theta = torch.tensor(parameters.values, requires_grad=True)
        here, there = (
            Composite(parameters).distance(torch.tensor(self.points.reshape(-1, 3)), theta).reshape(2, -1)
        )
        rows = [torch.autograd.grad(d, theta, retain_graph=True)[0].numpy() for d in here - there]
        return WEIGHT / longest * np.concatenate([rows, -np.array(rows)])


def asymmetry(assembly: Assembly, surface: trimesh.Trimesh, name: str) -> float:
    """How far the mirror image of the surface is from the surface, mean over its vertices, as a share of the
    longest side."""
    normal = np.abs(axis(name, "x", "symmetric"))
    vertices = np.asarray(surface.vertices)
    some = vertices[:: max(1, len(vertices) // _SAMPLED)]
    off = assembly.distance(_images(some, surface, normal)) - assembly.distance(some)
    return float(np.abs(off).mean() / np.ptp(vertices, axis=0).max())


def _images(points: np.ndarray, surface: trimesh.Trimesh, normal: np.ndarray) -> np.ndarray:
    middle = surface.bounds.mean(axis=0) @ normal
    return points - 2 * ((points @ normal) - middle)[:, None] * normal


def _apart(assembly: Assembly, pairs: np.ndarray) -> np.ndarray:
    here, there = assembly.distance(pairs.reshape(-1, 3)).reshape(2, -1)
    return np.asarray(here - there)
