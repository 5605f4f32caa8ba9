"""Lengths and shares as they are typed: 0.5, 0.5mm, 1%."""

from __future__ import annotations

import argparse


def length(text: str) -> str:
    """The text, where it is a length: what it measures is known only beside a shape.

    Raises:
        argparse.ArgumentTypeError: it is none, as when the name of a file stands in its place.
    """
    from partwright.errors import SettingError
    from partwright.shapes.lengths import parse_length

    try:
        parse_length(text)
    except SettingError:
        raise argparse.ArgumentTypeError(
            f"expected a length such as 0.5, 0.5mm or 1%, got {text!r}"
        ) from None
    return text


def share(text: str) -> float:
    """0.08 of "8%" or "0.08".

    Raises:
        argparse.ArgumentTypeError: it is no number.
    """
    number, percent, rest = text.strip().partition("%")
    try:
        return float("" if rest else number) / (100 if percent else 1)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a share such as 8% or 0.08, got {text!r}") from None
