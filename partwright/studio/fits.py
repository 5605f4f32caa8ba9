"""What a page asks to be fitted, as work for a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from partwright.assembly import Assembly
from partwright.assembly.file_text import to_text
from partwright.errors import NoColoursError, SettingError
from partwright.fitting import Start, fit
from partwright.fitting.options import check_able
from partwright.methods import METHODS, Ability, Cancellation, Progress, Run
from partwright.shapes import Shape
from partwright.studio import messages
from partwright.studio.refits import Refit
from partwright.superfrusta.local_fits import LocalFit
from partwright.textures import Colours, bake


@dataclass(frozen=True)
class Done:
    """What came of it; curve: assemblies of falling size, where one was asked for."""

    assembly: Assembly
    told: messages.Fitted
    curve: messages.Curve | None = None


@dataclass(frozen=True)
class Task:
    """label: what the step of the history is called."""

    label: str
    work: Callable[[Callable[[Progress | messages.Improving], None], Cancellation], Done]


def fitting(shape: Shape, message: messages.Fit, present: Callable[[], Assembly]) -> Task:
    """A fit from nothing, or a refit of some parts of the present assembly.

    Raises:
        SettingError: every part is locked.
    """
    settings: dict[str, Any] = {}
    start: Start | None = None
    label = "Fit"
    name, _, model = message.method.partition(":")
    if model:
        settings["model"] = model
    again: Refit | None = None
    if message.mode != "new":
        again = Refit.of(present(), message)
        start = again.start
        label = f"Refit {again.free[0] if len(again.free) == 1 else f'{len(again.free)} parts'}"
        settings["max_parts"] = len(start.assembly)
    elif message.max_parts is not None:
        settings["max_parts"] = message.max_parts
    if message.curve and start is None:
        settings["curve"] = True

    def work(progress: Callable[[Progress], None], cancel: Cancellation) -> Done:
        result = fit(
            shape, name, quality=message.quality, start=start, progress=progress, cancel=cancel,
            **settings,
        )  # fmt: skip
        told = messages.Fitted(result.outcome, len(result.assembly), float(result.scores.iou))
        sizes = [messages.Size(p.parts, float(p.iou), to_text(p.assembly)) for p in result.curve]
        curve = messages.Curve(sizes, f"{shape.name} by {message.method}") if sizes else None
        assembly = again.restored(result.assembly) if again else result.assembly
        return Done(assembly, told, curve)

    return Task(label, work)


def reshaping(shape: Shape, message: messages.Reshape, assembly: Assembly) -> Task:
    """One part in two, several in one, or one more within a box.

    Raises:
        SettingError: the method has no such fits.
    """
    method = METHODS[message.method]
    check_able(method, Ability.LOCK)
    settings = method.settings(message.quality)
    names = list(message.names)
    if message.action == "split" and len(names) != 1:
        raise SettingError("one part at a time can be split; select one")
    label = {"split": f"Split {names[0] if names else ''}", "merge": f"Merge {len(names)} parts"}

    def work(progress: Callable[[Progress], None], cancel: Cancellation) -> Done:
        local = LocalFit(shape, assembly, settings, Run(progress=progress, cancel=cancel))
        if message.action == "split":
            result = local.split(names[0])
        elif message.action == "merge":
            result = local.merge(names)
        else:
            result = local.fill(message.box)
        return Done(result, messages.Fitted("converged", len(result), 0.0))

    return Task(label.get(message.action, "Part in a box"), work)


def baking(colours: Colours | None, assembly: Assembly, size: int) -> Task:
    """The input's colours as maps of the parts.

    Raises:
        NoColoursError: it has none.
    """
    if colours is None:
        raise NoColoursError("the input has no colours: neither of vertices or faces nor of materials")

    def work(progress: Callable[[Progress], None], cancel: Cancellation) -> Done:
        progress(Progress("bake", 1, 1, len(assembly), 0.0, 0.1))
        result = bake(assembly, colours, size)
        return Done(result, messages.Fitted("converged", len(result), 0.0))

    return Task("Bake colours", work)
