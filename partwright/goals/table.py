"""All objectives by name. A new one is a new file and one line here, or an entry point of another package."""

from __future__ import annotations

from partwright.goals.objective import Objective
from partwright.registry import Registry

OBJECTIVES: Registry[Objective] = Registry(
    "objective",
    "partwright.objectives",
    {
        "volume": "partwright.goals.objectives.mass:VOLUME",
        "mass": "partwright.goals.objectives.mass:MASS",
        "centre": "partwright.goals.objectives.mass:CENTRE",
        "inertia": "partwright.goals.objectives.mass:INERTIA",
        "frontal_area": "partwright.goals.objectives.outline:FRONTAL_AREA",
        "silhouette": "partwright.goals.objectives.outline:SILHOUETTE",
        "keep_out": "partwright.goals.objectives.keep_out:KEEP_OUT",
        "wall_thickness": "partwright.goals.objectives.wall_thickness:WALL_THICKNESS",
        "distance": "partwright.goals.objectives.target:DISTANCE",
        "surrogate_drag": "partwright.goals.objectives.surrogate:SURROGATE_DRAG",
        "newtonian_drag": "partwright.goals.objectives.newtonian:NEWTONIAN_DRAG",
    },
)
