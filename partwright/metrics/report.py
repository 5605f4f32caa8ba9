"""All measures of one result at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from partwright.assembly.repeated_groups import parts_once
from partwright.metrics.cad import CadScores, cad_scores
from partwright.metrics.chamfer import chamfer_floor
from partwright.metrics.comparison import Comparison
from partwright.metrics.deviation import place_in
from partwright.metrics.table import METRICS
from partwright.shapes import LONGEST_SIDE

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape


@dataclass(frozen=True)
class Scores:
    """How good an assembly is. All are numbers of the unit frame, except the deviations and the worst place,
    which are in the input's own units and place; shares are of its longest side."""

    iou: float
    bi_surface_iou: float
    chamfer: float
    chamfer_floor: float
    emd: float | None
    overlap: float
    parts: int
    max_deviation: float
    max_protrusion: float
    deviation_95: float
    max_deviation_share: float
    max_protrusion_share: float
    deviation_95_share: float
    worst_place: str
    worst_point: tuple[float, float, float]
    cad: CadScores | None = None
    further: Mapping[str, float] = dataclasses.field(default_factory=dict, hash=False)

    def to_dict(self) -> dict[str, Any]:
        """For report.json."""
        own = dataclasses.asdict(self) | {"worst_point": list(self.worst_point)}
        del own["cad"], own["further"]
        return own | ({"cad": self.cad.to_dict()} if self.cad else {}) | dict(self.further)


def evaluate(
    assembly: Assembly,
    shape: Shape,
    seed: int = 0,
    emd: bool = True,
    surface: trimesh.Trimesh | None = None,
    cad_points: int | None = None,
    metrics: Sequence[str] = (),
) -> Scores:
    """Measure an assembly against the shape it stands for. docs/metrics.md defines each score.

    seed: of the sampled points. emd: also match points, which may take a second (None where left out).
    surface: `mesh_assembly(assembly)` in the input's units, if it is known already.
    cad_points: also take the measures of CAPRI-Net's tables (`cad_scores`), from this many points.
    metrics: names of further ones to take, see `metrics.METRICS`; `scores.further` has them.

    Raises NoSurfaceError where nothing is left of the assembly, SettingError where there is no such metric.
    """
    further = {name: METRICS[name] for name in metrics}
    pair = Comparison(assembly, shape, surface, seed)

    def of(name: str) -> float:
        return METRICS[name](pair)

    worst = pair.deviation.worst_point
    longest = float(shape.frame.length_from_unit(LONGEST_SIDE))
    largest, beyond, most = (of(name) for name in ("max_deviation", "max_protrusion", "deviation_95"))
    return Scores(
        iou=of("iou"),
        bi_surface_iou=of("bi_surface_iou"),
        chamfer=of("chamfer"),
        chamfer_floor=chamfer_floor(pair),
        emd=of("emd") if emd else None,
        overlap=of("overlap"),
        parts=len(parts_once(assembly)),
        max_deviation=largest,
        max_protrusion=beyond,
        deviation_95=most,
        max_deviation_share=largest / longest,
        max_protrusion_share=beyond / longest,
        deviation_95_share=most / longest,
        worst_place=place_in(shape, worst),
        worst_point=tuple(shape.frame.from_unit(worst).tolist()),
        cad=cad_scores(assembly, shape, cad_points, seed, pair.surface) if cad_points else None,
        further={name: metric(pair) for name, metric in further.items()},
    )
