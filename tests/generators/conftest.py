"""The method that fits in no time."""

from tests.cli.conftest import method

__all__ = ["method"]
