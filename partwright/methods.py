"""The contract of a method of fitting: what it is asked, what it gives back, how it tells and is stopped.

docs/extending.md shows a whole method in one file.
"""

from __future__ import annotations

import math
import numbers
import signal
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Protocol, TypeVar

from partwright.errors import CancelledError, SettingError
from partwright.registry import Registry

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape

Outcome = Literal["converged", "budget_reached", "target_reached", "interrupted"]
Quality = Literal["draft", "normal", "high"]
DEVICES = ("auto", "cpu", "cuda")
HIGHEST_SEED = 2**63 - 1  # that torch takes


class Ability(Enum):
    """What some methods can do and others cannot. The value is the option that asks for it."""

    BUDGET = "max_parts"
    """Keep to a number of parts."""
    TARGET = "min_iou"
    """Stop at the fewest parts that reach an IoU."""
    CURVE = "curve"
    """Give an assembly of every size down to one part."""
    START = "start"
    """Refine and continue an assembly."""
    LOCK = "locked"
    """Leave named parts of the start as they are, bit for bit."""
    SYMMETRY = "symmetry"
    """Give parts of symmetric shapes as repeats."""
    SUBTRACT = "subtract"
    """Take parts away from others."""
    CLEAN = "clean"
    """Make parts whose numbers relations can bind."""
    BOUNDS = "tolerance"
    """Make parts that can be moved until distances are kept."""
    PER_NODE = "per_node"
    """Fit each node of a scene by itself."""
    CUDA = "cuda"
    """Compute on an NVIDIA accelerator."""


class SettingsOfMethod(Protocol):
    """What a method's settings are: a frozen dataclass that checks itself and knows its method."""

    __dataclass_fields__: ClassVar[dict[str, Any]]
    method: ClassVar[str]
    """The method's name in `METHODS`."""


Settings = TypeVar("Settings", bound=SettingsOfMethod)


class Cancellation:
    """Asks a run to stop, from any thread. A run that was asked ends with its best so far."""

    def __init__(self) -> None:
        self._requested = threading.Event()

    @property
    def requested(self) -> bool:
        return self._requested.is_set()

    def request(self) -> None:
        """Stop at the next step. Asking again changes nothing."""
        self._requested.set()


