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
from partwright.textures.coordinates import directions, folded, is_hollow
from partwright.textures.maps import KEY, LARGEST, PartMap

_PER_TEXEL = 5  # samples of the surface
_MOST_SAMPLES = 3_000_000
_AT_ONCE = 1 << 17
_NEAR = 0.01  # of the longest side: parts whose surface is so near to a point of the whole are coloured by it
_ASIDE = 1e-3  # weight of a point for parts that are near to it, but not nearest

Floats = NDArray[np.float64]


def bake(assembly: Assembly, colours: Colours, size: int = 128, seed: int = 0) -> Assembly:
    """The assembly whose parts have maps of the colours, `size` texels a side, in `metadata["texture"]`.

    Points of the assembly's surface take the colour of the place nearest to them, and give it to the map of
    the part that they are of. Texels that none of them reaches, on sides that nobody sees, take that of the
    nearest one that has. Quadrics, which have no end of their own, get their mean as `metadata["colour"]`.

    Raises:
        SettingError: the size cannot be used.
        NoSurfaceError: nothing is inside of the assembly.
    """
    from partwright.meshing import mesh_assembly

    check_count("size", size, low=4)
    size = min(size, LARGEST)
    mesh = mesh_assembly(assembly)
    count = min(_MOST_SAMPLES, _PER_TEXEL * size * size * max(1, len(assembly)))
    points, _ = sample_triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces), count, seed)
    sums = [_Sums(part, size) for part in assembly.parts]
    reach = _NEAR * float(np.ptp(points, axis=0).max())
    for start in range(0, count, _AT_ONCE):
        some = points[start : start + _AT_ONCE]
        seen = colours.at(some)
        off = np.abs(assembly.part_distances(some))
        nearest = off.argmin(axis=0)
        for i, (part, one) in enumerate(zip(assembly.parts, sums, strict=True)):
            near = np.flatnonzero(off[i] <= reach + part.blend)
            one.add(some[near], seen[near], np.where(nearest[near] == i, 1.0, _ASIDE))
    for part, one in zip(assembly.parts, sums, strict=True):
        assembly = assembly.replace_part(part.name, one.coloured(colours))
    return assembly


class _Sums:
    """Colours and weights of a part's texels."""

    def __init__(self, part: Part, size: int) -> None:
        self.part, self.size = part, size
        self.bounded = part.field.quadric() is None and bool(np.isfinite(np.array(part.field.bounds())).all())
        self.sides = 2 if is_hollow(part.field) else 1
        self.texels = np.zeros((size * self.sides * size, 4))
        self.mean = np.zeros(4)

    def add(self, points: Floats, colours: Floats, weights: Floats) -> None:
        """Points (N, 3) in own units and place, shared out to the four texels around each."""
        self.mean += np.append((weights[:, None] * colours).sum(axis=0), weights.sum())
        if not self.bounded or not len(points):
            return
        points = _local(self.part, points)
        n, width = self.size, self.size * self.sides
        towards, inner = directions(self.part.field, points)
        place = folded(towards) * n - 0.5
        low = np.floor(place)
        for dx in (0, 1):
            for dy in (0, 1):
                x = np.clip(low[:, 0] + dx, 0, n - 1).astype(int) + np.where(inner, n, 0)
                y = np.clip(low[:, 1] + dy, 0, n - 1).astype(int)
                share = weights * np.abs(1 - dx - (place - low)[:, 0]) * np.abs(1 - dy - (place - low)[:, 1])
                each = np.column_stack([share[:, None] * colours, share])
                for channel in range(4):
                    self.texels[:, channel] += np.bincount(
                        y * width + x, each[:, channel], minlength=len(self.texels)
                    )

    def coloured(self, colours: Colours) -> Part:
        metadata = dict(self.part.metadata)
        if not self.bounded:
            if self.mean[3] > 0:
                red, green, blue = (round(v) for v in self.mean[:3] / self.mean[3])
                metadata["colour"] = f"#{red:02x}{green:02x}{blue:02x}"
            return replace(self.part, metadata=metadata)
        if not (self.texels[:, 3] > 0).any():
            self._add_own(colours)
        if not (self.texels[:, 3] > 0).any():
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
        from scipy.ndimage import distance_transform_edt

        known = self.texels[:, 3] > 0
        values = np.zeros((len(known), 3))
        values[known] = self.texels[known, :3] / self.texels[known, 3:]
        image = values.reshape(self.size, -1, 3)
        for side in range(self.sides):
            own = slice(side * self.size, (side + 1) * self.size)
            there = known.reshape(self.size, -1)[:, own]
            if not there.any():
                image[:, own] = image[:, : self.size]
            elif not there.all():
                rows, columns = distance_transform_edt(~there, return_distances=False, return_indices=True)
                image[:, own] = image[:, own][rows, columns]
        return np.round(image).astype(np.uint8)


def _local(part: Part, points: Floats) -> Floats:
    """Points (N, 3) in the frame of the part, or of its copy that is nearest to each."""
    own = [copy.pose.inverse()(points) for copy in part.copies]
    if len(own) == 1:
        return np.asarray(own[0])
    off = [np.abs(part.field(np.ascontiguousarray(one, np.float32))) for one in own]
    return np.asarray(np.stack(own)[np.argmin(off, axis=0), np.arange(len(points))])
