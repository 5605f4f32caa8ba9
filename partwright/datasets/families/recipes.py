"""The families that the project makes itself, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families import cars, chairs, mixers, vehicles
from partwright.datasets.making import to_mesh
from partwright.errors import SettingError

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

_SLIVER = 1e-4  # of the part's volume


@dataclass(frozen=True)
class FamilyShape:
    """One shape: its parts by name, those that it has, and the closed surface of their union."""

    name: str
    parts: Mapping[str, trimesh.Trimesh]
    whole: trimesh.Trimesh


@dataclass(frozen=True)
class Recipe:
    """How a family is made: the names of its parts, and a shape from a stream of random numbers.

    The solids of a shape overlap where they are joined; each gives way to those before it. one_body: the
    whole goes without splinters and the voids that round edges enclose; families that models were trained on
    before that was looked after keep the few that they have, and with them every digit.
    """

    parts: tuple[str, ...]
    make: Callable[[np.random.Generator], dict[str, Manifold]]
    one_body: bool = False


FAMILIES: dict[str, Recipe] = {
    "mixers": Recipe(mixers.PARTS, mixers.make),
    "chairs": Recipe(chairs.PARTS, chairs.make),
    "cars": Recipe(cars.PARTS, cars.make),
    "vehicles": Recipe(vehicles.PARTS, vehicles.make, one_body=True),
}


def family(name: str, count: int, seed: int = 0) -> list[FamilyShape]:
    """`count` shapes of a family, in centimetres with Z up and the front at -y.

    Parts touch but do not overlap, and all surfaces are closed. Shape i is the same whatever `count` is.
    Raises SettingError for a name that is not in FAMILIES, or a count below 1.
    """
    recipe = recipe_of(name)
    if count < 1:
        raise SettingError(f"{count} shapes of {name} were asked for; expected 1 or more")
    return [make_shape(name, recipe, seed, number) for number in range(count)]


def recipe_of(name: str) -> Recipe:
    """The recipe of that name. Raises SettingError where there is none."""
    if name not in FAMILIES:
        raise SettingError(f"no family is called {name!r}; expected one of {', '.join(FAMILIES)}")
    return FAMILIES[name]


def make_shape(name: str, recipe: Recipe, seed: int, number: int) -> FamilyShape:
    """Shape `number` of the family of that seed."""
    from manifold3d import Manifold

    parts, whole = {}, Manifold()
    for part, made in recipe.make(np.random.default_rng((seed, number))).items():
        solid = _sound(made)
        parts[part] = to_mesh(_without_slivers(solid - whole))
        whole = whole + solid
    meshes = {part: parts[part] for part in recipe.parts if part in parts}
    if recipe.one_body and len(whole.decompose()) > 1:
        whole = _without_slivers(whole)
    return FamilyShape(f"{name.removesuffix('s')}_{number:04d}", meshes, to_mesh(whole))


def _sound(solid: Manifold) -> Manifold:
    """Hulls of round corners now and then keep a fin of no thickness; a union with itself lets go of it."""
    return solid if to_mesh(solid).is_watertight else solid + solid


def _without_slivers(solid: Manifold) -> Manifold:
    """Less the bodies of next to no volume that cutting along a common face may leave."""
    from manifold3d import Manifold

    bodies = solid.decompose()
    return Manifold.compose([body for body in bodies if body.volume() > _SLIVER * solid.volume()])
