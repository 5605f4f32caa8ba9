"""Volume, mass, centre and inertia, integrated exactly over closed meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import NoSurfaceError, ParameterError
from partwright.meshing.assemblies import mesh_assembly, mesh_part
from partwright.rows import corners, crosses, dots

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True)
class MassProperties:
    """Of a solid of density 1, in the mesh's own unit and axes.

    volume: also the mass. centre: (3,). inertia: (3, 3) tensor about the centre.
    """

    volume: float
    centre: np.ndarray
    inertia: np.ndarray

    def mass(self, density: float) -> float:
        """Raises ParameterError unless the density is a positive number."""
        return self.volume * check_density(density)

    def transformed(self, similarity: Similarity) -> MassProperties:
        """Of the solid turned, scaled and moved, its density 1 again."""
        turn, scale = rotation_matrix(similarity.rotation), similarity.scale
        inertia = turn @ self.inertia @ turn.T * scale**5
        return MassProperties(self.volume * scale**3, similarity(self.centre), inertia)

    def to_dict(self, unit: str | None = None, density: float | None = None) -> dict[str, Any]:
        """For report.json: per unit density, and the mass and its inertia where a density is given."""
        own: dict[str, Any] = {
            "unit": unit,
            "volume": self.volume,
            "centre": self.centre.tolist(),
            "inertia_per_density": self.inertia.tolist(),
        }
        if density is not None:
            inertia = (self.inertia * check_density(density)).tolist()
            own |= {"density": density, "mass": self.mass(density), "inertia": inertia}
        return own


def mass_properties(solid: Assembly | Part | trimesh.Trimesh, resolution: int = 128) -> MassProperties:
    """Of a closed mesh, a part alone, or a whole assembly, in which overlaps count once.

    resolution: of the surface that a part or an assembly is integrated over; its volume falls short by
    about 1/resolution^2 where the surface is curved.

    Raises:
        NoSurfaceError: nothing is enclosed.
    """
    if isinstance(solid, Assembly):
        solid = mesh_assembly(solid, resolution)
    elif isinstance(solid, Part):
        solid = mesh_part(solid, resolution)
    vertices = np.asarray(solid.vertices, dtype=np.float64)
    low, high = corners(vertices)
    middle = (low + high) / 2
    side = float((high - low).max())
    if not side > 0:
        raise NoSurfaceError("the mesh encloses no volume, so it has no mass")
    local = _moments((vertices - middle) / side, np.asarray(solid.faces))
    return local.transformed(Similarity(side, translation=tuple(middle.tolist())))


def _moments(vertices: np.ndarray, faces: np.ndarray) -> MassProperties:
    """Sums over the tetrahedra from the origin to each triangle (Tonon 2004)."""
    a, b, c = (vertices.take(faces[:, i], axis=0) for i in range(3))
    six = dots(a, crosses(b, c))
    volume = float(six.sum() / 6)
    if volume <= 0:
        raise NoSurfaceError(f"the mesh encloses no volume ({volume:g}), so it has no mass")
    total = a + b + c
    centre = six @ total / 24 / volume
    products = sum((six[:, None] * p).T @ p for p in (a, b, c, total)) / 120
    products = products - volume * np.outer(centre, centre)
    return MassProperties(volume, centre, np.trace(products) * np.eye(3) - products)


def check_density(density: float) -> float:
    """The density itself, if it is a positive finite number."""
    if isinstance(density, bool) or not isinstance(density, int | float) or not 0 < density < 1e12:
        raise ParameterError(f"density: expected a positive number, got {density!r}; water has 1000 kg/m3")
    return float(density)