@contextmanager
def interruptible(cancel: Cancellation) -> Iterator[None]:
    """Ctrl-C in the block requests the cancellation; a second one interrupts at once.

    Only the main thread hears Ctrl-C: elsewhere, and where somebody else listens already, this does nothing.
    """
    listening = threading.current_thread() is threading.main_thread()
    if not listening or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def heard(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        cancel.request()

    signal.signal(signal.SIGINT, heard)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class Checkpoint:
    """Raises CancelledError at the first call after a cancellation was requested, and never again.

    A method calls it wherever it could stop, and catches the error where it holds its best so far; what it
    then does to finish may pass the same places.
    """

    def __init__(self, *cancels: Cancellation) -> None:
        self._cancels = cancels

    def __call__(self) -> None:
        if any(cancel.requested for cancel in self._cancels):
            self._cancels = ()
            raise CancelledError("cancelled before there was anything to keep")

    def another(self, also: Cancellation) -> Checkpoint:
        """One for work in another thread, which hears of the other cancellation as well."""
        return Checkpoint(*self._cancels, also)


@dataclass(frozen=True)
class Progress:
    """Where a fit is, in numbers, and the best result so far."""

    stage: str
    """What the method is at, in a word."""
    round: int
    """Of the stage, from 1."""
    rounds: int
    """At most so many."""
    parts: int
    """Now, which need not be the best."""
    iou: float
    """Of these, at the method's own samples."""
    fraction: float
    """Of the expected work, from 0 to 1."""
    best: Callable[[], Assembly] | None = field(default=None, compare=False, repr=False)
    """Makes the best assembly so far; None where there is none yet."""

    def assembly(self) -> Assembly | None:
        """The best assembly so far, in the shape's own units and place: made when asked."""
        return self.best() if self.best else None


@dataclass(frozen=True)
class Run:
    """How a method is run: nothing here says what is fitted."""

    seed: int = 0
    """The same seed gives the same assembly, at any number of threads."""
    device: str = "auto"
    """"cpu", "cuda", or "auto": the compiled kernel on the CPU, which needs no other package."""
    threads: int = 0
    """0 means one a core."""
    progress: Callable[[Progress], None] | None = None
    """Told at each step."""
    cancel: Cancellation = field(default_factory=Cancellation)
    """Asked at each step."""

    def __post_init__(self) -> None:
        check_seed("seed", self.seed)
        check_count("threads", self.threads, low=0)
        if self.device not in DEVICES:
            raise SettingError(f"device: expected one of {', '.join(DEVICES)}, got {self.device!r}")

    def told(self, step: Progress) -> None:
        """Tells the progress, if anybody wants to know."""
        if self.progress is not None:
            self.progress(step)


@dataclass(frozen=True)
class FitRequest(Generic[Settings]):
    """What a method is asked for."""

    shape: Shape
    settings: Settings
    run: Run = field(default_factory=Run)
    start: Assembly | None = None
    """An assembly to refine and continue (Ability.START)."""
    locked: tuple[str, ...] = ()
    """Names of parts of the start that stay as they are, bit for bit (Ability.LOCK)."""

    def fitted(self) -> Fitted:
        """What the settings' method makes of it."""
        return METHODS[self.settings.method].fit(self)


@dataclass(frozen=True)
class CurvePoint:
    """The assembly of one size on the way from many parts to few."""

    parts: int
    score: float
    """The method's own objective."""
    iou: float
    """At the method's own samples."""
    assembly: Assembly


@dataclass(frozen=True)
class Fitted:
    """What a method gives back: the assembly in the shape's own units and place, and how it came about."""

    assembly: Assembly
    outcome: Outcome
    seconds: dict[str, float]
    """By stage."""
    history: list[dict[str, float | str]] = field(default_factory=list)
    """A row for each step of the search."""
    curve: tuple[CurvePoint, ...] = ()
    """From many parts to few, where the settings asked for it."""
    details: dict[str, Any] = field(default_factory=dict)
    """For report.json: what only this method has to say, each entry under a name of its own."""
    warnings: tuple[str, ...] = ()
    """One line each, for people, of what may be wrong with it."""
    surface: trimesh.Trimesh | None = None
    """The assembly's surface in the shape's own units, where the method has made it anyway."""
    of_points: bool = False
    """It comes close to the points that the shape was given as, not to the surface laid through them."""


class Method(ABC, Generic[Settings]):
    """A way from a shape to an assembly. What it cannot do is data: an ability that is not in `can`.

    A new method is one file with a subclass and one line in `METHODS`, or an entry point of the group
    "partwright.methods". Instances hold nothing.
    """

    name: ClassVar[str]
    can: ClassVar[frozenset[Ability]]

    @abstractmethod
    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        """The settings of a quality, with `changes` on top; `preset` does it from a table.

        Raises:
            SettingError: the quality or a change is unknown or out of range.
        """

    @abstractmethod
    def fit(self, request: FitRequest[Settings]) -> Fitted:
        """The assembly of a shape. Once `request.run.cancel` is requested: the best so far, "interrupted".

        Raises:
            EmptyShapeError: nothing could be fitted.
            CancelledError: stopped before there was anything to keep.
            SettingError: the start or the settings do not suit the shape.
        """

    def denser(self, settings: Settings, share: float) -> Settings:
        """Settings that give more parts than the objective alone would pay for: each at this share of its
        price. Asked only of methods with Ability.BOUNDS.

        Raises:
            SettingError: the method has no price of parts.
        """
        raise SettingError(f"{self.name} has no price of parts that could be lowered")


METHODS: Registry[Method[Any]] = Registry(
    "method",
    "partwright.methods",
    {
        "superfrusta": "partwright.superfrusta.method:METHOD",
        "solids": "partwright.superfrusta.solids:METHOD",
        "capri": "partwright.capri.method:METHOD",
        "parts": "partwright.partsdf.method:METHOD",
    },
)


def preset(presets: Mapping[str, Settings], quality: str, changes: Mapping[str, Any]) -> Settings:
    """The settings of a quality, with `changes` on top.

    Raises:
        SettingError: the preset or a change is unknown or out of range.
    """
    if quality not in presets:
        raise SettingError(f"quality: expected one of {', '.join(presets)}, got {quality!r}")
    chosen: Any = presets[quality]
    return changed(chosen, changes)


def changed(settings: Settings, changes: Mapping[str, Any]) -> Settings:
    """The settings with `changes` on top.

    Raises:
        SettingError: a change is unknown or out of range.
    """
    names = {entry.name for entry in fields(settings)}
    unknown = set(changes) - names
    if unknown:
        asked, known = (", ".join(sorted(some)) for some in (unknown, names))
        raise SettingError(f"{settings.method}: unknown settings: {asked}; expected some of {known}")
    result: Settings = replace(settings, **changes)
    return result


def check_number(name: str, value: float, low: float, high: float = math.inf) -> None:
    """Raises SettingError unless the value is a finite number from `low` to `high`."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if not number or not low <= value <= high:
        upper = f" and at most {high:g}" if math.isfinite(high) else ""
        raise SettingError(f"{name}: expected a number of at least {low:g}{upper}, got {value!r}")


def check_count(name: str, value: int, low: int) -> None:
    """Raises SettingError unless the value is a whole number of at least `low`."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < low:
        raise SettingError(f"{name}: expected a whole number of at least {low}, got {value!r}")


def check_seed(name: str, value: int) -> None:
    """Raises SettingError unless the value is one that all generators of random numbers take."""
    check_count(name, value, low=0)
    if value > HIGHEST_SEED:
        raise SettingError(f"{name}: expected a whole number of at most {HIGHEST_SEED}, got {value}")


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Adds the time that the context takes to that of the stage."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
