"""Links that processes of their own shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from partwright.robots import CollideOptions, collide, side_by_side
from tests.robots.robots import urdf


def test_shapes_are_the_same_by_several_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    path, options = urdf(tmp_path), CollideOptions(kinds=("hull",))
    here = collide(path, options)

    def never(*rest: object) -> None:
        raise AssertionError("it was shaped in this process")

    monkeypatch.setattr(side_by_side, "shapes_for", never)  # of this process alone
    with pytest.raises(AssertionError, match="in this process"):
        collide(path, options, workers=2)  # two small links: a process would only begin when all is done
    monkeypatch.setattr(side_by_side, "_WORTH", 0)
    said: list[str] = []
    there = collide(path, options, told=said.append, workers=2)
    assert said == ["base: 2 shapes", "arm: 1 shape"]
    for name, shapes in here.shapes.items():
        for one, other in zip(shapes, there.shapes[name], strict=True):
            assert one.name == other.name
            assert np.array_equal(one.mesh.vertices, other.mesh.vertices)
            assert np.array_equal(one.mesh.faces, other.mesh.faces)
    assert capfd.readouterr().err == ""  # as of solids that a process leaves at its end
