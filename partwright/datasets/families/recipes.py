"""The families that the project makes itself, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.datasets.families import cars, chairs, mixers
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

    The solids of a shape overlap where they are joined; each gives way to those before it.
    """

    parts: tuple[str, ...]
    make: Callable[[np.random.Generator], dict[str, Manifold]]


FAMILIES: dict[str, Recipe] = {
    "mixers": Recipe(mixers.PARTS, mixers.make),
    "chairs": Recipe(chairs.PARTS, chairs.make),
    "cars": Recipe(cars.PARTS, cars.make),
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
    for part, solid in recipe.make(np.random.default_rng((seed, number))).items():
        parts[part] = to_mesh(_without_slivers(solid - whole))
        whole = whole + solid
    meshes = {part: parts[part] for part in recipe.parts if part in parts}
    return FamilyShape(f"{name.removesuffix('s')}_{number:04d}", meshes, to_mesh(whole))


def _without_slivers(solid: Manifold) -> Manifold:
    """Less the bodies of next to no volume that cutting along a common face may leave."""
    from manifold3d import Manifold

    bodies = solid.decompose()
    return Manifold.compose([body for body in bodies if body.volume() > _SLIVER * solid.volume()])
