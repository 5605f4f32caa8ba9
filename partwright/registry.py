"""Tables of names that outside packages can extend: a line here, or an entry point there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from partwright.errors import SettingError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


class Registry(Generic[T]):
    """Names of one kind of thing, each imported when it is first asked for.

    An installed package adds to the table by an entry point of the table's group, in its pyproject.toml:

        [project.entry-points."partwright.metrics"]
        roundness = "my_package.roundness:roundness"

    The project's own names come first and cannot be replaced.

    Args:
        kind: what an error calls such a thing, as in "unknown method".
        group: of the entry points.
        own: the project's own names, each with where it is: "module:attribute".
    """

    def __init__(self, kind: str, group: str, own: Mapping[str, str]) -> None:
        self.kind, self.group = kind, group
        self._own = dict(own)

    @property
    def own(self) -> tuple[str, ...]:
        """The project's own names, without a look at what is installed."""
        return tuple(self._own)

    def __getitem__(self, name: str) -> T:
        """The thing of that name.

        Raises:
            SettingError: there is none; the message lists the names, the nearest first.
        """
        place = self._own.get(name) or self._added().get(name)
        if place is None:
            import difflib

            near = difflib.get_close_matches(str(name), list(self), n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise SettingError(f"unknown {self.kind} {name!r}; expected one of {', '.join(self)}{hint}")
        found: T = _loaded(place)
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._added()

    def __iter__(self) -> Iterator[str]:
        yield from self._own
        yield from (name for name in self._added() if name not in self._own)

    def __len__(self) -> int:
        return len({*self._own, *self._added()})

    def _added(self) -> dict[str, str]:
        return {point.name: point.value for point in _installed(self.group)}


@cache
def _installed(group: str) -> tuple[EntryPoint, ...]:
    from importlib.metadata import entry_points  # slow, and seldom asked for

    return tuple(sorted(entry_points(group=group), key=lambda point: point.name))


def _loaded(place: str) -> Any:
    """What "module:attribute" names."""
    module, _, attribute = place.partition(":")
    found: Any = import_module(module)
    for name in attribute.split("."):
        found = getattr(found, name)
    return found
