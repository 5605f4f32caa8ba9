"""What the commands take as a neural shape: an assembly file, or MODEL:SHAPE for a training shape."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from partwright.assembly import Assembly, load_assembly
from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION
from partwright.errors import SettingError
from partwright.partsdf.assemblies import UNIT_FRAME, from_assembly, to_assembly
from partwright.partsdf.familiarity import familiarity
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import reconstruct_standing
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.starts import ways_to_stand
from partwright.partsdf.targets import Target
from partwright.shapes import UnitFrame, load_shape


@dataclass(frozen=True)
class Source:
    """A neural shape and what its assembly says besides: frame, unit, up axis, name and turn."""

    shape: NeuralShape
    frame: UnitFrame = UNIT_FRAME
    unit: str | None = None
    up: str | None = None
    name: str = ""
    turn: Quaternion = NO_ROTATION

    def assembly(self, shape: NeuralShape) -> Assembly:
        """An edited shape as an assembly in the same units and place."""
        return to_assembly(shape, self.frame, self.unit, self.up, self.name, self.turn)


def found_in(
    model: Model, path: str | Path, settings: ReconstructionSettings | None = None, seed: int = 0
) -> tuple[NeuralShape, tuple[str, ...]]:
    """A mesh, points or grid as a shape of the model, however it stands, in the unit frame; and what is to be
    said of that, where it is none of the family.

    Raises what `load_shape` raises.
    """
    shape = load_shape(path)
    target = Target.seen_in(shape, seed)
    found, turn = reconstruct_standing(model, target, ways_to_stand(shape.up, model.up), settings, seed)
    return found, tuple(familiarity(found, target.turned(turn)).warnings())


def open_source(text: str, model: str | None = None) -> Source:
    """A neural shape by an assembly's file, or by MODEL:SHAPE, where SHAPE is a name or number.

    model: a model's file, for assemblies whose model does not ship.

    Raises:
        SettingError: it is neither, or the model was not trained on the shape.
        ModelError, UnreadableFileError, AssemblyFileError: as the model and the assembly.
    """
    if model is not None:
        load_model(model)
    if Path(text).suffix == ".json":
        assembly = load_assembly(text)
        shape, frame, turn = from_assembly(assembly)
        name = str(assembly.metadata.get("source", Path(text).stem))
        return Source(shape, frame, assembly.unit, assembly.up, name, turn)
    source, colon, shape_name = text.rpartition(":")
    if not colon:
        made = "; `parts reconstruct MODEL FILE` makes one of a mesh" if Path(text).is_file() else ""
        raise SettingError(
            f"{text!r} is no assembly file (.json), no folder with an assembly.json, and no MODEL:SHAPE, "
            f"such as mixers:0; give one of these{made}"
        )
    trained = NeuralShape.trained(load_model(source), shape_name)
    return Source(trained, up=trained.model.up, name=shape_name)
