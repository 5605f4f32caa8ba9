"""Links that processes of their own shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.meshing.manifolds import surface_of
from partwright.robots import CollideOptions, collide, link_processes
from partwright.robots.containment import shape_solid
from tests.robots.robots import urdf


@pytest.mark.parametrize(
    "options",
    [
        CollideOptions(),
        pytest.param(CollideOptions(enclose=True, max_parts=3), marks=pytest.mark.heavy),
    ],
)
def test_shapes_are_the_same_by_several_processes(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    options: CollideOptions,
) -> None:
    """Hulls and native solids, of a mesh that is closed and of one that is wrapped."""
    path = urdf(tmp_path)
    seen = trimesh.creation.icosphere(radius=0.3)
    seen.update_faces(seen.triangles_center[:, 2] < 0.2)
    seen.export(tmp_path / "meshes" / "seen.stl")
    here = collide(path, options)

    def never(*rest: object) -> None:
        raise AssertionError("it was shaped in this process")

    monkeypatch.setattr(link_processes, "shapes_for", never)  # of this process alone
    with pytest.raises(AssertionError, match="in this process"):
        collide(path, options, workers=2)  # two small links: a process would only begin when all is done
    monkeypatch.setattr(link_processes, "_WORTH", 0)
    said: list[str] = []
    there = collide(path, options, told=said.append, workers=2)
    assert [line.split(":")[0] for line in said][:2] == ["base", "arm"]
    for name, shapes in here.shapes.items():
        assert [shape.name for shape in shapes] == [shape.name for shape in there.shapes[name]]
        for one, other in zip(shapes, there.shapes[name], strict=True):
            assert one.kind == other.kind
            for mine, theirs in zip(*(surface_of(shape_solid(shape)) for shape in (one, other)), strict=True):
                assert np.array_equal(mine, theirs)
    assert capfd.readouterr().err == ""  # as of solids that a process leaves at its end
