"""Colours of a surface as maps of the parts that stand for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part
from partwright.errors import NoSurfaceError
from partwright.methods import check_count
from partwright.rows import crosses, dots, sums, units
from partwright.shapes.sampling import sample_triangles
from partwright.textures.colours import Colours
from partwright.textures.coordinates import directions, folded, frames, is_hollow, of_nearest_copy
from partwright.textures.maps import KEY, LARGEST, RELIEF, PartMap
from partwright.textures.sightings import Sightings, sightings
from partwright.textures.texels import Texels, filled, read

_NEAR = 0.01  # of the longest side: parts whose surface is so near to a point of the whole are coloured by it
_SPAN = 127.5  # of normals' coordinates, -1 to 1, as bytes
_STEEP = 0.2  # normals further from the surface's own are of something else
_SMOOTH = 0.03  # of a normal's length: surfaces that are as smooth as this need no map
_GAIN = 0.8  # of the squared error of normals that a map must leave at most
_ASIDE = 1e-3  # weight of a point for parts that are near to it, but not nearest

Floats = NDArray[np.float64]


def bake(
    assembly: Assembly, colours: Colours, size: int = 128, seed: int = 0, optimise: bool = True
) -> Assembly:
    """The assembly whose parts have maps of the colours, `size` texels a side, in `metadata["texture"]`.

    Points of the assembly's surface take the colour of the place nearest to them, and pixels of views from
    all around that of the input in the same pixel; each is one of the map of the part that it is of. Texels
    are such that, read between them as renderers do, the map has these colours, in least squares. optimise:
    False for no views, and means of the colours around each texel instead; a part keeps these where they are
    nearer to views that no map is made of. Normals are baked likewise, into `metadata["normals"]`, where
    those views say that it pays. Texels that nothing reaches, on sides that nobody sees, take the colour of
    the nearest one that has. Quadrics, which have no end of their own, get their mean as
    `metadata["colour"]`.

    Raises:
        SettingError: the size cannot be used.
        NoSurfaceError: nothing is inside of the assembly.
    """
    sums = _seen(assembly, colours, size, seed, optimise)
    return _with_maps(assembly, sums, colours, optimise)


def bake_both(
    assembly: Assembly, colours: Colours, size: int = 128, seed: int = 0
) -> tuple[Assembly, Assembly]:
    """What `bake` makes without `optimise`, and with it.

    Raises:
        SettingError, NoSurfaceError: as of `bake`.
    """
    sums = _seen(assembly, colours, size, seed, True)
    return _with_maps(assembly, sums, colours, False), _with_maps(assembly, sums, colours, True)


def _with_maps(assembly: Assembly, sums: Sequence[_Sums], colours: Colours, optimise: bool) -> Assembly:
    for part, one in zip(assembly.parts, sums, strict=True):
        assembly = assembly.replace_part(part.name, one.coloured(colours, optimise))
    return assembly


def _seen(assembly: Assembly, colours: Colours, size: int, seed: int, views: bool) -> list[_Sums]:
    """What is seen of each part."""
    check_count("size", size, low=4)
    size = min(size, LARGEST)
    sums = [_Sums(part, size) for part in assembly.parts]
    reach = _NEAR * float(np.ptp(colours.vertices, axis=0).max())
    for seen in sightings(assembly, colours, size, seed, views):
        off = np.abs(assembly.part_distances(seen.points))
        nearest = off.argmin(axis=0)
        for i, (part, one) in enumerate(zip(assembly.parts, sums, strict=True)):
            near = np.flatnonzero(off[i] <= reach + part.blend)
            share = np.where(nearest[near] == i, 1.0, _ASIDE)
            one.see(seen, near, share * seen.weights[near])
    return sums


class _Sums:
    """Colours and weights of a part's texels."""

    def __init__(self, part: Part, size: int) -> None:
        self.part, self.size = part, size
        self.bounded = part.field.quadric() is None and bool(np.isfinite(np.array(part.field.bounds())).all())
        self.sides = 2 if is_hollow(part.field) else 1
        self.sampled = Texels(size, self.sides, 3)  # colours of nearest places
        self.texels = Texels(size, self.sides, 6)  # of all that is seen
        self.mean = np.zeros(4)
        self.held: list[tuple[Floats, NDArray[np.bool_], Floats, Floats]] = []

    def see(self, seen: Sightings, near: NDArray[np.int64], weights: Floats) -> None:
        """Some of what is seen, with weights (N,)."""
        colours = seen.colours[near]
        if not seen.held:
            self.mean += np.append((weights[:, None] * colours).sum(axis=0), weights.sum())
        if not self.bounded or not len(near):
            return
        field = self.part.field
        points, smooth, normals = of_nearest_copy(
            self.part, seen.points[near], seen.smooth[near], seen.normals[near]
        )
        towards, inner = directions(field, points)
        across, turned = frames(field, points, smooth)
        up = turned[:, None] * crosses(smooth, across)
        bent = np.stack([dots(normals, axis) for axis in (across, up, smooth)], axis=1)
        bent[bent[:, 2] < _STEEP] = (0, 0, 1)
        place, values = folded(towards), np.column_stack([colours, _SPAN * (bent + 1)])
        if seen.held:
            self.held.append((place, inner, values, weights))
            return
        self.texels.add(place, inner, values, weights)
        if seen.sampled:
            self.sampled.add(place, inner, colours, weights)

    def coloured(self, colours: Colours, optimise: bool) -> Part:
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
        plain = self._image(*self.sampled.means()) if self.sampled.any else None
        image = self._image(*self.texels.solved()) if optimise or plain is None else None
        looks = [one[..., :3] for one in (image, plain) if one is not None]
        metadata[KEY] = PartMap(np.ascontiguousarray(min(looks, key=self._off))).text()
        metadata.pop(RELIEF, None)
        if image is not None and self._pays(image[..., 3:]):
            metadata[RELIEF] = PartMap(np.ascontiguousarray(image[..., 3:])).text()
        return replace(self.part, metadata=metadata)

    def _off(self, image: NDArray[np.uint8]) -> float:
        """Squared error of colours in views that no map is made of."""
        return float(
            sum(
                weights @ sums((values[:, :3] - read(image, place, inner)) ** 2)
                for place, inner, values, weights in self.held
            )
        )

    def _pays(self, image: NDArray[np.uint8]) -> bool:
        """Whether normals of views that no map is made of are met better with it than without."""
        flat = bent = total = 0.0
        for place, inner, values, weights in self.held:
            found, wanted = read(image, place, inner) / _SPAN - 1, values[:, 3:] / _SPAN - 1
            found = units(found)
            flat += float(weights @ sums((wanted - (0, 0, 1)) ** 2))
            bent += float(weights @ sums((wanted - found) ** 2))
            total += float(weights.sum())
        return flat > _SMOOTH**2 * total and bent < _GAIN * flat

    def _add_own(self, colours: Colours) -> None:
        """Of a part that nobody sees, its own surface."""
        from partwright.meshing import mesh_part

        try:
            mesh = mesh_part(replace(self.part, instances=()), 24)
        except NoSurfaceError:
            return
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
        points, _ = sample_triangles(vertices, faces, 4 * self.size**2, 0)
        towards, inner = directions(self.part.field, points)
        values = np.column_stack([colours.at(points), np.tile((_SPAN, _SPAN, 2 * _SPAN), (len(points), 1))])
        self.texels.add(folded(towards), inner, values, np.ones(len(points)))

    def _image(self, values: Floats, seen: Floats) -> NDArray[np.uint8]:
        return np.round(np.clip(filled(values, seen, self.sides), 0, 255)).astype(np.uint8)
