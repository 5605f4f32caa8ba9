"""Neural shapes to assemblies and back."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.checks import Quaternion
from partwright.assembly.metadata import GUESSED
from partwright.assembly.similarity import NO_ROTATION, quaternion_product
from partwright.errors import SettingError
from partwright.partsdf.field import NeuralField
from partwright.partsdf.meshing import Surfaces
from partwright.partsdf.neural import NeuralShape
from partwright.shapes import UnitFrame

UNIT_FRAME = UnitFrame((0.0, 0.0, 0.0), 1.0)


def to_assembly(
    shape: NeuralShape,
    frame: UnitFrame = UNIT_FRAME,
    unit: str | None = None,
    up: str | None = None,
    source: str = "",
    turn: Quaternion = NO_ROTATION,
    guessed: Collection[str] = (),
) -> Assembly:
    """The parts that are there, as an assembly in the units and place of `frame`.

    turn: from how the model's family stands to how the assembly does, a unit quaternion (w, x, y, z).
    guessed: names of parts of which nothing was seen; their metadata say so, by `GUESSED`.
    """
    poses, model = shape.poses.numpy(), shape.model
    length = 1.0 / frame.scale
    upright = Similarity(1.0, turn)
    places = frame.from_unit(upright(poses.translation.astype(np.float64)))
    parts = []
    for i in np.flatnonzero(shape.present.numpy()).tolist():
        rotation = quaternion_product(turn, tuple(poses.rotation[i].tolist()))
        pose = Similarity(1.0, rotation, tuple(places[i].tolist()))
        origin = pose.inverse() @ Similarity(1.0, turn, frame.centre)
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
        name = model.parts[i]
        told = {GUESSED: "as is usual in the family"} if name in guessed else {}
        parts.append(Part(field, pose.translation, pose.rotation, name=name, metadata=told))
    metadata: dict[str, str | float] = {"method": "partsdf", "model": model.name}
    return Assembly(
        tuple(parts), unit=unit, up=up, metadata=metadata | ({"source": source} if source else {})
    )


def remember_meshes(assembly: Assembly, surfaces: Surfaces) -> None:
    """Of what `to_assembly` made: exports as fine as these mesh its parts no second time."""
    first = assembly.parts[0].field if assembly.parts else None
    if isinstance(first, NeuralField):
        first.remember(surfaces)


def from_assembly(assembly: Assembly) -> tuple[NeuralShape, UnitFrame, Quaternion]:
    """What `to_assembly` takes: the neural shape of an assembly of neural parts, its frame and its turn.

    Raises SettingError where the leaves are not the parts of one neural shape.
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
    origin = part.pose @ first.unit_frame
    return first.shape, UnitFrame(origin.translation, 1.0 / first.unit), origin.rotation
