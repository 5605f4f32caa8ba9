"""Enclosing shapes of neighbours overlap no more than what they contain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly.similarity import rotation_matrix
from partwright.robots import CollideOptions, collide
from partwright.robots.containment import outside_of, shape_solid
from partwright.robots.keeping_apart import EnclosedLink, keep_apart
from partwright.robots.model import Shape, frame


def enclosed(own: trimesh.Trimesh, hull: trimesh.Trimesh, pose: np.ndarray) -> EnclosedLink:
    """A link with one hull; both meshes in the world."""
    hull.apply_transform(np.linalg.inv(pose))
    return EnclosedLink([Shape("hull", mesh=hull)], own.apply_transform(np.linalg.inv(pose)).triangles, pose)


def box(*bounds: tuple[float, float, float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=bounds)


def shared(a: EnclosedLink, b: EnclosedLink) -> float:
    one, other = (shape_solid(link.result()[0]).transform(link.pose[:3]) for link in (a, b))
    return float((one ^ other).volume())


def contained(link: EnclosedLink) -> bool:
    return bool((outside_of(link.result()[0], link.triangles.reshape(-1, 3)) <= 0).all())


@pytest.mark.parametrize("turn", [(1, 0, 0, 0), (0.8, 0.2, -0.4, 0.4)])
def test_hulls_that_reach_into_one_another_are_held_apart(turn: tuple[float, ...]) -> None:
    pose = frame(rotation_matrix(turn), (0.3, -2.0, 5.0))
    low = enclosed(box((0, 0, 0), (1, 1, 1)), box((-0.1, -0.1, -0.1), (1.1, 1.1, 1.2)), np.eye(4))
    high = enclosed(box((0, 0, 1.05), (1, 1, 2)), box((-0.1, -0.1, 0.9), (1.1, 1.1, 2.1)), pose)
    assert shared(low, high) > 0.3
    keep_apart(low, high)
    assert shared(low, high) == 0
    assert contained(low)
    assert contained(high)
    assert shape_solid(low.result()[0]).volume() == pytest.approx(1.2**2 * 1.12, rel=1e-3)


def test_what_overlaps_itself_still_overlaps_but_no_more() -> None:
    low = enclosed(box((0, 0, 0), (1, 1, 1)), box((-0.1, -0.1, -0.1), (1.1, 1.1, 1.2)), np.eye(4))
    high = enclosed(box((0, 0, 0.98), (1, 1, 2)), box((-0.1, -0.1, 0.9), (1.1, 1.1, 2.1)), np.eye(4))
    keep_apart(low, high)
    assert shared(low, high) == pytest.approx(1.2**2 * 0.02, rel=1e-3)
    assert contained(low)
    assert contained(high)


def test_only_what_no_other_shape_contains_is_in_the_way() -> None:
    """A triangle across both hulls of a link keeps of each what is in it alone."""
    across = np.array([[[0, 0.5, 0.5], [2, 0.5, 0.5], [2, 0.6, 0.6]]])
    shapes = [Shape("", mesh=box((-1, 0, 0), (1, 1, 1))), Shape("", mesh=box((0.5, 0, 0), (3, 1, 1)))]
    link = EnclosedLink(shapes, across, np.eye(4))
    assert link.needed(0)[:, 0].max() == pytest.approx(1)
    assert link.needed(1)[:, 0].min() == pytest.approx(0.5)
    assert not len(EnclosedLink([*shapes, shapes[1]], np.add(across, (0.6, 0, 0)), np.eye(4)).needed(1))


def test_few_shapes_are_cut_where_the_next_link_is(tmp_path: Path) -> None:
    """A block with two slots and four shapes: by volume alone the wide slot would have most of the cuts, and
    the hull of what is beside the narrow one would go through the arm that stands in it."""
    slots = [box((1, -1, 0.3), (2.5, 2, 2)), box((4, -1, 0.5), (4.6, 2, 2))]
    block = trimesh.boolean.difference([box((0, 0, 0), (6, 1, 1)), *slots], engine="manifold")
    block.export(tmp_path / "block.stl")
    box((4.1, 0.1, 0.55), (4.5, 0.9, 2)).export(tmp_path / "arm.stl")
    mesh = '<collision><geometry><mesh filename="{0}.stl"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{mesh.format(name)}</link>' for name in ("block", "arm"))
    joint = '<joint name="turn" type="continuous"><parent link="block"/><child link="arm"/></joint>'
    (tmp_path / "robot.urdf").write_text(f'<robot name="slots">{links}{joint}</robot>')
    result = collide(tmp_path / "robot.urdf", CollideOptions(enclose=True, max_parts=4))
    assert result.pairs_after == {}
    assert [(link.count, link.sticking_out) for link in result.links] == [(4, 0), (1, 0)]
