"""A learned part as a field of an assembly (kind "neural")."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.errors import NoSurfaceError, ParameterError, SettingError
from partwright.fields.base import LARGEST, number, scale_lengths, vector
from partwright.fields.joint import JointField, Member
from partwright.fields.operations import is_tensor
from partwright.partsdf.meshing import Surfaces, mesh_shape, resolution_for_wall
from partwright.partsdf.model import Model, find_model
from partwright.partsdf.neural import NeuralShape

if TYPE_CHECKING:
    import trimesh

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

# The box around a part is looked for in so many cells an axis, twice, within its room.
_BOX_CELLS = 12
_COARSE, _PREVIEWED = 64, 128  # cells along the whole shape of a mesh that is only looked at
# Two frames are one if these places, unit lengths, are that near to one another in both.
_MARKS, _SAME = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), 1e-3
# Times the cells along one part are those along the whole shape: an export's 32 are the 128 of a whole.
_FINER = 4


@dataclass(frozen=True)
class NeuralField(JointField):
    """A part of a model: what an assembly file holds, all lengths in own units.

    model, hash: which; opening a field raises ModelError where it is not found. part: its name there. latent:
    Z numbers. half_lengths: of the pose, along the part's own axes (eq. 1's s). unit: the length of 1 in the
    unit frame. frame_translation, frame_rotation: where the unit frame lies, seen from the part. members: the
    other parts, set by the assembly.

    Raises ParameterError where a number cannot be used.
    """

    kind: ClassVar[str] = "neural"
    model: str
    hash: str
    part: str
    latent: tuple[float, ...]
    half_lengths: Vector
    unit: float
    frame_translation: Vector = (0.0, 0.0, 0.0)
    frame_rotation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    members: tuple[Member, ...] = dataclasses.field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("model", "hash", "part"):
            if not isinstance(getattr(self, name), str):
                raise ParameterError(f"neural: {name} is {getattr(self, name)!r:.80}; expected a string")
        try:
            self.network.index(self.part)
        except SettingError as error:
            raise ParameterError(f"neural: {error}") from error
        latent = _finite(self.latent, self.network.latents.shape[2], "latent")
        rotation = Similarity(1.0, _finite(self.frame_rotation, 4, "frame_rotation")).rotation  # type: ignore[arg-type]
        values = {
            "latent": latent,
            "half_lengths": vector(self, "half_lengths", LARGEST**-1, LARGEST),
            "unit": number(self, "unit", 0.0, LARGEST, above=True),
            "frame_translation": vector(self, "frame_translation", -LARGEST, LARGEST),
            "frame_rotation": rotation,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @cached_property
    def network(self) -> Model:
        return find_model(self.model, self.hash)

    @property
    def shape_key(self) -> object:
        return self.hash

    @property
    def role(self) -> str:
        return self.part

    @property
    def lipschitz(self) -> float:
        return self.network.lipschitz

    @cached_property
    def _shared(self) -> dict[Any, Any]:
        """The members' meshes by cells along the unit frame, and in whose frame they are; "thinnest"."""
        return {}

    @property
    def _thinnest(self) -> float:
        """The wall of the thinnest member, unit frame; looked for once."""
        if "thinnest" not in self._shared:
            self._shared["thinnest"] = self.shape.thinnest
        return float(self._shared["thinnest"])

    @cached_property
    def wall(self) -> float:
        return min(self.shape.wall(self.part) * self.unit, LARGEST)

    def surface(self, resolution: int) -> trimesh.Trimesh:
        """All members are meshed in one pass when the first is asked for, since each point that is decoded
        tells of them all. The cells are those of the whole shape: four times as many along [-1, 1] as are
        asked for along one part, or more where one is thin.
        """
        return self._mesh(resolution_for_wall(self._thinnest, _FINER * resolution))

    def preview(self) -> trimesh.Trimesh:
        return self._mesh(min(resolution_for_wall(self._thinnest, _COARSE), _PREVIEWED))

    def whole(self, cell: float) -> trimesh.Trimesh | None:
        if self.network.config.decoder.aggregation != "min":  # a union is another shape than the model's
            return None
        shape = self.shape
        cells = resolution_for_wall(self._thinnest, 2 * self.unit / cell)
        mesh = mesh_shape(shape, cells, parts=False).whole
        mesh.vertices = self.unit_frame(self.unit * mesh.vertices)
        return mesh

    def _mesh(self, cells: int) -> trimesh.Trimesh:
        """cells: along the unit frame."""
        if cells not in self._shared:
            try:
                self.remember(mesh_shape(self.shape, cells))
            except NoSurfaceError:
                self._shared[cells] = self.part, {}
        maker, meshes = self._shared[cells]
        if self.part not in meshes:
            raise NoSurfaceError(
                f"the part {self.part} of {self.model} has no surface, or it is thinner than a cell"
            )
        mesh: trimesh.Trimesh = meshes[self.part].copy()
        seen = next((m for m in self.members if m.field.role == maker), None)
        if seen is not None:
            mesh.vertices = Similarity(1.0, seen.rotation, seen.translation)(mesh.vertices)
        return mesh

    def remember(self, surfaces: Surfaces) -> None:
        """The members' meshes, unit frame, for `surface`, which makes them no second time."""
        meshes = {name: mesh.copy() for name, mesh in surfaces.parts.items()}
        for mesh in meshes.values():
            mesh.vertices = self.unit_frame(self.unit * mesh.vertices)
        self._shared[surfaces.resolution] = self.part, meshes

    def among(self, members: Sequence[Member], shared: dict[Any, Any]) -> Self:
        told = dataclasses.replace(self, members=tuple(members))
        told.__dict__["_shared"] = shared
        return told

    @cached_property
    def unit_frame(self) -> Similarity:
        """Where the shape's unit frame lies, seen from this part, in own lengths.

        Every part says where; a part that was moved by itself has taken its own along, so what most agree on
        holds, and the first of those.
        """
        seen = [
            Similarity(1.0, m.rotation, m.translation)
            @ Similarity(1.0, m.field.frame_rotation, m.field.frame_translation)
            for m in self.members
            if isinstance(m.field, NeuralField)
        ]
        if not seen:
            return Similarity(1.0, self.frame_rotation, self.frame_translation)
        marks = np.stack([frame(self.unit * _MARKS) for frame in seen])
        apart = np.abs(marks[:, None] - marks).max(axis=(2, 3))
        return seen[int((apart < _SAME * self.unit).sum(axis=1).argmax())]

    @cached_property
    def shape(self) -> NeuralShape:
        """The whole shape in its unit frame."""
        model = self.network
        members = self.members or (Member(self, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
        back = self.unit_frame.inverse()
        present = torch.zeros(len(model.parts), dtype=torch.bool)
        latents, poses = model.absent_latent.clone(), model.average_pose.map(Tensor.clone)
        for member in members:
            field = member.field
            assert isinstance(field, NeuralField)
            index = model.index(field.part)
            pose = back @ Similarity(1.0, member.rotation, member.translation)
            present[index] = True
            latents[index] = torch.tensor(field.latent)
            poses.translation[index] = torch.tensor(pose.translation) / self.unit
            poses.rotation[index] = torch.tensor(pose.rotation)
            poses.scale[index] = torch.tensor(field.half_lengths) / self.unit
        return NeuralShape(model, latents, poses, present)

    def together(self, points: np.ndarray, fields: Sequence[JointField]) -> list[np.ndarray]:
        inside = self.unit_frame.inverse()(np.asarray(points, np.float64)) / self.unit
        values = self.shape.part_distances(inside.astype(np.float32))
        row = {name: i for i, name in enumerate(self.shape.names())}
        return [values[row[field.role]] * np.float32(self.unit) for field in fields]

    def __call__(self, points: Any) -> Any:
        if not is_tensor(points):
            return self.together(np.asarray(points), [self])[0]
        shape, frame = self.shape, self.unit_frame
        turn = torch.tensor(rotation_matrix(frame.rotation), dtype=torch.float32, device=points.device)
        inside = (points.float() - turn.new_tensor(frame.translation)) @ turn / self.unit
        each = shape.model.part_distances(shape.latents, shape.poses, inside)
        return (self.unit * each[self.network.index(self.part)]).to(points.dtype)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self._box[0].copy(), self._box[1].copy()

    @cached_property
    def _box(self) -> np.ndarray:
        """(2, 3) found by the cells that the surface can enter; a point where the part is nowhere."""
        upper = self.network.box(self.part) * np.array(self.half_lengths)
        box = np.array([-upper, upper])
        for _ in range(2):
            cell = (box[1] - box[0]) / _BOX_CELLS
            steps = np.stack(np.meshgrid(*[np.arange(_BOX_CELLS) + 0.5] * 3, indexing="ij"), axis=-1).reshape(
                -1, 3
            )
            centres = box[0] + steps * cell
            near = self(centres.astype(np.float32)) <= self.lipschitz * np.linalg.norm(cell) / 2
            if not near.any():
                return np.zeros((2, 3))
            box = np.array([centres[near].min(axis=0) - cell / 2, centres[near].max(axis=0) + cell / 2])
        return box

    def scaled(self, factor: float) -> Self:
        lengths = ("half_lengths", "unit", "frame_translation")
        alone: Self = scale_lengths(dataclasses.replace(self, members=()), factor, lengths)
        members = [
            Member(
                alone if m.field is self else scale_lengths(_alone(m.field), factor, lengths),
                tuple(factor * v for v in m.translation),  # type: ignore[arg-type]
                m.rotation,
            )
            for m in self.members
        ]
        return alone.among(members, {})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        if "members" in data:
            raise ParameterError("neural: unknown parameters ['members']; the assembly itself says which")
        return super().from_dict(data)

    def to_dict(self) -> dict[str, Any]:
        return {name: value for name, value in super().to_dict().items() if name != "members"}


def _alone(field: JointField) -> JointField:
    return dataclasses.replace(field, members=())  # type: ignore[type-var]


def _finite(values: Any, count: int, name: str) -> tuple[float, ...]:
    if not isinstance(values, list | tuple) or len(values) != count:
        given = len(values) if isinstance(values, list | tuple) else repr(values)[:40]
        raise ParameterError(f"neural: {name}: expected {count} numbers, got {given}")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ParameterError(f"neural: {name} holds {value!r:.40}; expected finite numbers")
    return tuple(float(value) for value in values)
