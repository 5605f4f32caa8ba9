"""Neural shapes to assemblies and back."""

from __future__ import annotations

import numpy as np
import torch

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import SettingError
from partwright.partsdf.field import NeuralField
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors
from partwright.shapes import UnitFrame

UNIT_FRAME = UnitFrame((0.0, 0.0, 0.0), 1.0)


def to_assembly(
    shape: NeuralShape,
    frame: UnitFrame = UNIT_FRAME,
    unit: str | None = None,
    up: str | None = None,
    source: str = "",
) -> Assembly:
    """The parts that are there, as an assembly in the units and place of `frame`."""
    poses, model = shape.poses.numpy(), shape.model
    length = 1.0 / frame.scale
    places = frame.from_unit(poses.translation)
    parts = []
    for i in np.flatnonzero(shape.present.numpy()).tolist():
        rotation = tuple(poses.rotation[i].tolist())
        pose = Similarity(1.0, rotation, tuple(places[i].tolist()))
        origin = pose.inverse() @ Similarity(1.0, translation=frame.centre)
        field = NeuralField(
            model.name,
            model.hash,
            model.parts[i],
            tuple(shape.latents[i].tolist()),
            tuple((poses.scale[i].astype(np.float64) * length).tolist()),
            length,
            origin.translation,
            origin.rotation,
        )
        parts.append(Part(field, pose.translation, pose.rotation, name=model.parts[i]))
    metadata: dict[str, str | float] = {"method": "partsdf", "model": model.name}
    return Assembly(
        tuple(parts), unit=unit, up=up, metadata=metadata | ({"source": source} if source else {})
    )


def from_assembly(assembly: Assembly) -> tuple[NeuralShape, UnitFrame]:
    """The neural shape of an assembly of neural parts, and the frame that it lies in.

    An assembly that was turned comes back upright: the frame only moves and scales, so the turn goes into the
    poses. Raises SettingError where the leaves are not the parts of one neural shape.
    """
    fields = [part.field for part in assembly.children if isinstance(part, Part)]
    first = fields[0] if fields else None
    if len(fields) < len(assembly.children) or not isinstance(first, NeuralField):
        raise SettingError(
            "the assembly is no shape of neural parts; give one that `parts reconstruct` wrote, or "
            "edit it by itself (docs/edit.md)"
        )
    if not all(isinstance(f, NeuralField) for f in fields) or len(first.members) != len(fields):
        raise SettingError("the assembly mixes neural parts with others; edit its neural parts by themselves")
    part = assembly.parts[0]
    own = Similarity(1.0, part.rotation, part.translation)
    origin = own @ Similarity(1.0, first.frame_rotation, first.frame_translation)
    frame = UnitFrame(origin.translation, 1.0 / first.unit)
    local = first.shape
    # From the first part's frame to the world's, in unit lengths.
    translation, rotation = [], []
    for t, q in zip(local.poses.translation.tolist(), local.poses.rotation.tolist(), strict=True):
        pose = own @ Similarity(1.0, tuple(q), tuple(first.unit * v for v in t))
        translation.append(frame.to_unit(np.array([pose.translation]))[0])
        rotation.append(pose.rotation)
    poses = PoseTensors(
        torch.tensor(np.array(translation), dtype=torch.float32),
        torch.tensor(rotation, dtype=torch.float32),
        local.poses.scale,
    )
    return NeuralShape(local.model, local.latents, poses, local.present), frame
