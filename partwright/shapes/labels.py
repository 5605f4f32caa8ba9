"""Face labels as they come in files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import UnreadableFileError
from partwright.input_files import check_file


def read_labels(path: str | Path) -> NDArray[Any]:
    """Labels (F,), integers or strings, of a .json, .npy or text file.

    JSON is an array, or an object with `labels` and perhaps `names` as `partwright segment` writes it; text
    has a label a line.

    Raises:
        UnreadableFileError: the file is missing, or holds no labels.
    """
    path = Path(path)
    check_file(path)
    try:
        labels = _read(path)
    except (OSError, ValueError, IndexError, KeyError, TypeError, EOFError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise UnreadableFileError(
            f"{path}: cannot be read as face labels ({reason}); expected a JSON array, an NPY array, or text "
            "with one label a line"
        ) from error
    if labels.ndim != 1 or labels.dtype.kind not in "iuU":
        raise UnreadableFileError(
            f"{path}: holds {labels.dtype} of shape {labels.shape}; expected one integer or string a face"
        )
    return labels


def labels_path(path: str | Path) -> Path:
    """FILE.labels.json beside FILE."""
    return Path(path).with_name(Path(path).name + ".labels.json")


def _read(path: Path) -> NDArray[Any]:
    suffix = path.suffix.lower()
    if suffix == ".npy":
        return np.load(path, allow_pickle=False)
    if suffix != ".json":
        return np.array(path.read_text("utf-8").splitlines())
    data = json.loads(path.read_text("utf-8"))
    if not isinstance(data, dict):
        return np.array(data)
    labels = np.array(data["labels"])
    if "names" not in data:
        return labels
    if labels.size and labels.min() < 0:
        raise ValueError("negative labels have no name")
    return np.array(data["names"], dtype=str)[labels]
