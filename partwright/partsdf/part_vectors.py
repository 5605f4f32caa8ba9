"""Latents and poses of parts as vectors that a network predicts or denoises well.

Latents are taken along the principal directions of each part's training latents, each in its own spread; a
pose is place, two columns of its rotation, and logarithms of half-lengths, each in its own spread, too. What
the training shapes do not vary is not predicted.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from partwright.partsdf.model import Model
from partwright.partsdf.poses import PoseTensors, rotation_matrices

POSE = 3 + 6 + 3
MOST = 32  # principal directions
RIDGE = 0.1  # of a number's own variance, added to it: what few training shapes leave open
_LEAST = 0.05  # spread of a pose's number, unit lengths or radians, that counts as one


@dataclass(frozen=True)
class PartVectors:
    """Of P parts: mean latents (P, Z), directions (P, K, Z) with their spreads (P, K), and mean (P, 12) and
    spread (P, 12) of the poses' numbers."""

    mean: Tensor
    directions: Tensor
    spread: Tensor
    pose_mean: Tensor
    pose_spread: Tensor

    @classmethod
    def of(cls, model: Model) -> PartVectors:
        """Of the training shapes' latents and poses, each part's where it is present."""
        parts, width = len(model.parts), model.latents.shape[2]
        count = min(MOST, width, max(2, len(model.latents)) - 1)
        directions, spread = torch.zeros(parts, count, width), torch.ones(parts, count)
        numbers = pose_numbers(model.poses)
        pose_mean, pose_spread = torch.zeros(parts, POSE), torch.ones(parts, POSE)
        for p in range(parts):
            there = model.present[:, p]
            off = model.latents[there, p] - model.mean_latent[p]
            _, sizes, along = torch.linalg.svd(off, full_matrices=False)
            kept = sizes[:count] > 1e-6 * sizes[0].clamp(min=1e-12)
            n = int(kept.sum())
            directions[p, :n] = along[:n]
            spread[p, :n] = sizes[:n] / max(1, len(off) - 1) ** 0.5
            mine = numbers[there, p]
            pose_mean[p] = mine.mean(dim=0)
            pose_spread[p] = mine.std(dim=0, correction=0).clamp(min=_LEAST)
        return cls(model.mean_latent, directions, spread, pose_mean, pose_spread)

    def to(self, device: torch.device) -> PartVectors:
        return PartVectors(*(t.to(device) for t in vars(self).values()))

    @property
    def width(self) -> int:
        """K, of a latent's vector; a pose's is `POSE`."""
        return self.spread.shape[1]

    @property
    def tells(self) -> Tensor:
        """(P, K): how much of a latent each number of its vector tells, in squares and 1 in the mean: a
        spread of a hundredth of the widest one's is no shape; 0 beyond the latents' own directions."""
        told_by = (self.spread * self.directions.norm(dim=2)).square()
        return told_by / told_by.mean(dim=1, keepdim=True).clamp(min=1e-12)

    def of_latents(self, latents: Tensor) -> Tensor:
        """(..., P, K) of latents (..., P, Z)."""
        return torch.einsum("...pz,pkz->...pk", latents - self.mean, self.directions) / self.spread

    def latents(self, vectors: Tensor) -> Tensor:
        """(..., P, Z) of vectors (..., P, K)."""
        return self.mean + torch.einsum("...pk,pkz->...pz", vectors * self.spread, self.directions)

    def nearest_trained(self, model: Model, latents: Tensor) -> Tensor:
        """(B, P, Z): those of the model's training shapes that have the part which are nearest, part by part,
        to `latents` (B, P, Z), along the directions and each in its spread."""
        apart = torch.cdist(
            self.of_latents(latents).transpose(0, 1), self.of_latents(model.latents).transpose(0, 1)
        )
        nearest = apart.masked_fill(~model.present.T[:, None], torch.inf).argmin(dim=2).T
        return model.latents[nearest, torch.arange(len(model.parts))]

    def of_poses(self, poses: PoseTensors) -> Tensor:
        """(..., P, 12) of poses (..., P, ...)."""
        return (pose_numbers(poses) - self.pose_mean) / self.pose_spread

    def poses(self, vectors: Tensor) -> PoseTensors:
        """(..., P, ...) of vectors (..., P, 12)."""
        place, turned, size = self.frames(vectors)
        return PoseTensors(place, quaternions(turned), size)

    def frames(self, vectors: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Translations (..., P, 3), rotations as matrices (..., P, 3, 3) and half-lengths (..., P, 3) of the
        poses of vectors (..., P, 12)."""
        place, turn, size = (vectors * self.pose_spread + self.pose_mean).split((3, 6, 3), dim=-1)
        first = torch.nn.functional.normalize(turn[..., :3], dim=-1)
        second = turn[..., 3:] - (first * turn[..., 3:]).sum(-1, keepdim=True) * first
        second = torch.nn.functional.normalize(second, dim=-1)
        columns = (first, second, torch.linalg.cross(first, second))
        return place, torch.stack(columns, dim=-1), size.exp()

    def split(self, found: Tensor) -> tuple[Tensor, PoseTensors, Tensor]:
        """Latents (..., P, Z), poses (..., P, ...) and logits of presence (..., P) of what a network gives,
        vectors (..., P, K + 12 + 1)."""
        latents, poses, logits = found.split((self.width, POSE, 1), dim=-1)
        return self.latents(latents), self.poses(poses), logits.squeeze(-1)


def covariance(rows: Tensor) -> Tensor:
    """(D, D) of numbers (S, D) that are each in its spread about the mean, with a ridge."""
    return rows.T @ rows / len(rows) + RIDGE * torch.eye(rows.shape[1], dtype=rows.dtype)


def pose_numbers(poses: PoseTensors) -> Tensor:
    """(..., 12): place, the first two columns of the rotation matrix, logarithms of half-lengths."""
    matrix = rotation_matrices(poses.rotation)
    return torch.cat([poses.translation, matrix[..., 0], matrix[..., 1], poses.scale.log()], dim=-1)


def quaternions(matrices: Tensor) -> Tensor:
    """Unit quaternions (..., 4), w first, of rotation matrices (..., 3, 3)."""
    m = matrices.flatten(-2).unbind(-1)
    # 4 q q^T, of which the row with the largest diagonal is the best scaled (Bar-Itzhack 2000).
    rows = (
        (1 + m[0] + m[4] + m[8], m[7] - m[5], m[2] - m[6], m[3] - m[1]),
        (m[7] - m[5], 1 + m[0] - m[4] - m[8], m[1] + m[3], m[2] + m[6]),
        (m[2] - m[6], m[1] + m[3], 1 - m[0] + m[4] - m[8], m[5] + m[7]),
        (m[3] - m[1], m[2] + m[6], m[5] + m[7], 1 - m[0] - m[4] + m[8]),
    )
    outer = torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)
    best = outer.diagonal(dim1=-2, dim2=-1).argmax(dim=-1)
    row = outer.gather(-2, best[..., None, None].expand(*best.shape, 1, 4)).squeeze(-2)
    return torch.nn.functional.normalize(row, dim=-1)
