"""Edits of numbers that take along what depended on them.

`with_numbers(assembly, {"base_plate.height": 12, "hole*.diameter": 6})` sets numbers; what stood flush on a
face that moves goes with it, cuts that went through still do, and cuts of one face keep their depth.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from partwright.assembly.following import followed as with_followers
from partwright.assembly.motion import Motion
from partwright.assembly.numbers import TOGETHER, numbers_of, with_values
from partwright.assembly.repeated_groups import alike_leaves
from partwright.assembly.tree import Assembly, Part
from partwright.errors import ParameterError


@dataclass(frozen=True)
class Edited:
    """The assembly with its new numbers, and what was changed because of them, a sentence each."""

    assembly: Assembly
    changed: tuple[str, ...]
    followed: tuple[str, ...]


def with_numbers(assembly: Assembly, values: Mapping[str, float], alone: bool = False) -> Edited:
    """The assembly with these numbers.

    values: by "part.number", lengths in the assembly's unit and angles in degrees; the part's name may be a
    pattern ("hole*.diameter"). Copies of a part change with it. They are set in order, but those of a
    profile or path that are given for the same parts together, with the first: of a profile they are counted
    before any is set, and bends of a path may not fit one by one.
    alone: parts in the same place of groups that are copies of one another stay as they are; otherwise they
    change alike, and move alike, but for those that the pattern names, too: each of these has the number.

    Raises:
        ParameterError: no part or number has the name, or a field does not allow its number.
    """
    changed: list[str] = []
    followed: list[str] = []
    for wanted, numbers in _steps(assembly, values):
        alike = {} if alone else alike_leaves(assembly)
        done = set(wanted)  # what is named has the number itself, wherever its like is
        for part_name in wanted:
            before = assembly[part_name]
            old = _known(before, numbers)
            after = with_values(before, numbers)
            changed += [f"{part_name}.{k}: {old[k]:.6g} to {value:.6g}" for k, value in numbers.items()]
            copies = [one for one in alike.get(part_name, ()) if one[0] not in done]
            if copies:
                followed.append(
                    f"{_listed([copy for copy, _ in copies])}, copies of {part_name}, change with it"
                )
            for own_name, move in ((part_name, Motion()), *copies):
                done.add(own_name)
                assembly = _changed(assembly, own_name, (before, after), move, numbers, followed)
    return Edited(assembly, tuple(changed), tuple(followed))


def _listed(names: list[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _changed(
    assembly: Assembly,
    name: str,
    change: tuple[Part, Part],
    motion: Motion,
    numbers: Mapping[str, float],
    told: list[str],
) -> Assembly:
    """With a part changed as another one was, before and after, that a motion takes to it."""
    own, (before, after) = assembly[name], (motion.of(part) for part in change)
    shift = np.subtract(after.translation, before.translation)
    x, y, z = (np.array(own.translation) + shift).tolist() if shift.any() else own.translation
    made = dataclasses.replace(own, field=after.field, translation=(x, y, z))
    if after.instances != before.instances:
        made = dataclasses.replace(made, instances=after.instances)
    if after.rotation != before.rotation:  # of an image that begins where another ends
        made = dataclasses.replace(made, rotation=after.rotation)
    assembly = assembly.replace_part(name, made)
    return assembly if numbers.keys() <= {"x", "y", "z"} else with_followers(assembly, own, made, told)


def _steps(assembly: Assembly, values: Mapping[str, float]) -> list[tuple[list[str], dict[str, float]]]:
    """Names of parts, and the numbers that they get at once: one, or all of a profile or path."""
    steps: list[tuple[list[str], dict[str, float]]] = []
    of_profiles: dict[tuple[str, ...], dict[str, float]] = {}
    for name, value in values.items():
        wanted, number = _split(assembly, name)
        if not number.startswith(TOGETHER):
            steps.append((wanted, {number: value}))
            continue
        key = tuple(wanted)
        if key not in of_profiles:
            of_profiles[key] = {}
            steps.append((wanted, of_profiles[key]))
        of_profiles[key][number] = value
    return steps


def _known(part: Part, wanted: Mapping[str, float]) -> dict[str, float]:
    """The part's numbers, the wanted among them."""
    known = numbers_of(part)
    for number in wanted:
        if number not in known:
            raise ParameterError(
                f"{part.name!r} is a {part.field.kind} and has no number {number!r}; "
                f"it has {', '.join(known)}"
            )
    return known


def _split(assembly: Assembly, name: str) -> tuple[list[str], str]:
    """Names of the parts and the number that are meant."""
    known = [part.name for part in assembly.parts]
    for i in range(len(name)):
        if name[i] != ".":
            continue
        wanted = [one for one in known if one == name[:i] or fnmatchcase(one, name[:i])]
        if wanted:
            return wanted, name[i + 1 :]
    raise ParameterError(
        f"{name!r}: expected PART.NUMBER, and the parts are {', '.join(known[:20])}"
        + (" ..." if len(known) > 20 else "")
    )
