"""What every export format keeps to, whichever it is: the same small assemblies through all of them.

A new format is held to this by its line in the table. A reader in `readers.py` adds the checks of what lies
in its files.
"""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.atomic_io import report_path
from partwright.errors import (
    MissingDependencyError,
    NoSurfaceError,
    NothingToExportError,
    OutputError,
    PartwrightError,
    UnitError,
    UnsupportedFormatError,
)
from partwright.export import export
from partwright.export.axes import to_gltf, to_metres_z_up
from partwright.export.formats import FORMATS, Format, Holds
from partwright.fields import (
    Box,
    Cylinder,
    Extrusion,
    Pipe,
    Profile,
    Quadric,
    Revolution,
    Sphere,
    SuperFrustum,
)
from partwright.fields.joint import JointField, Member
from partwright.meshing import mesh_assembly
from partwright.shapes import METRES
from tests.export.readers import READERS, read

TWINS = {".stp": ".step", ".mjcf": ".mjcf.xml"}  # another suffix of the very same file
SUFFIXES = [suffix for suffix in FORMATS.own if suffix not in TWINS and not FORMATS[suffix].profiles]
VOLUME, PLACE = 0.02, 0.02  # how far facets may be off: of the volume, and of the longest side
_CELLS = 48


def half_spaces() -> tuple[Part, ...]:
    normals = np.vstack([np.eye(3), -np.eye(3)]).tolist()
    return tuple(Part(Quadric.plane(n, 1.0), name=f"plane {i}") for i, n in enumerate(normals))


@cache
def assemblies() -> dict[str, Assembly]:
    shift = Similarity(translation=(-1.6, 0, 0))
    plate = Part(Box((2, 2, 0.5)), name="plate")
    ball = Part(Sphere(0.6), (0.7, 0, 0), blend=0.1, name="b")
    hole = Part(Cylinder(0.4, 2), name="hole")
    foot = Part(Cylinder(0.1, 1), (0.8, 0.8, -0.5), name="foot", instances=(shift,))
    cube = Assembly(half_spaces(), "intersection", name="cube")
    drill = Part(Quadric.cylinder(0.5), name="drill")
    frustum = Part(SuperFrustum((1, 0.8, 2), 0.4, 0.05, 0.7), name="frustum")
    core = Part(Cylinder(0.2, 3), name="core")  # what the hole leaves standing
    body = Assembly((plate, Part(Box((0.4, 0.4, 1)), (2, 0, 0), name="beside")), name="body")
    drilled = Assembly(
        (body, Assembly((hole, core), "difference", name="ring")), "difference", name="drilled"
    )
    bracket = Profile(((-1, -0.5), (1, -0.5, 0.4), (1, 0.5), (-1, 0.5)), (Profile.circle(0.2).outline,))
    shallow = (drill, *half_spaces()[2::3])
    return {
        "one box": Assembly((Part(Box((1, 2, 3)), (4, 0, 0), name="box"),), unit="mm", up="z"),
        "a blended union": Assembly((Part(Box((1, 1, 1)), name="a"), ball), unit="cm", up="y"),
        "a difference": Assembly((plate, hole), "difference", unit="in", up="z"),
        "a repeated part": Assembly((plate, foot), name="table", unit="m", up="z"),
        "a hole with a core": Assembly((drilled,), unit="mm", up="z"),
        "a convex less a convex": Assembly(
            (cube, Assembly(shallow, "intersection", name="shallow")), "difference", unit="mm", up="y"
        ),
        "quadrics": Assembly((cube, drill), "difference", unit="mm", up="z"),
        "profiles": Assembly(
            (
                Part(Extrusion(bracket, 0.4), name="bracket"),
                Part(Revolution(Profile.circle(0.2, (0.5, 0)), 120), (0, 0, 0.6), name="handle"),
            ),
            unit="mm",
            up="z",
        ),
        "pipes": Assembly(
            (
                Part(Pipe(((0, 0, 0), (0, 0, 2, 0.5), (2, 0, 2)), 0.3), name="rod"),
                Part(Pipe(((0, 2, 0), (2, 2, 0, 1), (2, 4, 0)), 0.6, 0.2), name="tube"),
            ),
            unit="mm",
            up="z",
        ),
        "nothing known": Assembly((frustum, Part(Box((2, 2, 0.2)), (0, 0, -1), name="base"))),
    }


