"""What `partwright fit` does."""

from __future__ import annotations

import argparse
from typing import Any

from partwright.assembly import load_assembly
from partwright.cli.interrupts import stopping
from partwright.cli.progress import Display
from partwright.cli.tables import finish_fit
from partwright.errors import SettingError
from partwright.fitting import Clean, Start, Tolerance, fit, fit_nodes
from partwright.fitting.report import check_density_of
from partwright.methods import Cancellation
from partwright.shapes import Shape, load_shape

# Options that are settings of methods; those not given are left to the method.
_SETTINGS = ("max_parts", "min_iou", "curve", "symmetry", "subtract", "model")


def given_settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings among the options that were given; switches have three states."""
    values = {name: getattr(arguments, name, None) for name in _SETTINGS}
    switches = ("symmetry", "subtract")
    return {n: v for n, v in values.items() if v is not None and (v is not False or n in switches)}


def run(arguments: argparse.Namespace) -> int:
    cancel = Cancellation()
    options: dict[str, Any] = {
        "quality": arguments.quality,
        "seed": arguments.seed,
        "device": arguments.device,
        "threads": arguments.threads,
        "tolerance": Tolerance(arguments.tolerance, arguments.contain, arguments.inside),
        "cancel": cancel,
        "saving": True,
        "clean": Clean.keeping(arguments.clean, arguments.clean_tolerance),
        **given_settings(arguments),
    }
    with Display() as display:
        shape = _shape(arguments, display, cancel)
        check_density_of(arguments.density, shape.unit)
        begun = load_assembly(arguments.start) if arguments.start else None
        start = Start.locking(begun, [name for name in (arguments.lock or "").split(",") if name])
        if arguments.per_node and start is not None:
            raise SettingError("--per-node fits every node anew, so it takes no --start")
        with stopping(cancel.request):
            if arguments.per_node:
                result = fit_nodes(shape, arguments.method, progress=display.show, **options)
            else:
                result = fit(shape, arguments.method, start=start, progress=display.show, **options)
        if arguments.density is not None:
            result = result.with_density(arguments.density)
        display.stage("writing")
        result.save(arguments.output)
    return finish_fit(result, arguments.output)


def _shape(arguments: argparse.Namespace, display: Display, cancel: Cancellation) -> Shape:
    """The file's, or what a generator makes of the picture."""
    if arguments.via is None:
        if arguments.via_timeout is not None:
            raise SettingError("--via-timeout is of a generator: it needs --via")
        return load_shape(arguments.shape, arguments.unit, arguments.up, arguments.thickness)
    from partwright.generators import GENERATED, TIME_LIMIT, shape_from_image

    display.stage("generating", done=0.0)
    with stopping(cancel.request):
        return shape_from_image(
            arguments.shape,
            arguments.via,
            time_limit=TIME_LIMIT if arguments.via_timeout is None else arguments.via_timeout,
            keep=arguments.output / GENERATED,
            unit=arguments.unit,
            up=arguments.up,
            thickness=arguments.thickness,
            cancel=cancel,
            progress=lambda seconds: display.wait("generating", seconds),
        )
