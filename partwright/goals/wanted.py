"""What is asked for: objectives with targets and weights, bounds, and what stays as it is."""

from __future__ import annotations

import fnmatch
import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from partwright.assembly import Assembly
from partwright.errors import ObjectiveError, SettingError
from partwright.goals.entry import GROUPS, POSITION, ROTATION
from partwright.goals.objective import Measure, Objective, Start
from partwright.goals.parameters import Parameters
from partwright.goals.table import OBJECTIVES

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_OBJECTIVE = re.compile(rf"(?P<name>.+?)(?:=(?P<target>{_NUMBER}%?))?(?::(?P<weight>{_NUMBER}))?")
_BOUND = re.compile(rf"(?P<name>.+?)\s*(?P<side><=|>=)\s*(?P<value>{_NUMBER}%?)")
_FILE = re.compile(r"(?P<file>.+\.py):(?P<function>[A-Za-z_]\w*)")
_GROUPS = {"pose": (POSITION, ROTATION), **{group: (group,) for group in GROUPS}}


@dataclass(frozen=True)
class Amount:
    """A number, or a share of what it is at the start."""

    value: float
    relative: bool = False

    @classmethod
    def of(cls, text: str) -> Amount:
        return cls(float(text[:-1]) / 100, True) if text.endswith("%") else cls(float(text))

    def beside(self, start: float) -> float:
        return self.value * start if self.relative else self.value


@dataclass(frozen=True)
class Wanted:
    """An objective: made less, or brought to a target. name: as typed, with its argument after "@"."""

    name: str
    target: Amount | None = None
    weight: float = 1.0

    @classmethod
    def of(cls, text: str) -> Wanted:
        """Of NAME[@ARGUMENT][=TARGET][:WEIGHT]; the weight may be negative, to make more of it."""
        found = _OBJECTIVE.fullmatch(text)
        assert found is not None  # the name takes whatever is left
        target, weight = found["target"], float(found["weight"] or 1.0)
        if weight == 0 or not np.isfinite(weight):
            raise SettingError(f"objective {text!r:.80}: its weight is {weight:g}; expected another number")
        return cls(found["name"], Amount.of(target) if target else None, weight)


@dataclass(frozen=True)
class Bound:
    """An objective, or a number of parts (PART.PARAMETER, patterns allowed), that is not to pass a value."""

    name: str
    upper: bool
    value: Amount

    @classmethod
    def of(cls, text: str) -> Bound:
        """Of NAME<=VALUE or NAME>=VALUE; VALUE% is a share of that at the start."""
        found = _BOUND.fullmatch(text)
        if found is None:
            raise SettingError(
                f"bound: expected NAME<=VALUE or NAME>=VALUE, as in 'volume>=90%' or 'leg_*.tz<=5', "
                f"got {text!r:.80}"
            )
        return cls(found["name"], found["side"] == "<=", Amount.of(found["value"]))

    @property
    def of_parameter(self) -> bool:
        return "." in self.name and _FILE.fullmatch(self.name) is None and "@" not in self.name


def by_tier(name: str, assembly: Assembly) -> str:
    """The objective that `drag` stands for: drag@FILE is what a network says, drag@AXIS Newtonian flow along
    an axis, and drag alone the latter along the longest horizontal side. Other names are what they are."""
    plain, _, argument = name.partition("@")
    if plain != "drag":
        return name
    if Path(argument).suffix:
        return f"surrogate_drag@{argument}"
    if not argument:
        sides = np.ptp(assembly.bounds(), axis=0)
        sides["xyz".index(assembly.up or "z")] = 0.0
        argument = "xyz"[int(sides.argmax())]
    return f"newtonian_drag@{argument}"


def asks_for_labels(name: str) -> bool:
    """Whether an objective of that name does; a user's function may."""
    return _FILE.fullmatch(name) is not None or OBJECTIVES[name.partition("@")[0]].labelled


