"""Visual meshes that are skins without thickness, open where the next link begins: what they go around is
theirs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from partwright.robots import CollideOptions, collide, solids
from partwright.robots.model import Link, MeshUse
from partwright.robots.report import warnings
from partwright.robots.wrapping import wrapped
from partwright.shapes import repair
from tests.robots.robots import urdf

RADIUS, HEIGHT = 0.2, 1.0
TUBE = np.pi * RADIUS**2 * HEIGHT


def tube(open_ends: int) -> trimesh.Trimesh:
    """The skin of a cylinder of 96 sides without its upper or both of its discs."""
    rod = trimesh.creation.cylinder(RADIUS, HEIGHT, sections=96)
    lids = rod.face_normals[:, 2] > 0.5
    if open_ends == 2:
        lids |= rod.face_normals[:, 2] < -0.5
    rod.update_faces(~lids)
    return rod


@pytest.mark.parametrize(("open_ends", "turned"), [(1, False), (2, True)])
def test_an_open_tube_bounds_what_it_goes_around(open_ends: int, turned: bool) -> None:
    """Up to where its lids were: seen from there, the missing one fills half of all directions."""
    skin = tube(open_ends)
    if turned:
        skin.invert()
    inner, whole = wrapped(skin.vertices, skin.faces)
    assert inner.volume() == pytest.approx(TUBE, rel=0.02)
    thick = 1.2 / 96
    assert inner.volume() < whole.volume() < np.pi * (RADIUS + 2 * thick) ** 2 * (HEIGHT + 4 * thick)


def test_a_sheet_bounds_what_wraps_it() -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    inner, whole = wrapped(sheet.vertices, sheet.faces)
    assert inner is whole
    assert whole.volume() == pytest.approx(2 * 1.2 / 96, rel=0.3)


def test_a_bent_sheet_is_enclosed_without_the_thickness_of_what_wraps_it(tmp_path: Path) -> None:
    """An eighth of a tube's wall: the wrap that its pieces are cut from stands off it on both sides."""
    path = urdf(tmp_path, arm="meshes/ell.stl")
    wall = tube(2)
    around = np.arctan2(*wall.triangles_center[:, 1::-1].T)
    sheet = wall.submesh([np.abs(around) < np.pi / 8], append=True)
    sheet.export(tmp_path / "meshes" / "seen.stl")
    options = CollideOptions(enclose=True, max_parts=1, kinds=("hull",))
    found = collide(path, options)
    (base,) = (one for one in found.links if one.link == "base")
    assert base.sticking_out == 0
    assert not [told for told in warnings(found.links) if "'base'" in told]
    (shape,) = found.shapes["base"]
    assert shape.mesh is not None
    assert shape.mesh.volume == pytest.approx(sheet.convex_hull.volume, rel=0.05)


def test_open_skins_are_not_sealed_before_they_are_wrapped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That takes seconds, and a wrap is made all the same."""

    def seal(*_: object) -> None:
        raise AssertionError("a skin was sealed")

    monkeypatch.setattr(repair, "seal", seal)
    path = tmp_path / "skin.stl"
    trimesh.creation.icosphere(3, 0.5).slice_plane([0, 0, 0], [0, 0, 1]).export(path)
    target = solids.Solids().target(Link("skin", np.eye(4), (), ()), [MeshUse(path, np.eye(4))])
    assert len(target.notes) == 1


def test_the_same_skin_in_the_same_place_is_wrapped_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Signs of zeros, as turns leave them, made it another."""
    path = tmp_path / "skin.stl"
    skin = tube(2)
    skin.submesh([skin.triangles_center[:, 0] < 0], append=True).export(path)
    made: list[int] = []

    def counted(vertices: np.ndarray, faces: np.ndarray) -> tuple[Manifold, Manifold]:
        made.append(len(faces))
        return wrapped(vertices, faces)

    monkeypatch.setattr(solids, "wrapped", counted)
    both, link = solids.Solids(), Link("skin", np.eye(4), (), ())
    for sheets, zero in ((False, 0.0), (True, -0.0)):
        matrix = np.where(np.eye(4) == 0, zero, np.eye(4))
        both.target(link, [MeshUse(path, matrix)], sheets)
    assert len(made) == 1


def test_an_open_skin_is_enclosed_by_one_shape_around_it(tmp_path: Path) -> None:
    """Not by pieces that follow its wall, and two halves of it are wrapped as one."""
    path = urdf(tmp_path, arm="meshes/ell.stl")
    skin = tube(2)
    left = skin.triangles_center[:, 0] < 0
    for name, half in (("seen.stl", left), ("rod.stl", ~left)):
        skin.submesh([half], append=True).export(tmp_path / "meshes" / name)
    other = '</visual><visual><geometry><mesh filename="meshes/rod.stl"/></geometry></visual>'
    path.write_text(path.read_text().replace("</visual>", other, 1))
    base = next(one for one in collide(path, CollideOptions(enclose=True)).links if one.link == "base")
    assert base.sticking_out == 0
    assert base.count == 1
    assert base.extra < 0.25
    assert base.deviation < 0.05
    assert len(base.notes) == 2


def test_sheets_that_face_inwards_bound_nothing_beyond_them() -> None:
    """Behind two of them, one upon the other, all space is as much inside as in a closed skin."""
    corners = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], float)
    turned_in = [[0, 2, 1], [0, 3, 2]]  # normals along -x
    sheets = [trimesh.Trimesh(corners + np.array([1 + 0.02 * i, -0.5, -0.5]), turned_in) for i in range(2)]
    whole = trimesh.util.concatenate([tube(1), *sheets])
    inner, around = wrapped(whole.vertices, whole.faces)
    lower, upper = np.reshape(around.bounding_box(), (2, 3))
    thick = 1.3 * 1.5 / 96
    assert (lower >= whole.bounds[0] - 2 * thick).all()
    assert (upper <= whole.bounds[1] + 2 * thick).all()
    assert inner.volume() == pytest.approx(TUBE, rel=0.25)
