"""`pw.optimise`: an assembly improved for goals, and its files."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import trimesh

from partwright.assembly import Assembly
from partwright.atomic_io import replacing_files
from partwright.errors import SimulationError
from partwright.goals.curves import curves
from partwright.goals.flow import Air, Skin, simulate
from partwright.goals.flow.programs import drop_log, keep_log
from partwright.goals.flow.wheels import surface_speeds
from partwright.goals.pictures import before_and_after, trajectory
from partwright.goals.problem import Options, Point, Problem
from partwright.goals.report import report
from partwright.goals.search import Ending, Found, Step, search
from partwright.goals.steady import moved
from partwright.goals.wanted import Bound, Wanted, by_tier
from partwright.methods import Cancellation, interruptible
from partwright.shapes import METRES

FILES = ("assembly.json", "surface.ply", "report.json", "before_after.png", "trajectory.gif", "curves.png")


@dataclass(frozen=True)
class Optimised:
    """What came out: the best assembly, its surface, how it ended, and all that was tried."""

    problem: Problem
    found: Found
    seconds: float
    simulated: dict[str, Any] = field(default_factory=dict)
    """What a flow simulation of the start and the result says, where one was asked for."""
    skins: tuple[Skin, ...] = ()
    """And the pressure on both."""

    def with_simulation(self, air: str | Air, log: Path | None = None) -> Optimised:
        """The same, with the drag of both ends by OpenFOAM: "x", "-y,ground,cells=64,turning=wheel_*", or an
        `Air`. log: a file for what a program that fails has to say; without it that is lost.

        Raises:
            MissingDependencyError: OpenFOAM is not installed.
            SettingError: no part is called as those that are to turn.
            SimulationError: a simulation failed, diverged, or ran out of time or disk.
        """
        air = Air.of(air, self.start.up) if isinstance(air, str) else air
        ends = {"before": self.found.points[0], "after": self._best}
        found: dict[str, Any] = {"program": "OpenFOAM, simpleFoam, Spalart-Allmaras", "air": air.to_dict()}
        skins = []
        drop_log(log)
        with tempfile.TemporaryDirectory(prefix="partwright-") as folder:
            for name, point in ends.items():
                speeds = None
                if air.turning:
                    speeds = surface_speeds(point.assembly, point.surface, air, self.metres)
                try:
                    one = simulate(point.surface, Path(folder, name), air, self.metres, speeds)
                except SimulationError as error:
                    raise keep_log(error, log) from error
                found[name] = one.to_dict()
                skins.append(one.skin)
        return replace(self, simulated=found, skins=tuple(skins))

    @property
    def start(self) -> Assembly:
        return self.problem.parameters.assembly

    @property
    def metres(self) -> float:
        """Length of the assembly's unit; 1 where that is unknown."""
        return METRES.get(self.start.unit or "m", 1.0)

    @property
    def assembly(self) -> Assembly:
        return self._best.assembly

    @property
    def surface(self) -> trimesh.Trimesh:
        return self._best.surface

    @property
    def ending(self) -> Ending:
        return self.found.ending

    @property
    def numbers(self) -> dict[str, tuple[float, float]]:
        """Of each objective and bound: before and after."""
        first = self.found.points[0].numbers
        return {name: (first[name], self._best.numbers[name]) for name in first}

    @property
    def kept(self) -> bool:
        """Whether all bounds and contacts are."""
        return bool((self._best.broken <= KEPT_WITHIN).all())

    @property
    def held(self) -> dict[str, float]:
        """How far the surface of each learned part that is frozen beside others that are not has moved at
        most, as a share of the longest side."""
        return moved(self.problem.held, self.assembly, self.problem.length)

    @property
    def _best(self) -> Point:
        return self.found.points[-1]

    def to_dict(self) -> dict[str, Any]:
        simulated = {"simulated": self.simulated} if self.simulated else {}
        return report(self.problem, self.found, self.seconds, self.kept) | simulated

    def save(self, folder: str | Path) -> None:
        """Write assembly, surface, report and pictures into a folder, all or none.

        Raises:
            OutputError: they cannot be written.
        """
        import json

        with replacing_files(folder) as staging:
            self.assembly.save(staging / FILES[0])
            self.surface.export(staging / FILES[1])
            (staging / FILES[2]).write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")
            before_and_after(
                self.found.points, self.problem.wanted[0].name, staging / FILES[3], self.skins, self.metres
            )
            trajectory(self.found.points, staging / FILES[4])
            curves(self.problem, self.found.steps, staging / FILES[5])


KEPT_WITHIN = 2e-3  # of a bound: what a step of the search may leave of it


def optimise(
    assembly: Assembly,
    objective: str | Wanted | Sequence[str | Wanted],
    *,
    bounds: Sequence[str | Bound] = (),
    freeze: Sequence[str] = (),
    options: Options | None = None,
    progress: Callable[[Step], None] | None = None,
    cancel: Cancellation | None = None,
) -> Optimised:
    """The assembly with its free parts changed so that the weighted sum of the objectives is less.

    objective: NAME[@ARGUMENT][=TARGET][:WEIGHT], one or several. bounds: NAME<=VALUE or
    PART.PARAMETER>=VALUE. freeze: PART or PART:GROUP, as patterns;
    frozen parts keep their bits. progress: told of each step.

    Raises:
        SettingError: a name that does not exist, everything frozen, bounds that the start does not keep.
        ObjectiveError: an objective without a finite number and derivative at the start.
    """
    given = [objective] if isinstance(objective, str | Wanted) else list(objective)
    wanted = [Wanted.of(one) if isinstance(one, str) else one for one in given]
    limits = [Bound.of(one) if isinstance(one, str) else one for one in bounds]
    wanted = [replace(one, name=by_tier(one.name, assembly)) for one in wanted]
    limits = [replace(one, name=by_tier(one.name, assembly)) for one in limits]
    cancel = cancel or Cancellation()
    begun = time.perf_counter()
    problem = Problem(assembly, wanted, limits, freeze, options or Options())
    with interruptible(cancel):
        found = search(problem, progress, cancel)
    return Optimised(problem, found, time.perf_counter() - begun)
