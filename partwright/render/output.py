"""Pictures to files, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from partwright.errors import OutputError


def write(path: str | Path, save: Callable[[Path], None]) -> None:
    """Call `save` with a temporary name beside `path`, then rename.

    Raises OutputError where the folder is missing or cannot be written to.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        save(temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise OutputError(f"Cannot write {target}: {error.strerror or error}; give another place.") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_png(path: str | Path, image: np.ndarray) -> None:
    """Write a picture (H, W, 3) uint8 as PNG."""
    from PIL import Image

    write(path, lambda name: Image.fromarray(image).save(name, format="PNG"))
