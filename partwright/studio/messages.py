"""What the page and the server say to each other: one schema, from which the page's types are made.

A message is a JSON object with a "type". `python -m partwright.studio.messages` prints the TypeScript.
"""

from __future__ import annotations

import json
from dataclasses import MISSING, asdict, dataclass, field, fields
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from partwright.errors import MessageError


@dataclass(frozen=True)
class Step:
    """A state of the assembly file's text, and what was done to it next."""

    label: str
    text: str


@dataclass(frozen=True)
class Image:
    """What stands in texts under its name, once for all of them: see `partwright.studio.images`."""

    name: str
    data: str


@dataclass(frozen=True)
class Size:
    """An assembly of a curve."""

    parts: int
    iou: float
    text: str


@dataclass(frozen=True)
class Tried:
    """A surface that was tried for a goal. value: the goal's number; kept: whether it was a step forward."""

    number: int
    value: float
    kept: bool


# From the page


@dataclass(frozen=True)
class Commit:
    """An edit: the assembly file's text after it. `base` is the revision that it changes."""

    base: int
    label: str
    text: str


@dataclass(frozen=True)
class Undo:
    base: int


@dataclass(frozen=True)
class Redo:
    base: int


@dataclass(frozen=True)
class Fit:
    """mode: a new assembly, or the present one with the named parts, or all but these, free to change."""

    mode: Literal["new", "only", "except"]
    names: list[str]
    method: str
    quality: Literal["draft", "normal", "high"]
    max_parts: int | None = None
    curve: bool = False
    """Also an assembly of every size, of a new one."""


@dataclass(frozen=True)
class Reshape:
    """One part split in two, several merged into one, or one more for what is missing within a box (lowest,
    then highest corner, own units)."""

    action: Literal["split", "merge", "box"]
    names: list[str]
    method: str
    quality: Literal["draft", "normal", "high"]
    box: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Bake:
    """Give the parts the input's colours, as maps of so many texels a side."""

    size: int


@dataclass(frozen=True)
class Learned:
    """Another form for a learned part: a random one of the seed, or that of a training shape."""

    action: Literal["resample", "swap"]
    name: str
    seed: int = 0
    source: str = ""


@dataclass(frozen=True)
class Improve:
    """Less of a goal, by changing all parts but the locked ones. walls, volume: what is kept of the thinnest
    walls and of the volume, in %; 0 for whatever comes."""

    goal: str
    axis: Literal["x", "y", "z", "-x", "-y", "-z"]
    locked: list[str]
    steps: int
    walls: float = 0.0
    volume: float = 0.0


@dataclass(frozen=True)
class Stop:
    """End the fit with its best so far."""


@dataclass(frozen=True)
class Save:
    """Write the assembly to its file."""


# From the server


@dataclass(frozen=True)
class State:
    """All there is, after connecting, or when something else than this page has changed it."""

    revision: int
    text: str
    """Empty where there is no assembly yet."""
    past: list[Step]
    future: list[Step]
    images: list[Image]
    """Of all these texts."""
    file: str
    """The file that Save writes."""
    saved: bool
    input: str
    """Name of the shape beside the assembly; empty where there is none."""
    coloured: bool
    """Whether the input has colours."""
    box: list[float]
    """Lowest and highest corner of the shape, own units; empty where there is none."""
    unit: str
    up: str
    methods: list[str]
    donors: list[str]
    """Training shapes that learned parts of the assembly can be taken from."""
    goals: list[str]
    """Objectives for which parts can be changed."""
    formats: list[str]
    """Suffixes of what Download can write."""
    format_names: list[str]
    """What people call them."""
    fitting: bool
    note: str = ""
    """Why it was sent, where people should know."""


@dataclass(frozen=True)
class Accepted:
    """An edit is in the journal."""

    revision: int


@dataclass(frozen=True)
class Unkept:
    """The edit that was sent cannot be written to the journal, as on a full disk: to be sent again."""

    message: str


@dataclass(frozen=True)
class Fitting:
    """text: the best assembly so far; empty where it is as before."""

    stage: str
    fraction: float
    parts: int
    iou: float
    text: str = ""


@dataclass(frozen=True)
class Fitted:
    """iou: 0 where it was not measured."""

    outcome: str
    parts: int
    iou: float


