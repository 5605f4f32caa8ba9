"""A picture in, a shape out: the picture is tried, the generator asked, and its answer looked at."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from partwright.atomic_io import replacing_files
from partwright.errors import PartwrightError, UnreadableFileError
from partwright.generators.command import Command
from partwright.generators.deadline import Deadline
from partwright.generators.glb import check_glb
from partwright.generators.service import Service, is_address
from partwright.input_files import check_file
from partwright.methods import Cancellation, check_number
from partwright.shapes import Length, Shape, load_shape

GENERATED = "generated.glb"  # the name under which a fit keeps a generator's mesh
TIME_LIMIT = 600.0  # seconds: a generator that loads its model first takes minutes


def shape_from_image(
    image: str | Path,
    via: str,
    *,
    time_limit: float = TIME_LIMIT,
    keep: str | Path | None = None,
    unit: str | None = None,
    up: str | None = None,
    thickness: Length | None = None,
    cancel: Cancellation | None = None,
    progress: Callable[[float], None] | None = None,
) -> Shape:
    """The shape that a generator makes of a picture (SuperFrusta, section 5).

    Args:
        image: a picture in any format that Pillow reads; the generator gets the file as it is.
        via: a command line, run without a shell, with `{input}` in the place of the picture's path and
            `{output}` in that of the GLB to write, or `{folder}` in that of an empty folder in which it
            leaves one GLB; or the address of a service, http:// or https://, which takes a POST of
            `{"image": "<base64>"}` and answers with a GLB.
        time_limit: seconds after which the generator is ended, with all that it has started.
        keep: where its mesh is written (.glb), as soon as it is there and though it may be none that can be
            fitted; its folder is made if need be.
        unit: as of `load_shape`; a GLB is in metres, where nothing else is said.
        up: as of `load_shape`; a GLB has Y up, where nothing else is said.
        thickness: as of `load_shape`.
        cancel: ends the generator, from any thread.
        progress: called with the seconds that the generator has been at work, some twenty times a second.

    Returns:
        A shape with the picture's name, whose `repairs` begin with where it is from.

    Raises:
        SettingError: `via` has no placeholders or is no address, or the time limit is none.
        UnreadableFileError: the picture is missing, or is none.
        GeneratorError: the generator failed, took too long, or answered with something that is no GLB.
        CancelledError: it was cancelled.
        OutputError: the mesh cannot be kept where it was asked for.
        PartwrightError: what `load_shape` raises of its mesh.
    """
    image, started = Path(image), time.perf_counter()
    check_number("time limit", time_limit, low=0.1)
    generator = Service.of(via) if is_address(via) else Command.of(via)
    check_image(image)
    deadline = Deadline(time_limit, cancel or Cancellation(), progress)
    data = generator.mesh_of(image, deadline)
    check_glb(data, generator.name)
    # First: what is no shape yet may be one with other options, and took minutes to make.
    if keep is not None:
        with replacing_files(Path(keep).parent) as staging:
            (staging / Path(keep).name).write_bytes(data)
    with TemporaryDirectory() as folder:
        made = Path(folder) / f"{image.stem or 'image'}.glb"
        made.write_bytes(data)
        try:
            shape = load_shape(made, unit, up, thickness)
        except PartwrightError as error:
            kept = f", kept as {keep}" if keep is not None else ""
            raise type(error)(f"what {generator.name} made{kept}: {error}") from error
    shape.name, shape.file = image.stem, image.name
    shape.repairs = (f"a generator made this shape of {image.name}", *shape.repairs)
    shape.reading_seconds = time.perf_counter() - started
    return shape


def check_image(path: Path) -> None:
    """That a file is a picture, and all of it there; Pillow's guard against huge ones stays.

    Raises:
        UnreadableFileError: it is not.
    """
    from PIL import Image

    if check_file(path) == 0:
        raise UnreadableFileError(f"{path}: is empty; expected a picture")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as picture:
                picture.load()
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise UnreadableFileError(f"{path}: has too many pixels to be opened; make it smaller") from error
    except Exception as error:  # Pillow's plugins raise what they like for files that are damaged
        raise UnreadableFileError(
            f"{path}: cannot be read as a picture ({type(error).__name__}); expected PNG, JPEG or the like"
        ) from error
