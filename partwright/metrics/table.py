"""All metrics by name. A new one is a new file and one line here, or an entry point of another package."""

from __future__ import annotations

from partwright.metrics.metric import Metric
from partwright.registry import Registry

METRICS: Registry[Metric] = Registry(
    "metric",
    "partwright.metrics",
    {
        "iou": "partwright.metrics.iou:IOU",
        "bi_surface_iou": "partwright.metrics.bi_surface:BI_SURFACE_IOU",
        "chamfer": "partwright.metrics.chamfer:CHAMFER",
        "emd": "partwright.metrics.emd:EMD",
        "overlap": "partwright.metrics.overlap:OVERLAP",
        "max_deviation": "partwright.metrics.deviation:MAX_DEVIATION",
        "max_protrusion": "partwright.metrics.deviation:MAX_PROTRUSION",
        "deviation_95": "partwright.metrics.deviation:DEVIATION_95",
        "primitives": "partwright.metrics.complexity:PRIMITIVES",
        "convexes": "partwright.metrics.complexity:CONVEXES",
        "distinct_primitives": "partwright.metrics.complexity:DISTINCT_PRIMITIVES",
    },
)
