"""An assembly beside the shape it stands for: what a metric may look at."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.meshing import mesh_assembly
from partwright.metrics.deviation import COUNT, Deviation, surface_deviation
from partwright.metrics.frames import in_unit_frame
from partwright.shapes.sampling import running_area, sample_triangles

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape

_STREAMS = 5


class Comparison:
    """What several metrics share is made when the first one asks for it, and once.

    Args:
        assembly: the result, in the shape's units and place.
        shape: what it stands for.
        surface: `mesh_assembly(assembly)`, if it is known already.
        seed: of all samples.

    Raises:
        NoSurfaceError: nothing is left of the assembly.
    """

    def __init__(
        self, assembly: Assembly, shape: Shape, surface: trimesh.Trimesh | None = None, seed: int = 0
    ) -> None:
        self.assembly, self.shape, self.seed = assembly, shape, seed
        self.surface = mesh_assembly(assembly) if surface is None else surface
        self.vertices = shape.frame.to_unit(self.surface.vertices)
        self.streams = [int(s) for s in np.random.SeedSequence(seed).generate_state(_STREAMS)]
        self._samples: dict[tuple[str, int, int], np.ndarray] = {}

    @cached_property
    def local(self) -> Assembly:
        """The assembly in the shape's unit frame."""
        return in_unit_frame(self.assembly, self.shape.frame)

    @cached_property
    def deviation(self) -> Deviation:
        """How far the two surfaces are apart, unit frame."""
        return surface_deviation(
            self.shape,
            self.local.distance,
            self.vertices,
            self.surface.faces,
            self.on_result(COUNT, 2),
            self.on_shape(COUNT, 0),
        )

    @cached_property
    def _area(self) -> NDArray[np.float64]:
        return running_area(self.vertices, np.asarray(self.surface.faces))

    def on_result(self, count: int, stream: int) -> np.ndarray:
        """(count, 3) points of the assembly's surface, unit frame; other points for each stream, 0 to 4."""
        key = ("result", count, stream)
        if key not in self._samples:
            faces, seed = np.asarray(self.surface.faces), self.streams[stream]
            self._samples[key] = sample_triangles(self.vertices, faces, count, seed, self._area)[0]
        return self._samples[key]

    def on_shape(self, count: int, stream: int) -> np.ndarray:
        """(count, 3) points of the shape's surface, unit frame; other points for each stream, 0 to 4."""
        key = ("shape", count, stream)
        if key not in self._samples:
            self._samples[key] = self.shape.unit_surface(count, self.streams[stream]).points
        return self._samples[key]
