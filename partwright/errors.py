"""Every error that Partwright raises on purpose.

Each message says what was given, what was expected and what to do. The command line prints the message and
exits with `exit_code`; a traceback that reaches a user is a defect.
"""

from __future__ import annotations

from pathlib import Path

LONGEST_MESSAGE = 1000  # characters; what is quoted of a user's data may be of any length


def shortened(message: str) -> str:
    """A message without its middle where it is too long to be read: what is wrong, and what to do, stay."""
    if len(message) <= LONGEST_MESSAGE:
        return message
    return f"{message[: LONGEST_MESSAGE * 2 // 3]} [...] {message[-LONGEST_MESSAGE // 4 :]}"


class PartwrightError(Exception):
    """Root of all named errors."""

    exit_code = 2

    def __init__(self, message: object = "") -> None:
        super().__init__(shortened(str(message)))


class UnreadableFileError(PartwrightError):
    """A file is missing, truncated, or not what its suffix says."""


class UnsupportedFormatError(PartwrightError):
    """The suffix names no format that this build reads or writes."""


class EmptyShapeError(PartwrightError):
    """The file holds no triangles (or none with area)."""


class FlatShapeError(PartwrightError):
    """The shape encloses no volume, so it has no inside to fit."""


class NotFiniteError(PartwrightError):
    """Coordinates or parameters are NaN or infinite."""


class NeedsSurfaceError(PartwrightError):
    """Points without faces that show no surface: too few, too scattered, or too open."""


class AssemblyFileError(PartwrightError):
    """An assembly file is truncated, hostile, or breaks the schema."""


class NewerVersionError(AssemblyFileError):
    """An assembly file was written by a newer version of Partwright."""


class ParameterError(PartwrightError):
    """A field's or part's parameter is outside its allowed range."""


class SettingError(PartwrightError):
    """An option has a value that cannot be used, or two options contradict each other."""


class BoundsError(SettingError):
    """Bounds on an assembly contradict each other, or are finer than can be told."""


class MissingDependencyError(PartwrightError):
    """An optional package is needed; the message carries the install line."""


class OutputError(PartwrightError):
    """The result cannot be written to the path that was asked for."""


class NoSurfaceError(PartwrightError):
    """A field has no zero level inside the box, or one that never closes."""


class OpenShellError(PartwrightError):
    """The surface is an open shell whose openings leave inside and outside undecided."""


class GridError(PartwrightError):
    """A voxel grid has the wrong form, or no surface runs through it."""


class NothingToExportError(PartwrightError):
    """No part of the assembly can be written in the format."""


class NoColoursError(PartwrightError):
    """A file has no colours that could be given to parts."""


class UnitError(PartwrightError):
    """The format cannot say the assembly's length unit."""


class FamilyError(PartwrightError):
    """A family of shapes cannot be prepared, or a prepared one is incomplete, damaged, or of another form."""


class LabelError(PartwrightError):
    """Labels do not match the faces, or the part names, that they are for."""


class ModelError(PartwrightError):
    """A trained model is needed and not here, is damaged, or belongs to another family."""


class UncleanableError(PartwrightError):
    """An assembly has parts whose numbers no relation can bind."""


class NothingToCleanError(PartwrightError):
    """Every number of an assembly is plain already, and every relation between them holds."""


class MessageError(PartwrightError):
    """What a page sent to the studio's server is none of the messages that they share."""


class RobotError(PartwrightError):
    """A robot's file contradicts itself, or has nothing that could be replaced."""


class GeneratorError(PartwrightError):
    """A generator failed, took too long, or answered with something that is no mesh."""


class ObjectiveError(PartwrightError):
    """An objective fails, or its number or derivative is missing or not finite."""


class SimulationError(PartwrightError):
    """A flow simulation failed or diverged. log: the file that says more, where there is one; message: all
    but that."""

    def __init__(self, message: object = "", log: Path | None = None) -> None:
        super().__init__(message if log is None else f"{message}: see {log}")
        self.message, self.log = message, log


class SimulationLimitError(SimulationError):
    """A flow simulation ran out of time or disk: with more of it, it may end well."""


class WorkerError(PartwrightError):
    """A worker process crashed, or was killed past its limit of time or memory."""


class CancelledError(PartwrightError):
    """A run was cancelled before there was anything to keep."""

    exit_code = 130
