"""The parser of all commands: it shows the usage of the command that was meant, and guesses what was."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NoReturn

from partwright.cli.terminal import printable
from partwright.errors import shortened


class Parser(argparse.ArgumentParser):
    """Subparsers are of the same class, so each command tells its own mistakes."""

    implied: str | None = None
    """The subcommand that is meant where none is named."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        if self.implied and args and args[0] not in (*self._subcommands(), "-h", "--help"):
            args = [self.implied, *args]
        namespace, unknown = super().parse_known_args(
            None if args is None else self._with_defaults(args), namespace
        )
        if unknown:
            known = [name for action in self._actions for name in action.option_strings]
            guesses = "".join(_guess(word.partition("=")[0], known) for word in unknown if word[:1] == "-")
            self.error(f"unrecognized arguments: {' '.join(unknown)}{guesses}")
        return namespace, unknown

    def error(self, message: str) -> NoReturn:
        super().error(shortened(printable(message)))

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            choices = ", ".join(map(str, action.choices))
            raise argparse.ArgumentError(
                action, f"invalid choice: {value!r} (choose from {choices}){_guess(value, action.choices)}"
            )

    def _subcommands(self) -> Iterable[str]:
        return (n for a in self._actions if isinstance(a, argparse._SubParsersAction) for n in a.choices)

    def _with_defaults(self, words: Sequence[str]) -> list[str]:
        """The words, where an option with an optional value keeps off a word that cannot be its value.

        `--contain mug.stl` is `--contain=0 mug.stl`.
        """
        optional = {
            name: action
            for action in self._actions
            if action.nargs == argparse.OPTIONAL and action.option_strings
            for name in action.option_strings
        }
        result = list(words)
        for i, (word, following) in enumerate(pairwise(words)):
            action = optional.get(word)
            if action is not None and not following.startswith("-") and not _fits(action, following):
                result[i] = f"{word}={action.const}"
        return result


def _fits(action: argparse.Action, word: str) -> bool:
    if not callable(action.type):
        return True
    try:
        action.type(word)
    except (ValueError, TypeError, argparse.ArgumentTypeError):
        return False
    return True


def _guess(word: object, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(str(word), list(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""
