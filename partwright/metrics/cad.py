"""The measures of CAPRI-Net's tables at once (section 4.2)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.meshing import mesh_assembly
from partwright.metrics.chamfer import COUNT, chamfer
from partwright.metrics.complexity import convexes, primitives
from partwright.metrics.edge_chamfer import edge_chamfer
from partwright.metrics.light_field import light_field_distance
from partwright.metrics.normal_consistency import normal_consistency
from partwright.shapes.sampling import sample_with_normals

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape


@dataclass(frozen=True)
class CadScores:
    """Numbers of the unit frame; each floor is the score of a second sample of the shape itself.

    points: samples of each surface. The two edge scores are infinite where only one surface has edges.
    """

    points: int
    chamfer: float
    chamfer_floor: float
    normal_consistency: float
    normal_consistency_floor: float
    edge_chamfer: float
    edge_chamfer_floor: float
    light_field_distance: float
    primitives: int
    convexes: int

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is infinite is null."""
        return {name: value if math.isfinite(value) else None for name, value in asdict(self).items()}


def cad_scores(
    assembly: Assembly,
    shape: Shape,
    points: int = COUNT,
    seed: int = 0,
    surface: trimesh.Trimesh | None = None,
) -> CadScores:
    """Measure an assembly against the shape it stands for; docs/metrics.md defines each score.

    points: 8,000 for CAPRI-Net's own tables, 30,000 for ours. seed: of the samples. surface:
    `mesh_assembly(assembly)` in the input's units, if it is known already.

    Raises NoSurfaceError where nothing is left of the assembly.
    """
    import trimesh

    surface = mesh_assembly(assembly) if surface is None else surface
    frame = shape.frame
    result = trimesh.Trimesh(frame.to_unit(surface.vertices), surface.faces, process=False)
    target = trimesh.Trimesh(frame.to_unit(shape.vertices), shape.faces, process=False)
    seeds = [int(s) for s in np.random.SeedSequence((seed, 2)).generate_state(3)]
    on_target, again = (_sample(target, points, s) for s in seeds[:2])
    on_result = _sample(result, points, seeds[2])
    return CadScores(
        points=points,
        chamfer=chamfer(on_result[0], on_target[0]),
        chamfer_floor=chamfer(again[0], on_target[0]),
        normal_consistency=normal_consistency(*on_result, *on_target),
        normal_consistency_floor=normal_consistency(*again, *on_target),
        edge_chamfer=edge_chamfer(*on_result, *on_target),
        edge_chamfer_floor=edge_chamfer(*again, *on_target),
        light_field_distance=light_field_distance(result, target),
        primitives=primitives(assembly),
        convexes=convexes(assembly),
    )


def _sample(mesh: trimesh.Trimesh, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) of the surface and its unit normals (N, 3) there."""
    return sample_with_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces), count, seed)
