"""All measures of one result at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.meshing import mesh_assembly
from partwright.metrics import bi_surface, chamfer, emd
from partwright.metrics import deviation as deviations
from partwright.metrics.cad import CadScores, cad_scores
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import RESOLUTION, iou
from partwright.metrics.overlap import overlap
from partwright.shapes.distance import MeshDistance
from partwright.shapes.sampling import sample_triangles

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape

_NEARLY_ALL = 0.98


@dataclass(frozen=True)
class Scores:
    """How good an assembly is. All are numbers of the unit frame, except the deviations and the worst place,
    which are in the input's own units and place."""

    iou: float
    bi_surface_iou: float
    chamfer: float
    chamfer_floor: float
    emd: float | None
    overlap: float
    parts: int
    max_deviation: float
    deviation_95: float
    worst_place: str
    worst_point: tuple[float, float, float]
    cad: CadScores | None = None

    def to_dict(self) -> dict[str, Any]:
        """For report.json."""
        own = asdict(self) | {"worst_point": list(self.worst_point)}
        del own["cad"]
        return own | ({"cad": self.cad.to_dict()} if self.cad else {})


def evaluate(
    assembly: Assembly,
    shape: Shape,
    seed: int = 0,
    emd: bool = True,
    surface: trimesh.Trimesh | None = None,
    cad_points: int | None = None,
) -> Scores:
    """Measure an assembly against the shape it stands for. docs/metrics.md defines each score.

    seed: of the sampled points. emd: also match points, which may take a second (None where left out).
    surface: `mesh_assembly(assembly)` in the input's units, if it is known already.
    cad_points: also take the measures of CAPRI-Net's tables (`cad_scores`), from this many points.

    Raises NoSurfaceError where nothing is left of the assembly.
    """
    surface = mesh_assembly(assembly) if surface is None else surface
    local = in_unit_frame(assembly, shape.frame)
    vertices = shape.frame.to_unit(surface.vertices)
    seeds = [int(s) for s in np.random.SeedSequence(seed).generate_state(5)]

    def of_result(count: int, which: int) -> np.ndarray:
        return sample_triangles(vertices, surface.faces, count, which)[0]

    def of_shape(count: int, which: int) -> np.ndarray:
        return shape.unit_surface(count, which).points

    target, again = of_shape(chamfer.COUNT, seeds[0]), of_shape(chamfer.COUNT, seeds[1])
    result = of_result(chamfer.COUNT, seeds[2])
    apart = surface_deviation(shape, local.distance, vertices, surface.faces, result, target)
    return Scores(
        iou=iou(local.distance, shape.unit_occupancy(RESOLUTION)),
        bi_surface_iou=bi_surface.bi_surface_iou(
            local.distance,
            shape.unit_distance,
            of_result(bi_surface.COUNT, seeds[3]),
            of_shape(bi_surface.COUNT, seeds[3]),
            seeds[4],
        ),
        chamfer=chamfer.chamfer(result, target),
        chamfer_floor=chamfer.chamfer(again, target),
        emd=_emd(of_result, of_shape, seeds) if emd else None,
        overlap=overlap(assembly),
        parts=len(assembly),
        max_deviation=float(shape.frame.length_from_unit(apart.maximum)),
        deviation_95=float(shape.frame.length_from_unit(apart.quantile_95)),
        worst_place=deviations.place_name(
            apart.worst_point, shape.frame.length_to_unit(np.ptp(shape.vertices, axis=0)), shape.up
        ),
        worst_point=tuple(shape.frame.from_unit(apart.worst_point).tolist()),
        cad=cad_scores(assembly, shape, cad_points, seed, surface) if cad_points else None,
    )


def _emd(of_result: Any, of_shape: Any, seeds: list[int]) -> float:
    return emd.emd(of_result(emd.COUNT, seeds[3]), of_shape(emd.COUNT, seeds[4]))


def surface_deviation(
    shape: Shape,
    distance: Callable[[np.ndarray], np.ndarray],
    vertices: np.ndarray,
    faces: np.ndarray,
    result: np.ndarray,
    target: np.ndarray,
) -> deviations.Deviation:
    """Between a shape's surface and that of a field `distance` with this mesh, all in the unit frame.

    result: (N, 3) points of the mesh; target: (M, 3) points of the shape's surface. The input's corners count
    too. Where the surfaces are furthest apart the field has the word: its mesh cuts corners off.
    """
    corners = shape.frame.to_unit(shape.vertices)
    if len(corners) > deviations.COUNT:
        corners = corners[:: -(-len(corners) // deviations.COUNT)]
    on_shape = np.concatenate([target, corners])
    to_result = MeshDistance(vertices, np.asarray(faces), np.asarray(faces), True).unsigned(on_shape)
    far = to_result >= np.quantile(to_result, _NEARLY_ALL)
    feet, on_it = deviations.projected(distance, on_shape[far])
    there = np.linalg.norm(feet - on_shape[far], axis=1)
    to_result[far] = np.where(on_it, np.minimum(there, to_result[far]), to_result[far])
    to_shape = shape.unit_distance(result)
    result, far = result.copy(), np.abs(to_shape) >= np.quantile(np.abs(to_shape), _NEARLY_ALL)
    result[far], _ = deviations.projected(distance, result[far])
    to_shape[far] = shape.unit_distance(result[far])
    return deviations.deviation(result, to_shape, on_shape, to_result)