@dataclass(frozen=True)
class Learned(JointField):
    """A ball that passes for a learned part."""

    kind: ClassVar[str] = "learned ball"
    radius: float = 1.0
    members: tuple[Member, ...] = ()
    shape_key, role, slope, wall = "ball", "ball", 1.0, 1.0

    def __call__(self, points: Any) -> Any:
        return np.linalg.norm(points, axis=1) - points.dtype.type(self.radius)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.full(3, -self.radius), np.full(3, self.radius)

    def scaled(self, factor: float) -> Learned:
        return dataclasses.replace(self, radius=self.radius * factor)

    def surface(self, resolution: int) -> trimesh.Trimesh:
        return trimesh.creation.icosphere(subdivisions=3, radius=self.radius)

    def preview(self) -> trimesh.Trimesh:
        return self.surface(0)

    def among(self, members: Sequence[Member], shared: dict[Any, Any]) -> Self:
        return self

    def together(self, points: np.ndarray, fields: Sequence[JointField]) -> list[np.ndarray]:
        return [field(points) for field in fields]


def chosen(suffix: str) -> Format:
    """The format, if what it needs is installed."""
    found = FORMATS[suffix]
    if found.needs:
        pytest.importorskip(found.needs[0].partition(".")[0])
    return found


def save(assembly: Assembly, path: Path, form: Format) -> None:
    """With few cells: what is checked here does not need them, and 3MF is slow to read."""
    export(assembly, path, **({"resolution": _CELLS} if "resolution" in form.options else {}))


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def sharp(node: Node) -> Any:
    """Without blends."""
    children = tuple(map(sharp, node.children)) if isinstance(node, Assembly) else ()
    return dataclasses.replace(node, blend=0.0, **({"children": children} if children else {}))


def fails(assembly: Assembly, path: Path, form: Format) -> PartwrightError:
    """The one named error, after which the folder is as it was."""
    before = sorted(path.parent.rglob("*"))
    with pytest.raises(PartwrightError) as caught:
        save(assembly, path, form)
    assert sorted(path.parent.rglob("*")) == before
    return caught.value


@cache
def surface(assembly: Assembly) -> trimesh.Trimesh:
    """What all formats' files are held against, made once."""
    return mesh_assembly(assembly, 128)


def check_contents(path: Path, suffix: str, form: Format, assembly: Assembly) -> None:
    """The file's extents, volume and unit are the assembly's."""
    found = read(path, suffix)
    if found is None:
        return
    weighs = suffix in (".mjcf.xml", ".urdf", ".sdf")  # by the blended surface, whatever the geometries are
    own = assembly if weighs or Holds.BLENDS in form.holds else sharp(assembly)
    turn = {"y": to_gltf, "z": to_metres_z_up, None: lambda _: Similarity()}[form.up](assembly)
    mesh = surface(own)
    metres = METRES[assembly.unit] if assembly.unit else 1.0
    said = found.metres if assembly.unit and found.metres is not None else metres
    if assembly.unit is None and suffix not in (".step",):
        said = metres = 1.0
    places = dataclasses.replace(turn, scale=1.0)(mesh.vertices)
    box, side = np.array([places.min(axis=0), places.max(axis=0)]), float(np.ptp(mesh.bounds, axis=0).max())
    assert np.abs(found.box * said / metres - box).max() < PLACE * side
    assert found.volume * (said / metres) ** 3 == pytest.approx(mesh.volume, rel=VOLUME)


