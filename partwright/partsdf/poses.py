"""Poses as tensors: world points to each part's frame (PartSDF, eq. 1), and what lies between two poses."""

from __future__ import annotations

from typing import NamedTuple, Self

import torch
from torch import Tensor

from partwright.datasets.poses import Poses


class PoseTensors(NamedTuple):
    """Poses of P parts, with any leading axes: translation (..., P, 3), rotation (..., P, 4) quaternions
    (w, x, y, z) of any length, local to world, scale (..., P, 3) half-lengths."""

    translation: Tensor
    rotation: Tensor
    scale: Tensor

    @classmethod
    def of(cls, poses: Poses) -> Self:
        return cls(*(torch.as_tensor(a) for a in (poses.translation, poses.rotation, poses.scale)))

    def numpy(self) -> Poses:
        """As float32 arrays, with unit quaternions."""
        unit = self.rotation / self.rotation.norm(dim=-1, keepdim=True)
        return Poses(*(t.detach().cpu().float().numpy() for t in (self.translation, unit, self.scale)))

    def map(self, change: object) -> PoseTensors:
        """`change` applied to each of the three."""
        return PoseTensors(*(change(t) for t in self))  # type: ignore[operator]


def identity(parts: int) -> PoseTensors:
    """Poses that leave points where they are: all parts share the unit frame (Table 3, without poses)."""
    rotation = torch.zeros(parts, 4)
    rotation[:, 0] = 1.0
    return PoseTensors(torch.zeros(parts, 3), rotation, torch.ones(parts, 3))


def rotation_matrices(quaternion: Tensor) -> Tensor:
    """(..., 3, 3) of quaternions (..., 4), which need not have unit length."""
    w, x, y, z = (quaternion / quaternion.norm(dim=-1, keepdim=True)).unbind(-1)
    rows = (
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    )  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def local_points(points: Tensor, poses: PoseTensors) -> Tensor:
    """R^T (x - t) / s, eq. 1: points (..., N, 3) in the frame of each part, (..., P, N, 3).

    Always in the points' own precision: coordinates in half precision would blur the shape.
    """
    with torch.autocast(points.device.type, enabled=False):
        turned = (points.unsqueeze(-3) - poses.translation.unsqueeze(-2)) @ rotation_matrices(poses.rotation)
        return turned / poses.scale.unsqueeze(-2)


def slerp(a: Tensor, b: Tensor, t: float) -> Tensor:
    """From quaternions a (..., 4) at t = 0 to b at t = 1, the short way round, at constant speed."""
    a, b = (q / q.norm(dim=-1, keepdim=True) for q in (a, b))
    cosine = (a * b).sum(-1, keepdim=True)
    b = torch.where(cosine < 0, -b, b)
    angle = torch.arccos(cosine.abs().clamp(max=1.0))
    near = angle < 1e-4
    sine = torch.where(near, torch.ones_like(angle), torch.sin(angle))
    weight_a = torch.where(near, 1 - t + 0 * angle, torch.sin((1 - t) * angle) / sine)
    weight_b = torch.where(near, t + 0 * angle, torch.sin(t * angle) / sine)
    mixed = weight_a * a + weight_b * b
    return mixed / mixed.norm(dim=-1, keepdim=True)


def between(a: PoseTensors, b: PoseTensors, t: float) -> PoseTensors:
    """Places and half-lengths on the line from a to b, rotations by slerp (appendix E)."""
    return PoseTensors(
        torch.lerp(a.translation, b.translation, t),
        slerp(a.rotation, b.rotation, t),
        torch.lerp(a.scale, b.scale, t),
    )
