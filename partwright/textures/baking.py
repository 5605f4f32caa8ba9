"""Colours of a surface as maps of the parts that stand for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part
from partwright.errors import NoSurfaceError
from partwright.methods import check_count
from partwright.shapes.sampling import sample_triangles
from partwright.textures.colours import Colours
from partwright.textures.coordinates import directions, folded, is_hollow, of_nearest_copy
from partwright.textures.maps import KEY, LARGEST, PartMap
from partwright.textures.sightings import sightings
from partwright.textures.texels import Texels, filled

_NEAR = 0.01  # of the longest side: parts whose surface is so near to a point of the whole are coloured by it
_ASIDE = 1e-3  # weight of a point for parts that are near to it, but not nearest

Floats = NDArray[np.float64]


def bake(
    assembly: Assembly, colours: Colours, size: int = 128, seed: int = 0, optimise: bool = True
) -> Assembly:
    """The assembly whose parts have maps of the colours, `size` texels a side, in `metadata["texture"]`.

    Points of the assembly's surface take the colour of the place nearest to them, and pixels of views from
    all around that of the input in the same pixel; each is one of the map of the part that it is of. Texels
    are such that, read between them as renderers do, the map has these colours, in least squares. optimise:
    False for no views, and means of the colours around each texel instead. Texels that nothing reaches, on
    sides that nobody sees, take the colour of the nearest one that has. Quadrics, which have no end of their
    own, get their mean as `metadata["colour"]`.

    Raises:
        SettingError: the size cannot be used.
        NoSurfaceError: nothing is inside of the assembly.
    """
    check_count("size", size, low=4)
    size = min(size, LARGEST)
    sums = [_Sums(part, size, optimise) for part in assembly.parts]
    reach = _NEAR * float(np.ptp(colours.vertices, axis=0).max())
    for seen in sightings(assembly, colours, size, seed, views=optimise):
        off = np.abs(assembly.part_distances(seen.points))
        nearest = off.argmin(axis=0)
        for i, (part, one) in enumerate(zip(assembly.parts, sums, strict=True)):
            near = np.flatnonzero(off[i] <= reach + part.blend)
            share = np.where(nearest[near] == i, 1.0, _ASIDE)
            one.add(seen.points[near], seen.colours[near], share * seen.weights[near])
    for part, one in zip(assembly.parts, sums, strict=True):
        assembly = assembly.replace_part(part.name, one.coloured(colours))
    return assembly


class _Sums:
    """Colours and weights of a part's texels."""

    def __init__(self, part: Part, size: int, optimised: bool) -> None:
        self.part, self.size, self.optimised = part, size, optimised
        self.bounded = part.field.quadric() is None and bool(np.isfinite(np.array(part.field.bounds())).all())
        self.sides = 2 if is_hollow(part.field) else 1
        self.texels = Texels(size, self.sides, 3)
        self.mean = np.zeros(4)

    def add(self, points: Floats, colours: Floats, weights: Floats) -> None:
        """Points (N, 3) in own units and place, shared out to the four texels around each."""
        self.mean += np.append((weights[:, None] * colours).sum(axis=0), weights.sum())
        if not self.bounded or not len(points):
            return
        points = of_nearest_copy(self.part, points)
        towards, inner = directions(self.part.field, points)
        self.texels.add(folded(towards), inner, colours, weights)

    def coloured(self, colours: Colours) -> Part:
        metadata = dict(self.part.metadata)
        if not self.bounded:
            if self.mean[3] > 0:
                red, green, blue = (round(v) for v in self.mean[:3] / self.mean[3])
                metadata["colour"] = f"#{red:02x}{green:02x}{blue:02x}"
            return replace(self.part, metadata=metadata)
        if not self.texels.any:
            self._add_own(colours)
        if not self.texels.any:
            return self.part
        return replace(self.part, metadata=metadata | {KEY: PartMap(self._image()).text()})

    def _add_own(self, colours: Colours) -> None:
        """Of a part that nobody sees, its own surface."""
        from partwright.meshing import mesh_part

        try:
            mesh = mesh_part(replace(self.part, instances=()), 24)
        except NoSurfaceError:
            return
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
        points, _ = sample_triangles(vertices, faces, 4 * self.size**2, 0)
        self.add(points, colours.at(points), np.ones(len(points)))

    def _image(self) -> NDArray[np.uint8]:
        values, known = self.texels.solved() if self.optimised else self.texels.means()
        return np.round(np.clip(filled(values, known, self.sides), 0, 255)).astype(np.uint8)