@pytest.mark.parametrize("name", assemblies())
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_file_is_the_assembly_and_the_same_twice(tmp_path: Path, suffix: str, name: str) -> None:
    form, assembly = chosen(suffix), assemblies()[name]
    folders = [tmp_path / each for each in ("first", "second")]
    for folder in folders:
        folder.mkdir()
        save(assembly, folder / f"a{suffix}", form)
    first, second = map(files, folders)
    assert first == second
    assert f"a{suffix}" in first
    assert not any(file.startswith(".") for file in first)
    check_contents(folders[0] / f"a{suffix}", suffix, form, assembly)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_blend_that_is_lost_is_reported(tmp_path: Path, suffix: str) -> None:
    """Solids have sharp edges and say so; surfaces are blended and need say nothing."""
    form, path = chosen(suffix), tmp_path / f"a{suffix}"
    save(assemblies()["a blended union"], path, form)
    if Holds.BLENDS in form.holds:
        assert list(tmp_path.iterdir()) == [path]
    elif Holds.EXACT in form.holds:
        changes = json.loads(report_path(path).read_text())["approximated"]
        assert any("b" in change["parts"] and change["blend_dropped"] > 0 for change in changes)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_length_unit_is_kept_or_refused(tmp_path: Path, suffix: str) -> None:
    """Metres are metres wherever a file can say so; MuJoCo has a smallest inertia."""
    form, box = chosen(suffix), assemblies()["one box"]
    for unit in METRES:
        assembly, path = dataclasses.replace(box, unit=unit), tmp_path / f"{unit}{suffix}"
        if (form.units is not None and unit not in form.units) or (unit == "um" and form.name == "MJCF"):
            assert isinstance(fails(assembly, path, form), UnitError)
        else:
            save(assembly, path, form)
            check_contents(path, suffix, form, assembly)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_nothing_to_export(tmp_path: Path, suffix: str) -> None:
    """But for formats of the parts' numbers themselves, which a part without volume has."""
    form = chosen(suffix)
    sheet = Assembly((Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet"),), unit="mm", up="z")
    if suffix in (".json", ".glsl", ".html"):
        export(sheet, tmp_path / f"a{suffix}")
    else:
        assert isinstance(fails(sheet, tmp_path / f"a{suffix}", form), NothingToExportError | NoSurfaceError)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_learned_parts_are_written_or_refused(tmp_path: Path, suffix: str) -> None:
    form, path = chosen(suffix), tmp_path / f"a{suffix}"
    assembly = Assembly((Part(Learned(0.7), name="ball"),), unit="m", up="z")
    if Holds.LEARNED in form.holds:
        save(assembly, path, form)
        # Files of parts by their kind cannot be read back, for this one is in no registry.
        if suffix not in (".json", ".html") and Holds.BLENDS in form.holds:
            check_contents(path, suffix, form, assembly)
    else:
        error = fails(assembly, path, form)
        assert isinstance(error, UnsupportedFormatError)
        assert "'ball'" in str(error)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", ["a blended union", "a difference"])
def test_a_file_that_cannot_be_written_leaves_nothing(
    tmp_path: Path, suffix: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    form, assembly = chosen(suffix), assemblies()[name]
    path = tmp_path / f"a{suffix}"
    assert "nowhere" in str(fails(assembly, tmp_path / "nowhere" / path.name, form))
    path.mkdir()
    assert isinstance(fails(assembly, path, form), OutputError)
    path.rmdir()

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert isinstance(fails(assembly, path, form), OutputError)


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if FORMATS[s].needs])
def test_a_missing_package_is_named_with_its_install_line(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, extra = FORMATS[suffix].needs or ("", "")
    monkeypatch.setitem(sys.modules, module, None)
    error = fails(assemblies()["one box"], tmp_path / f"a{suffix}", FORMATS[suffix])
    assert isinstance(error, MissingDependencyError)
    assert f"pip install 'partwright[{extra}]'" in str(error)


def test_every_format_with_a_reader_is_read() -> None:
    """Sources for programs that are seldom installed are read by tests of their own."""
    assert {*SUFFIXES} - {*READERS} == {".glsl", ".scad", ".blender.py"}


def test_the_docs_say_what_each_format_holds() -> None:
    page = (Path(__file__).parents[2] / "docs" / "export.md").read_text("utf-8")
    for form in (FORMATS[suffix] for suffix in FORMATS.own):
        kept = ("yes" if what in form.holds else "-" for what in Holds)
        assert f"| {form.name} | {' | '.join(kept)} |" in page
    for what in Holds:
        assert f"- {what.name.lower()}: {what.value}" in page
