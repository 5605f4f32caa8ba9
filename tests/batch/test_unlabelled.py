"""A folder of meshes without labels comes back labelled alike, ready to be learned from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

import partwright as pw
from partwright.batch import unlabelled
from partwright.batch.unlabelled import find_parts, meshes_of
from partwright.cli.main import main
from partwright.errors import CancelledError, FamilyError
from partwright.fitting import Result
from partwright.shapes.labels import read_labels


def stand(path: Path, wide: float) -> None:
    """A plate and a thick rod on it, in one closed surface."""
    plate = trimesh.creation.box((2 * wide, 1.4, 0.3))
    rod = trimesh.creation.box((0.4, 0.4, 1.5), trimesh.transformations.translation_matrix((0, 0, 0.8)))
    trimesh.boolean.union([plate, rod], engine="manifold").export(path)


def test_a_folder_comes_back_labelled(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, output = tmp_path / "in", tmp_path / "out"
    source.mkdir()
    for i in range(3):
        stand(source / f"stand_{i}.stl", 0.8 + 0.1 * i)
    command = ["parts", "match", str(source), "-o", str(output), "--at-once", "1"]
    assert main(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert len(said) == 3  # two parts, and where they are
    assert all(line.endswith("in 100% of 3 shapes") for line in said[:2])
    assert Image.open(output / "parts.png").width == 3 * 220
    names = {line.split(":")[0] for line in said[:2]}
    for i in range(3):
        mesh = trimesh.load(output / f"stand_{i}.ply", process=False)
        labels = read_labels(output / f"stand_{i}.ply.labels.json")
        assert set(labels) == names
        assert mesh.is_watertight
        high = mesh.triangles_center[:, 2] > 0.3
        assert len(set(labels[high])) == 1
        (upper,) = set(labels[high])
        assert np.average(labels[~high] != upper, weights=mesh.area_faces[~high]) > 0.9
    family = pw.datasets.prepare(output, tmp_path / "family", samples=1000, workers=1).family
    assert set(family.parts) == names
    assert main(["parts", "match", str(output), "-o", str(output)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_bad_folders_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(FamilyError, match="no such folder"):
        meshes_of(tmp_path / "nowhere")
    (tmp_path / "one.stl").write_bytes(b"")
    with pytest.raises(FamilyError, match="1 meshes; at least two"):
        meshes_of(tmp_path)
    (tmp_path / "one.ply").write_bytes(b"")
    with pytest.raises(FamilyError, match="two meshes are called 'one'"):
        meshes_of(tmp_path)
    (tmp_path / "one.ply").rename(tmp_path / "two.ply")
    assert main(["parts", "match", str(tmp_path), "-o", str(tmp_path / "out"), "--common", "2"]) == 2
    assert "--common is 2.0; expected a share" in capsys.readouterr().err
    assert main(["parts", "match", str(tmp_path), "-o", str(tmp_path / "out"), "--at-once", "1"]) == 2
    assert "0 shapes could be fitted; a family needs at least two; one: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("last", ["interrupted", None])
def test_stopped_fits_are_not_matched(last: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second shape whose fit was stopped on its way, or never begun."""
    nothing: Any = None
    whole, stopped = (Result(nothing, nothing, how, nothing, nothing, {}) for how in ("converged", str(last)))
    monkeypatch.setattr(unlabelled, "fit_many", lambda *_, **__: [whole, stopped if last else None])
    with pytest.raises(CancelledError, match="before all shapes were fitted"):
        find_parts(["a.ply", "b.ply"])
