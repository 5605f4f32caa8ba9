"""report.json of an optimisation."""

from __future__ import annotations

import math
from typing import Any

from partwright import __version__
from partwright.goals.problem import Problem
from partwright.goals.search import Found
from partwright.goals.steady import moved
from partwright.goals.symmetry import asymmetry


def report(problem: Problem, found: Found, seconds: float, kept: bool) -> dict[str, Any]:
    """As JSON types. Numbers are in the assembly's own units."""
    first, best, assembly = found.points[0], found.points[-1], problem.parameters.assembly
    objectives = []
    for want in problem.wanted:
        target = want.target and want.target.beside(first.numbers[want.name])
        objectives.append(
            {
                "name": want.name,
                "weight": want.weight,
                "target": target,
                "before": first.numbers[want.name],
                "after": best.numbers[want.name],
            }
        )
    bounds = [
        {
            "name": bound.name,
            "side": "<=" if bound.upper else ">=",
            "limit": bound.value.beside(first.numbers[bound.name]),
            "before": first.numbers[bound.name],
            "after": best.numbers[bound.name],
        }
        for bound in problem.bounds
    ]
    same = [a.name for a, b in zip(assembly.parts, best.assembly.parts, strict=True) if a == b]
    return {
        "version": __version__,
        "unit": assembly.unit,
        "ending": found.ending,
        "reason": found.reason,
        "objectives": objectives,
        "bounds": bounds,
        "bounds_kept": kept,
        "contacts": len(problem.touching),
        "unchanged_parts": same,
        "surfaces_held": moved(problem.held, best.assembly, problem.length),
        "asymmetry": _asymmetry(problem, found),
        "too_thin_to_change": [assembly.parts[i].name for i in problem.thin],
        "free_parameters": int(problem.free.sum()),
        "parameters": _changes(problem, found),
        "triangles": len(best.surface.faces),
        "steps": [
            {
                "step": step.number,
                "accepted": step.accepted,
                "value": _number(step.value),
                "broken": _number(step.broken),
                "radius": step.radius,
                **step.numbers,
            }
            for step in found.steps
        ],
        "seconds": {"all": seconds, "a_step": seconds / len(found.steps)},
    }


def _asymmetry(problem: Problem, found: Found) -> list[float] | None:
    """Before and after; None where both sides may change apart."""
    name = problem.options.symmetric
    ends = (found.points[0], found.points[-1])
    return [asymmetry(one.assembly, one.surface, name) for one in ends] if name else None


def _changes(problem: Problem, found: Found) -> dict[str, list[float]]:
    """Before and after of each number that changed."""
    p, change = problem.parameters, found.points[-1].change
    return {
        p.name(k): [float(p.values[k]), float(p.values[k] + change[k] * p.units[k])]
        for k in range(len(p))
        if problem.free[k] and change[k]
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
