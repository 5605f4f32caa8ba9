"""What `partwright optimise` does."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from partwright.assembly import load_assembly
from partwright.cli.interrupts import INTERRUPTED, raising, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, note, say, warn
from partwright.errors import ObjectiveError, SimulationError
from partwright.goals import Optimised, Options, Step, optimise
from partwright.goals.flow.air import Air
from partwright.goals.flow.programs import check_installed, drop_log
from partwright.goals.flow.surrogate import Surrogate
from partwright.goals.flow.wheels import turning_parts
from partwright.goals.objectives.surrogate import outside
from partwright.methods import Cancellation

LOG = "simulation.log"  # of a program that failed
_ENDINGS = {
    "converged": "converged",
    "budget_reached": "all steps done",
    "interrupted": "interrupted",
    "left_trained_region": "stopped at the edge of what the model was trained on",
    "failed": "stopped by an objective",
}


def run(arguments: argparse.Namespace) -> int:
    assembly = load_assembly(arguments.assembly)
    options = Options(
        steps=arguments.steps,
        resolution=arguments.resolution,
        reach=arguments.reach,
        change=arguments.change,
        anchor=arguments.anchor,
        neighbours=arguments.neighbours,
        contacts=not arguments.no_contacts,
        still=arguments.still,
        symmetric=arguments.symmetric,
    )
    if arguments.simulate is not None:
        turning_parts(assembly, Air.of(arguments.simulate, assembly.up))
        check_installed()
    cancel = Cancellation()
    with Count("optimising") as count, stopping(cancel.request):
        result = optimise(
            assembly,
            arguments.objective,
            bounds=arguments.bound,
            freeze=arguments.freeze,
            options=options,
            progress=lambda step: count.show(step.number, step.of, _shown(step)),
            cancel=cancel,
        )
    failed: SimulationError | None = None
    stopped = False
    drop_log(arguments.output / LOG)
    if arguments.simulate is not None and result.ending not in ("failed", "interrupted"):
        result.save(arguments.output)  # of minutes: kept, whatever becomes of the simulation
        note("simulating before and after")
        try:
            with raising():
                result = result.with_simulation(arguments.simulate, arguments.output / LOG)
        except SimulationError as error:
            failed = error
        except KeyboardInterrupt:
            stopped = True
    result.save(arguments.output)
    code = _finish(result, arguments)
    if failed is not None:
        raise SimulationError(f"{failed}; {arguments.output} holds what was optimised, without a simulation")
    if stopped:
        warn([f"interrupted: {arguments.output} holds what was optimised, without a simulation"])
        return INTERRUPTED
    return code


def _finish(result: Optimised, arguments: argparse.Namespace) -> int:
    wide = max(map(len, result.numbers))
    for name, (before, after) in result.numbers.items():
        change = f"  {100 * (after / before - 1):+.1f} %" if before else ""
        say(f"{name:{wide}}  {before:.5g} -> {after:.5g}{change}")
    if result.simulated:
        before, after = (result.simulated[end] for end in ("before", "after"))
        change = f"{100 * (after['drag_area'] / before['drag_area'] - 1):+.1f} %"
        swing = f"the force still swings by {before['swing']:.2g} and {after['swing']:.2g}"
        say(
            f"OpenFOAM: drag area {before['drag_area']:.4g} -> {after['drag_area']:.4g} m2, {change}; {swing}"
        )
    elif any(want.name.startswith("newtonian_drag") for want in result.problem.wanted):
        say("newtonian_drag is a pressure by angle, no flow simulation: compare with one before you build")
    warn(_doubts(result))
    same = sum(a == b for a, b in zip(result.start.parts, result.assembly.parts, strict=True))
    accepted = len(result.found.points) - 1
    tried = counted(len(result.found.steps) - 1, "step")
    unchanged = f"{same} of {counted(len(result.assembly), 'part')} unchanged"
    say(f"{_ENDINGS[result.ending]}: {tried}, {accepted} accepted, {unchanged}")
    say(f"written to {arguments.output}")
    if held := result.held:
        name = max(held, key=lambda part: held[part])
        say(f"the surface of frozen parts moved by {held[name]:.2%} of the longest side at most, {name}'s")
        if 0 < arguments.still < held[name]:
            warn([f"that is more than {arguments.still:.2%}: give more steps"])
    if result.problem.thin:
        names = ", ".join(result.start.parts[i].name for i in result.problem.thin)
        warn([f"thinner than a cell and left as they are: {names}; --resolution has smaller cells"])
    if not result.kept:
        warn(["a bound is not kept: see report.json; give more steps, more reach, or another bound"])
    if result.ending == "failed":
        raise ObjectiveError(f"{result.found.reason}; {arguments.output} holds the best so far")
    if result.ending == "interrupted":
        warn([f"interrupted: {arguments.output} holds the best assembly so far"])
        return INTERRUPTED
    return 0


def _doubts(result: Optimised) -> Iterator[str]:
    """Ends that a surrogate was not made for."""
    ends = {"the start": result.found.points[0].surface, "the result": result.surface}
    for name, _, file in (want.name.partition("@") for want in result.problem.wanted):
        if name != "surrogate_drag":
            continue
        model = Surrogate.load(file)
        for end, surface in ends.items():
            far = outside(model, surface, result.metres)
            if far > 1:
                yield (
                    f"{end} is unlike all that {file} has learned from ({far:.1f} times as far as any "
                    "of them from its nearest): do not believe its drag, --simulate it"
                )


def _shown(step: Step) -> str:
    if not step.numbers:
        return "nothing there"
    numbers = "  ".join(f"{name} {value:.4g}" for name, value in step.numbers.items())
    return numbers + ("" if step.accepted else "  (refused)")
