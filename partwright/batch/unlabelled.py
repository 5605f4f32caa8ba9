"""Parts for a family that has no labels: every shape is fitted, and what is alike in many becomes a part."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.assembly.names import unique_names
from partwright.assembly.palette import palette
from partwright.atomic_io import check_folder, replacing_files
from partwright.batch.together import fit_many
from partwright.cleaning.segmentation import segment_faces
from partwright.cleaning.splitting import split_at_borders
from partwright.datasets.matching import COMMON, Matching, Regions, match, regions_of
from partwright.datasets.preparing import Refused
from partwright.errors import CancelledError, FamilyError
from partwright.export.label_files import write_segments
from partwright.fitting import Result
from partwright.methods import Progress
from partwright.render import Camera, render_mesh, sheet, write_png
from partwright.shapes import MESH_SUFFIXES, Shape

PICTURE = "parts.png"
_PANEL, _COLUMNS, _SHOWN = 220, 6, 24
_NUMBER = re.compile(r"(_\d+)+$")  # that tells copies apart

Array = NDArray[Any]


@dataclass(frozen=True)
class Cut:
    """A shape's surface, vertices (V, 3) and faces (F, 3), cut along the borders of its fit's parts, with the
    region (F,) of each face. names: of the regions."""

    name: str
    vertices: Array
    faces: Array
    region: Array
    names: tuple[str, ...]
    assembly: Assembly

    @cached_property
    def regions(self) -> Regions:
        """For `match`."""
        return regions_of(self.vertices, self.faces, self.region, len(self.names))


@dataclass(frozen=True)
class Found:
    """Shapes, and the family's parts: their names, as `matching.slots` has them."""

    shapes: tuple[Cut, ...]
    parts: tuple[str, ...]
    matching: Matching
    refused: tuple[Refused, ...]

    def labels(self, number: int) -> Array:
        """(F,) the part of each face of a shape."""
        return self.matching.of[number][self.shapes[number].region]


def meshes_of(folder: str | Path) -> list[Path]:
    """The meshes in a folder, by name. Raises FamilyError where there are fewer than two."""
    folder = Path(folder)
    if not folder.is_dir():
        raise FamilyError(f"{folder}: no such folder; give a folder of meshes")
    files = [p for p in folder.iterdir() if p.suffix.lower() in MESH_SUFFIXES and not p.name.startswith(".")]
    if len(files) < 2:
        raise FamilyError(f"{folder}: {len(files)} meshes; at least two are needed to tell what is alike")
    names = Counter(p.stem for p in files)
    twice = [name for name, times in names.items() if times > 1]
    if twice:
        raise FamilyError(f"{folder}: two meshes are called {twice[0]!r}; rename one of them")
    return sorted(files)


def find_parts(
    shapes: Sequence[Shape | str | Path],
    *,
    common: float = COMMON,
    at_once: int = 0,
    progress: Callable[[int, Progress], None] | None = None,
    **options: Any,
) -> Found:
    """Fit every shape by `fit_many`, whose options these are, and match what the fits have alike.

    common: share of the shapes that have a part, at least. Shapes should stand alike.

    Raises:
        FamilyError: fewer than two shapes could be fitted, or nothing is alike.
        CancelledError: it was cancelled.
    """
    results = fit_many(shapes, at_once, progress=progress, **options)
    # What a fit had when it was stopped is no ground to tell parts by.
    if any(one is None or (isinstance(one, Result) and one.outcome == "interrupted") for one in results):
        raise CancelledError("cancelled before all shapes were fitted")
    cuts, refused = [], []
    for shape, result in zip(shapes, results, strict=True):
        name = shape.name if isinstance(shape, Shape) else Path(shape).stem
        if isinstance(result, Result):
            cuts.append(cut_surface(name, result.shape, result.assembly))
        else:
            refused.append(Refused(name, str(result)))
    if len(cuts) < 2:
        why = "".join(f"; {one.name}: {one.reason}" for one in refused)
        raise FamilyError(f"{len(cuts)} shapes could be fitted; a family needs at least two{why}")
    matching = match([one.regions for one in cuts], common)
    return Found(tuple(cuts), _named(cuts, matching), matching, tuple(refused))


def cut_surface(name: str, shape: Shape, assembly: Assembly) -> Cut:
    """The shape's repaired surface by the parts of a fit, copies told apart."""
    parts = assembly.expanded()
    vertices, faces, _ = split_at_borders(np.asarray(shape.vertices), np.asarray(shape.faces), parts)
    region, names = segment_faces(vertices, faces, parts)
    return Cut(name, vertices, faces, region, names, assembly)


def write_found(folder: str | Path, found: Found) -> None:
    """Each shape as NAME.ply with NAME.ply.labels.json, as `parts prepare` and `parts family` take them, and
    parts.png. Raises OutputError."""
    check_folder(folder)
    with replacing_files(folder) as made:
        for number, one in enumerate(found.shapes):
            paths = [(part,) for part in found.parts]
            labels = found.labels(number)
            write_segments(made / f"{one.name}.ply", one.vertices, one.faces, labels, paths, one.assembly)
        write_png(made / PICTURE, picture(found))


def picture(found: Found) -> np.ndarray:
    """The first shapes, a colour a part."""
    import trimesh

    panels = []
    for number, one in enumerate(found.shapes[:_SHOWN]):
        mesh = trimesh.Trimesh(one.vertices, one.faces, process=False)
        colours = palette(len(found.parts))[found.labels(number)]
        panels.append(render_mesh(mesh, Camera(up=one.assembly.up or "z"), (_PANEL, _PANEL), colours))
    return sheet(panels, [one.name for one in found.shapes[:_SHOWN]], columns=min(_COLUMNS, len(panels)))


def _named(cuts: Sequence[Cut], matching: Matching) -> tuple[str, ...]:
    """Each slot by the name that most of its shapes' regions have, the largest of each shape."""
    wanted = []
    for slot in range(len(matching.slots)):
        votes: Counter[str] = Counter()
        for one, of in zip(cuts, matching.of, strict=True):
            area = np.where(of == slot, one.regions.areas, -1.0)
            if area.max(initial=-1.0) >= 0:
                votes[_NUMBER.sub("", one.names[int(area.argmax())])] += 1
        wanted.append(votes.most_common(1)[0][0] if votes else "part")
    return tuple(unique_names(wanted, ["part"] * len(wanted)))
