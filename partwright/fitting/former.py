"""Keywords that `fit` had before it took small objects: they work for this version, with a warning."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

from partwright.fitting.options import Clean, Start, Tolerance

_NOW = {
    "locked": "start=pw.Start(assembly, locked=...)",
    "contain": "tolerance=pw.Tolerance(contain=...)",
    "inside": "tolerance=pw.Tolerance(inside=...)",
    "clean_tolerance": "clean=pw.Clean(...)",
    "per_node": "pw.fit_nodes(...)",
    "source": "nothing: a shape knows its file",
    "density": "result.with_density(...)",
}


def former(settings: dict[str, Any], **given: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """start, tolerance and clean with what former keywords among the settings add; and the other settings.

    Raises SettingError for a locked part without a start, and for a clean tolerance where nothing is cleaned.
    """
    found = {name: settings[name] for name in _NOW if name in settings}
    for name in found:
        warnings.warn(f"fit: {name} is now {_NOW[name]}", DeprecationWarning, stacklevel=3)
    rest = {name: value for name, value in settings.items() if name not in found}
    if "locked" in found:
        given["start"] = Start.locking(given["start"], found["locked"])
    sides = {name: found[name] for name in ("contain", "inside") if name in found}
    if sides:
        given["tolerance"] = replace(Tolerance.of(given["tolerance"]) or Tolerance(), **sides)
    if "clean_tolerance" in found:
        given["clean"] = Clean.keeping(given["clean"], found["clean_tolerance"])
    return given | {"per_node": found.get("per_node", False)}, rest
