"""Results of a method that fits in no time."""

from __future__ import annotations

from tests.cli.conftest import method  # noqa: F401
