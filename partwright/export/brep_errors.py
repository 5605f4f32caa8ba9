"""What OpenCASCADE raises: in Python its errors share no root but `Exception`, though in C++ they do."""

from __future__ import annotations

from functools import cache


@cache
def opencascade_errors() -> tuple[type[Exception], ...]:
    """For an `except`: every error of the modules `Standard` and `StdFail`."""
    from OCP import Standard, StdFail

    found = (*vars(Standard).values(), *vars(StdFail).values())
    return tuple(kind for kind in found if isinstance(kind, type) and issubclass(kind, Exception))
