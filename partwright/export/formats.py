"""What an export format is, and the table of them: a format is one file with a `FORMAT`, and one line here.

What a format can hold is data, so what it cannot is refused here, in one place and in the same words.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from partwright.atomic_io import replacing_files, report_path
from partwright.errors import (
    MissingDependencyError,
    NothingToExportError,
    OutputError,
    ParameterError,
    SettingError,
    UnitError,
    UnsupportedFormatError,
)
from partwright.registry import Registry

if TYPE_CHECKING:
    from partwright.assembly import Assembly


class Holds(Enum):
    """Something of an assembly that a file can keep; what it lacks is said in FILE.report.json or refused."""

    NAMES = "parts apart, each under its name"
    GROUPS = "the tree of groups"
    COPIES = "a repeated part once, with its copies"
    PARAMETERS = "the parts' own numbers"
    EXACT = "the very surface of named solids, no facets"
    SUBTRACTION = "what is taken away, as an operation"
    BLENDS = "rounded joints between parts"
    LEARNED = "learned parts, be it as the nearest solid"
    MAPS = "colours and normals of textured parts"


@dataclass(frozen=True)
class Format:
    """A file format: how it is written, and what its files can say."""

    name: str
    """What people call it."""
    write: Callable[..., None]
    """`write(assembly, path, **options)`; the parameters beyond the first two are the format's options."""
    holds: frozenset[Holds]
    """What of an assembly it keeps."""
    lengths: Literal["own", "metres"] = "own"
    """What a number in the file measures, where the assembly knows its unit."""
    up: Literal["y", "z"] | None = None
    """The axis to which the file turns what was up; None: axes stay as they are."""
    units: Collection[str] | None = None
    """The units that the file can say; None: any, or the file says none."""
    empty: bool = False
    """Whether a file may hold an assembly that encloses nothing."""
    most: int | None = None
    """Parts, copies counted, that can be written within minutes; None: any number."""
    profiles: bool = False
    """A drawing of the profiles that parts are swept of; an assembly without any is refused."""
    needs: tuple[str, str] | None = None
    """A module and the extra of this package that brings it: ("pxr", "usd")."""

    def lost_maps(self, assembly: Assembly) -> list[str]:
        """Names of the parts whose maps the file leaves out."""
        from partwright.textures.maps import KEY

        if Holds.MAPS in self.holds:
            return []
        return [part.name for part in assembly.parts if KEY in part.metadata]

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options that `write` takes."""
        return tuple(inspect.signature(self.write).parameters)[2:]

    def save(self, assembly: Assembly, path: Path, options: Mapping[str, Any]) -> None:
        """Write the file, and what belongs beside it: all of them or none.

        Raises:
            OutputError: they cannot be written.
        """
        report = report_path(path)
        if not path.parent.is_dir():
            raise OutputError(f"cannot write {path}: there is no folder {path.parent}")
        for wanted in (path, report):
            if wanted.is_dir():
                raise OutputError(f"cannot write {wanted}: a folder of that name is in the way")
        with replacing_files(path.parent) as staging:
            self.write(assembly, staging / path.name, **options)
            if not (staging / report.name).exists():
                report.unlink(missing_ok=True)  # it was of an earlier file

    def check(self, assembly: Assembly, options: Mapping[str, Any]) -> None:
        """Refuse what the format cannot do, before any work.

        Raises:
            SettingError: it has no such option.
            ParameterError: a resolution is no number of cells.
            MissingDependencyError: a package is needed that is not installed.
            ParameterError: it takes fewer parts.
            UnitError: it cannot say the assembly's unit.
            UnsupportedFormatError: it cannot hold one of the parts.
            NothingToExportError: nothing is inside of the assembly.
        """
        for name in options:
            if name not in self.options:
                raise SettingError(
                    f"{self.name} has no option {name!r}; it has {', '.join(self.options) or 'none'}"
                )
        cells = options.get("resolution", 1)
        if isinstance(cells, bool) or not isinstance(cells, int) or cells < 1:
            raise ParameterError(f"resolution: expected a number of cells, at least 1, got {cells!r}")
        self.check_needs()
        self._check_count(assembly)
        self._check_unit(assembly)
        if Holds.LEARNED not in self.holds:
            self._check_learned(assembly)
        lower, upper = assembly.bounds()
        if not self.empty and not (upper > lower).any():
            raise NothingToExportError(
                f"{self.name}: nothing is inside of the assembly; its parts have no size, "
                "or what is intersected does not overlap"
            )

    def _check_count(self, assembly: Assembly) -> None:
        count = sum(1 + len(part.instances) for part in assembly.parts)
        if self.most is not None and count > self.most:
            raise ParameterError(
                f"{self.name}: {count:,} parts, copies counted; at most {self.most:,} are written: take "
                "pieces of the assembly by themselves, or GLB, where copies that are not cut stay copies"
            )

    def check_needs(self) -> None:
        """Raises MissingDependencyError where a package is needed that is not installed."""
        if self.needs is None:
            return
        module, extra = self.needs
        try:
            import_module(module)
        except ImportError as error:
            raise MissingDependencyError(
                f"{self.name} needs the package {module.partition('.')[0]}; "
                f"install it with: pip install 'partwright[{extra}]'"
            ) from error

    def _check_unit(self, assembly: Assembly) -> None:
        from partwright.shapes import canonical_unit

        if assembly.unit and self.units is not None and canonical_unit(assembly.unit) not in self.units:
            raise UnitError(
                f"{self.name} cannot say {assembly.unit}, only {', '.join(self.units)}: "
                "scale the assembly to one of them"
            )

    def _check_learned(self, assembly: Assembly) -> None:
        from partwright.fields.joint import JointField

        learned = [part.name for part in assembly.parts if isinstance(part.field, JointField)]
        if learned:
            raise UnsupportedFormatError(
                f"{self.name} cannot hold learned parts ({learned[0]!r} is one): "
                "export a mesh of them instead, as .glb or .ply"
            )


# suffix -> where its `Format` is
FORMATS: Registry[Format] = Registry(
    "export format",
    "partwright.exports",
    {
        ".json": "partwright.export.json_file:FORMAT",
        ".glb": "partwright.export.glb:FORMAT",
        ".ply": "partwright.export.ply:FORMAT",
        ".stl": "partwright.export.stl:FORMAT",
        ".obj": "partwright.export.obj:FORMAT",
        ".glsl": "partwright.export.glsl:FORMAT",
        ".html": "partwright.export.html:FORMAT",
        ".step": "partwright.export.step:FORMAT",
        ".stp": "partwright.export.step:FORMAT",
        ".scad": "partwright.export.openscad:FORMAT",
        ".build123d.py": "partwright.export.build123d_source:FORMAT",
        ".blender.py": "partwright.export.blender:FORMAT",
        ".mjcf": "partwright.export.mjcf:FORMAT",
        ".mjcf.xml": "partwright.export.mjcf:FORMAT",
        ".urdf": "partwright.export.urdf:FORMAT",
        ".sdf": "partwright.export.sdf:FORMAT",
        ".dxf": "partwright.export.dxf:FORMAT",
        ".svg": "partwright.export.svg:FORMAT",
        ".3mf": "partwright.export.threemf:FORMAT",
        ".usda": "partwright.export.usd:FORMAT",
        ".usdc": "partwright.export.usd:FORMAT",
        ".usd": "partwright.export.usd:FORMAT",
    },
)


def format_of(path: str | Path) -> Format:
    """The format with whose suffix the file's name ends: ".blender.py" is one, ".py" is none.

    Raises:
        UnsupportedFormatError: there is none.
    """
    path = Path(path)
    fitting = [suffix for suffix in FORMATS if path.name.lower().endswith(suffix)]
    if not fitting:
        raise UnsupportedFormatError(
            f"cannot export {path.name}: the suffix {path.suffix.lower()!r} names no format; "
            f"use one of {', '.join(FORMATS)}"
        )
    return FORMATS[max(fitting, key=len)]
