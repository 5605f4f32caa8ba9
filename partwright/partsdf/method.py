"""Method "parts": the parts of a trained model that make up a plain shape (PartSDF, section 3.4)."""

from __future__ import annotations

from typing import Any

from partwright.assembly import Similarity
from partwright.assembly.similarity import NO_ROTATION
from partwright.errors import SettingError
from partwright.methods import Ability, Checkpoint, FitRequest, Fitted, Method, Progress, preset, timed
from partwright.partsdf.assemblies import remember_meshes, to_assembly
from partwright.partsdf.cores import one_core_each
from partwright.partsdf.freed import judged
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.optimisation import Step
from partwright.partsdf.reconstruction import mean_error, reconstruct_from
from partwright.partsdf.settings import Settings
from partwright.partsdf.starts import Start, find_starts, ways_to_stand
from partwright.partsdf.targets import Target
from partwright.partsdf.unseen import with_unseen

_PRESETS: dict[str, dict[str, Any]] = {
    "draft": {"iterations": 100, "starts": 2},
    "normal": {},
    "high": {"iterations": 800, "points": 8_000},  # the paper's
}
_TOLD = 20  # steps between two reports of progress
_PROBED = 2_048  # samples that the IoU in a report is of


class LearnedParts(Method[Settings]):
    name = "parts"
    can = frozenset({Ability.PER_NODE})

    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        model = changes.pop("model", None)
        if not model:
            raise SettingError(
                'method parts needs a model: give model="cars", or another that ships or a file'
            )
        presets = {name: Settings(model, **values) for name, values in _PRESETS.items()}
        return preset(presets, quality, changes)

    @one_core_each()
    def fit(self, request: FitRequest[Settings]) -> Fitted:
        """The parts of the model that a plain shape is made of. It may stand otherwise than those
        that the model was trained on: turned about its up axis, and with another where that is unknown.

        Raises:
            ModelError: there is no such model.
            NoSurfaceError: what was found has no surface.
        """
        shape, settings, run = request.shape, request.settings, request.run
        seconds: dict[str, float] = {}
        model = load_model(settings.model)
        checkpoint = Checkpoint(run.cancel)
        with timed(seconds, "prepare"):
            target = Target.seen_in(shape, run.seed)
            probe = Target.of_shape(shape, _PROBED, run.seed)
            inside = probe.sdf.numpy() < 0
            turns = ways_to_stand(shape.up, model.up) if settings.turn else [NO_ROTATION]
            checkpoint()
        history: list[dict[str, float | str]] = []

        def told(step: Step) -> None:
            if step.number % _TOLD and step.number != step.of:
                return
            neural = step.shape()
            occupied = neural.distances(probe.turned(step.turn).points.numpy()) < 0
            iou = float((occupied & inside).sum() / max((occupied | inside).sum(), 1))
            parts = len(neural.names())
            history.append({"stage": "optimise", "round": step.number, "parts": parts, "loss": step.loss})
            run.told(
                Progress(
                    "optimise",
                    step.number,
                    step.of,
                    parts,
                    iou,
                    step.number / step.of,
                    lambda: to_assembly(neural, shape.frame, shape.unit, shape.up, turn=step.turn),
                )
            )

        with timed(seconds, "start"):
            starts = find_starts(model, target, turns, settings)
        first = starts[0]
        loss = mean_error(first.shape, first.target)
        told(Step(0, max(1, settings.iterations), loss, lambda: first.shape, first.turn))
        with timed(seconds, "optimise"):
            found, turn = reconstruct_from(starts, settings, run.seed, told, checkpoint)
            seen, known = judged(found, target.turned(turn), settings, run.seed, checkpoint)
            found = with_unseen(seen, target.turned(turn))
            # As the assembly has it, in which those that are not there are as in the family.
            found = NeuralShape.of(model, found.latents, found.poses, found.present)
        unseen = [name for name in found.names() if name not in seen.names()]
        with timed(seconds, "mesh"):
            meshed = mesh_shape(found, settings.resolution)  # with the parts, which files ask for
        assembly = to_assembly(found, shape.frame, shape.unit, shape.up, turn=turn, guessed=unseen)
        remember_meshes(assembly, meshed)
        surface = meshed.whole
        surface.vertices = shape.frame.from_unit(Similarity(1.0, turn)(surface.vertices))
        learned = {
            "model": {"name": model.name, "hash": model.hash},
            "starts": [_origin(s, settings) for s in starts],
            "absent": [name for name in model.parts if name not in found.names()],
            "unseen": unseen,
            "turn": list(turn),
            "residual": known.residual,
            "layout": known.layout,
            "oddness": known.latents,
            "resolution": meshed.resolution,
            "evaluations": {"meshing": meshed.evaluations, "dense grid": meshed.dense},
        }
        return Fitted(
            assembly,
            "interrupted" if run.cancel.requested else "converged",
            seconds,
            history,
            details={"learned": learned},
            surface=surface,
            of_points=target.low is not None,
            warnings=(*known.warnings(), *_guesses(unseen)),
        )


def _origin(start: Start, settings: Settings) -> str:
    return "encoder" if start.encoded else "mean" if settings.start == "mean" else "training shape"


def _guesses(unseen: list[str]) -> list[str]:
    if not unseen:
        return []
    return [f"not in the points, and added as is usual in the family: {', '.join(unseen)}"]


METHOD = LearnedParts()