@dataclass(frozen=True)
class Curve:
    """Assemblies of falling size that the last fit went through. of: what was fitted, and by which method."""

    sizes: list[Size]
    of: str


@dataclass(frozen=True)
class Improving:
    """How a goal goes: all that was tried so far, the start first, of so many."""

    goal: str
    of: int
    tried: list[Tried]


@dataclass(frozen=True)
class Scored:
    """Of one revision against the shape; deviations in its unit."""

    revision: int
    iou: float
    chamfer: float
    max_deviation: float
    deviation_95: float
    overlap: float


@dataclass(frozen=True)
class Saved:
    file: str


@dataclass(frozen=True)
class Failed:
    """Something that was asked for could not be done; the assembly is as before."""

    message: str


FROM_PAGE: tuple[type, ...] = (Commit, Undo, Redo, Fit, Reshape, Bake, Learned, Improve, Stop, Save)
FROM_SERVER: tuple[type, ...] = (
    State, Accepted, Unkept, Fitting, Fitted, Curve, Improving, Scored, Saved, Failed
)  # fmt: skip


def name_of(kind: type) -> str:
    return kind.__name__.lower()


def written(message: Any) -> str:
    """A message as JSON."""
    return json.dumps({"type": name_of(type(message)), **asdict(message)}, allow_nan=False)


def read(text: str) -> Any:
    """A message of the page.

    Raises:
        MessageError: it is none.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MessageError("a message is not JSON") from error
    kinds = {name_of(kind): kind for kind in FROM_PAGE}
    if not isinstance(data, dict) or data.get("type") not in kinds:
        raise MessageError(f"a message's type is unknown; expected one of {', '.join(kinds)}")
    kind = kinds[data.pop("type")]
    hints = get_type_hints(kind)
    required = {entry.name for entry in fields(kind) if not _optional(entry)}
    if not required <= set(data) <= set(hints):
        raise MessageError(
            f"{name_of(kind)}: expected {', '.join(hints) or 'nothing'}, got {', '.join(data)}"
        )
    for name, value in data.items():
        if not _fits(value, hints[name]):
            raise MessageError(f"{name_of(kind)}: {name} is {value!r:.60}")
    return kind(**data)


def _optional(entry: Any) -> bool:
    return entry.default is not MISSING or entry.default_factory is not MISSING


def _fits(value: Any, hint: Any) -> bool:
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if get_origin(hint) in (UnionType, Union):
        return any(_fits(value, one) for one in get_args(hint))
    if get_origin(hint) is list:
        return isinstance(value, list) and all(_fits(one, get_args(hint)[0]) for one in value)
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, hint) and not (hint is int and isinstance(value, bool))


def typescript() -> str:
    """The types of all messages, for studio/src/server/messages.ts."""
    lines = ["/** Made by `python -m partwright.studio.messages`: change them there. */", ""]
    inner = (Step, Image, Size, Tried)
    for kind in (*inner, *FROM_PAGE, *FROM_SERVER):
        hints = get_type_hints(kind)
        own = [] if kind in inner else [f'  type: "{name_of(kind)}";']
        given = {entry.name: _optional(entry) for entry in fields(kind)}
        # What the server sends is always whole; the page may leave out what has a default.
        optional = {name for name, default in given.items() if default and kind in FROM_PAGE}
        own += [f"  {name}{'?' if name in optional else ''}: {_type(hints[name])};" for name in given]
        lines += [f"export interface {kind.__name__} {{", *own, "}", ""]
    for title, kinds in (("FromPage", FROM_PAGE), ("FromServer", FROM_SERVER)):
        lines.append(f"export type {title} = {' | '.join(kind.__name__ for kind in kinds)};")
    return "\n".join(lines) + "\n"


def _type(hint: Any) -> str:
    if get_origin(hint) is Literal:
        return " | ".join(json.dumps(value) for value in get_args(hint))
    if get_origin(hint) in (UnionType, Union):
        return " | ".join(_type(one) for one in get_args(hint))
    if get_origin(hint) is list:
        return f"{_type(get_args(hint)[0])}[]"
    known = {str: "string", int: "number", float: "number", bool: "boolean", NoneType: "null"}
    return known.get(hint) or str(hint.__name__)


if __name__ == "__main__":
    print(typescript(), end="")