def measure_of(name: str, start: Start) -> tuple[Measure, int]:
    """The measure of a name of the table (NAME[@ARGUMENT]) or of a user's file (FILE.py:FUNCTION), and the
    power of length in which it is measured.

    Raises:
        SettingError: no such objective, file or function.
        ObjectiveError: the file fails when it is read.
    """
    own = _FILE.fullmatch(name)
    if own is not None:
        return _function(Path(own["file"]), own["function"]), 0
    plain, _, argument = name.partition("@")
    objective: Objective = OBJECTIVES[plain]
    return objective.prepare(argument, start), objective.power


def _function(path: Path, name: str) -> Measure:
    if not path.is_file():
        raise SettingError(f"objective {path}:{name}: there is no file {path}")
    spec = importlib.util.spec_from_file_location("partwright_objective", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ObjectiveError(
            f"objective {path}: it cannot be read: {type(error).__name__}: {error}"
        ) from error
    found = getattr(module, name, None)
    if not callable(found):
        raise SettingError(f"objective {path}:{name}: the file has no function {name!r}")
    result: Measure = found
    return result


def frozen_entries(parameters: Parameters, patterns: tuple[str, ...]) -> np.ndarray:
    """(D,) bool of what stays: PART or PART:GROUP, both as patterns.

    A group is pose, position, rotation, form, blend, latent, or the name of a parameter.

    Raises:
        SettingError: a pattern fits no part or no parameter, or nothing is left to change.
    """
    frozen = np.zeros(len(parameters), bool)
    for pattern in patterns:
        part, _, group = pattern.partition(":")
        found = matching(parameters.assembly, part)
        hit = False
        for i in found:
            for k, entry in enumerate(parameters.entries[i], parameters.slices[i].start):
                groups = _GROUPS.get(group, ())
                if not group or entry.group in groups or fnmatch.fnmatchcase(entry.name, group):
                    frozen[k] = hit = True
        if not hit:
            raise SettingError(
                f"freeze {pattern!r:.80}: expected after ':' one of {', '.join(_GROUPS)}, or a parameter: "
                f"{', '.join(e.name for e in parameters.entries[found[0]][:20])}"
            )
    if frozen.all():
        raise SettingError("everything is frozen: leave at least one part, or a group of its numbers, free")
    return frozen


def matching(assembly: Assembly, pattern: str) -> list[int]:
    """Which leaves a pattern names.

    Raises:
        SettingError: none.
    """
    names = [part.name for part in assembly.parts]
    found = [i for i, name in enumerate(names) if fnmatch.fnmatchcase(name, pattern)]
    if not found:
        shown = ", ".join(names[:20]) + (" ..." if len(names) > 20 else "")
        raise SettingError(f"no part is named {pattern!r:.80}; the names are: {shown}")
    return found


def bounded(parameters: Parameters, bounds: list[Bound], lower: np.ndarray, upper: np.ndarray) -> None:
    """Narrow the limits (D,) of parameters, in place, by the bounds on them.

    Raises:
        SettingError: a bound fits no parameter, or the start is beyond it.
    """
    for bound in bounds:
        pattern, _, name = bound.name.rpartition(".")
        hit = False
        for i in matching(parameters.assembly, pattern):
            for k, entry in enumerate(parameters.entries[i], parameters.slices[i].start):
                if not fnmatch.fnmatchcase(entry.name, name):
                    continue
                hit, limit = True, bound.value.beside(entry.value)
                if (entry.value > limit) if bound.upper else (entry.value < limit):
                    raise SettingError(
                        f"bound {bound.name!r:.60}: {parameters.name(k)} is {entry.value:g} at the start, "
                        f"beyond {limit:g}; expected a bound that the start keeps"
                    )
                if bound.upper:
                    upper[k] = min(upper[k], limit)
                else:
                    lower[k] = max(lower[k], limit)
        if not hit:
            known = ", ".join(
                e.name for e in parameters.entries[matching(parameters.assembly, pattern)[0]][:20]
            )
            raise SettingError(f"bound {bound.name!r:.60}: no such parameter; expected one of {known}")
