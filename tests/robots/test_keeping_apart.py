"""Enclosing shapes of neighbours overlap no more than what they contain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, OpType

from partwright.assembly.similarity import rotation_matrix
from partwright.meshing.manifolds import as_manifold
from partwright.robots import CollideOptions, collide
from partwright.robots.containment import outside_of, shape_solid
from partwright.robots.enclosed_link import EnclosedLink
from partwright.robots.hull_joins import join_hulls
from partwright.robots.keeping_apart import keep_apart
from partwright.robots.model import Shape, frame
from partwright.robots.overlaps import LEAST_SHARED

FINE = 0.001
SLABS = [
    ((-0.1, -0.1, -0.1), (0.1, 2.1, 2.1)),
    ((5.9, -0.1, -0.1), (6.1, 2.1, 2.1)),
    ((-0.1, -0.1, -0.1), (6.1, 0.1, 2.1)),
    ((-0.1, 1.9, -0.1), (6.1, 2.1, 2.1)),
    ((-0.1, -0.1, -0.1), (6.1, 2.1, 0.1)),
    ((-0.1, -0.1, 1.9), (6.1, 2.1, 2.05)),
]


def enclosed(own: trimesh.Trimesh, hull: trimesh.Trimesh, pose: np.ndarray | None = None) -> EnclosedLink:
    """A link with one hull; both meshes in the world."""
    pose = np.eye(4) if pose is None else pose
    back = np.linalg.inv(pose)
    own, hull = own.copy().apply_transform(back), hull.copy().apply_transform(back)
    return EnclosedLink([Shape("hull", mesh=hull)], own.triangles, as_manifold(own), pose, FINE)


def box(*bounds: tuple[float, float, float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=bounds)


def shared(a: EnclosedLink, b: EnclosedLink) -> float:
    return sum(one.shares(other) for one in a.hulls for other in b.hulls)


def contained(link: EnclosedLink, own: trimesh.Trimesh, pose: np.ndarray | None = None) -> bool:
    """By the shapes as files have them, in the link's frame."""
    points, _ = trimesh.sample.sample_surface(own, 2000, seed=0)
    points = np.concatenate([points, own.vertices])
    points = trimesh.transform_points(points, np.linalg.inv(np.eye(4) if pose is None else pose))
    return bool((np.min([outside_of(shape, points) for shape in link.result()], axis=0) <= 0).all())


def without(solid: trimesh.Trimesh, *others: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.boolean.difference([solid, *others], engine="manifold")


@pytest.mark.parametrize("turn", [(1, 0, 0, 0), (0.8, 0.2, -0.4, 0.4)])
def test_hulls_that_reach_into_one_another_are_held_apart(turn: tuple[float, ...]) -> None:
    pose = frame(rotation_matrix(turn), (0.3, -2.0, 5.0))
    below, above = box((0, 0, 0), (1, 1, 1)), box((0, 0, 1.05), (1, 1, 2))
    low = enclosed(below, box((-0.1, -0.1, -0.1), (1.1, 1.1, 1.2)))
    high = enclosed(above, box((-0.1, -0.1, 0.9), (1.1, 1.1, 2.1)), pose)
    assert shared(low, high) > 0.3
    keep_apart({"low": low, "high": high}, {}, 1)
    assert shared(low, high) == 0
    assert contained(low, below)
    assert contained(high, above, pose)
    assert shape_solid(low.result()[0]).volume() == pytest.approx(1.2**2 * 1.12, rel=1e-3)


def test_what_overlaps_itself_still_overlaps_but_no_more() -> None:
    below, above = box((0, 0, 0), (1, 1, 1)), box((0, 0, 0.98), (1, 1, 2))
    low = enclosed(below, box((-0.1, -0.1, -0.1), (1.1, 1.1, 1.2)))
    high = enclosed(above, box((-0.1, -0.1, 0.9), (1.1, 1.1, 2.1)))
    keep_apart({"low": low, "high": high}, {("low", "high"): 0.02}, 8)
    assert shared(low, high) == pytest.approx(1.2**2 * 0.02, rel=1e-3)
    assert len(low.hulls) == len(high.hulls) == 1
    assert contained(low, below)
    assert contained(high, above)


def test_what_may_be_shared_is_left_alone() -> None:
    low = enclosed(box((0, 0, 0), (1, 1, 1)), box((0, 0, 0), (1, 1, 1.2)))
    high = enclosed(box((0, 0, 1.1), (1, 1, 2)), box((0, 0, 1), (1, 1, 2)))
    shapes = low.result()[0], high.result()[0]
    keep_apart({"low": low, "high": high}, {("low", "high"): 0.2}, 8)
    assert (low.result()[0], high.result()[0]) == shapes


def test_only_what_no_other_shape_contains_is_in_the_way() -> None:
    """A triangle across both hulls of a link keeps of each what is in it alone."""
    across = np.array([[[0, 0.5, 0.5], [2, 0.5, 0.5], [2, 0.6, 0.6]]])
    shapes = [Shape("", mesh=box((-1, 0, 0), (1, 1, 1))), Shape("", mesh=box((0.5, 0, 0), (3, 1, 1)))]
    link = EnclosedLink(shapes, across, Manifold(), np.eye(4), FINE)
    left, right = map(link.needed, link.hulls)
    assert left[..., 0].max() == pytest.approx(1)
    assert right[..., 0].min() == pytest.approx(0.5)
    twice = EnclosedLink([*shapes, shapes[1]], np.add(across, (0.6, 0, 0)), Manifold(), np.eye(4), FINE)
    assert [len(twice.needed(hull)) for hull in twice.hulls] == [0, 0, 0]


def test_the_inside_of_a_link_stays_in_its_hulls() -> None:
    """A block whose skin is in six slabs, its inside in one hull alone: that is not cut off though no
    triangle is in it, nor where it is split."""
    block, rod = box((0, 0, 0), (6, 2, 2)), box((2.5, 0.8, 2.1), (3.5, 1.2, 4))
    pad = box((-0.1, -0.1, -0.1), (6.1, 2.1, 2.4))
    skin = [box(low, high) for low, high in SLABS]
    shapes = [Shape(str(i), mesh=mesh) for i, mesh in enumerate([pad, *skin])]
    link = EnclosedLink(shapes, block.triangles, as_manifold(block), np.eye(4), FINE)
    other = enclosed(rod, box((2.4, 0.7, 1.9), (3.6, 1.3, 4.1)))
    keep_apart({"block": link, "rod": other}, {}, 12)
    assert shared(link, other) == 0
    assert contained(link, block)
    union = Manifold.batch_boolean([shape_solid(shape) for shape in link.result()], OpType.Add)
    assert (as_manifold(block) - union).volume() < 1e-6


@pytest.mark.parametrize(("most", "share"), [(1, 1.0), (3, 0.45), (24, LEAST_SHARED)])
def test_a_ring_around_a_shaft_is_split_as_far_as_that_takes_it_off_the_shaft(
    most: int, share: float
) -> None:
    """Halves of a ring fill its hole as much as it does; quarters are what helps first. Three are two of
    these and a half."""
    cylinder = trimesh.creation.cylinder
    shaft = cylinder(0.5, 1.2, sections=12)
    ring = trimesh.creation.annulus(0.7, 1, 1, sections=12)
    around, inside = enclosed(ring, cylinder(1.01, 1.02, sections=12)), enclosed(shaft, cylinder(0.51, 1.21))
    before = shared(around, inside)
    keep_apart({"ring": around, "shaft": inside}, {}, most)
    assert shared(around, inside) <= share * before
    assert len(around.hulls) <= most
    assert contained(around, ring)
    assert contained(inside, shaft)


def test_of_too_many_hulls_those_are_joined_that_overlap_others_least() -> None:
    """Four blocks in a row; a thin arm stands in the narrowest gap."""
    blocks = [box((x, 0, 0), (x + 1, 1, 1)) for x in (0, 1.1, 2.3, 3.6)]
    own = trimesh.util.concatenate(blocks)
    shapes = [Shape("", mesh=box(mesh.bounds[0] - 0.001, mesh.bounds[1] + 0.001)) for mesh in blocks]
    link = EnclosedLink(shapes, own.triangles, as_manifold(own), np.eye(4), FINE)
    arm = box((1.02, 0, 0), (1.08, 1, 3))
    other = enclosed(arm, arm)
    join_hulls(link, other.hulls, 3)
    assert sorted(hull.box[0, 0] for hull in link.hulls) == pytest.approx([-0.001, 1.099, 3.599])
    join_hulls(link, other.hulls, 2)
    assert shared(link, other) == 0
    assert contained(link, own)


def test_two_hulls_that_overlap_in_a_neighbour_are_not_joined_for_that() -> None:
    """Two of a link lie almost in one place, within the neighbour; two beside it have a narrow gap, where
    nothing is shared."""
    blocks = [box((x, y, 0), (x + 1, y + 1, 1)) for x, y in ((0, 0), (0.1, 0.1), (5, 0), (6.05, 0))]
    own = trimesh.util.concatenate(blocks)
    link = EnclosedLink([Shape("", mesh=mesh) for mesh in blocks], own.triangles, Manifold(), np.eye(4), FINE)
    around = box((-1, -1, -1), (2, 2, 2))
    join_hulls(link, enclosed(around, around).hulls, 3)
    assert sorted(hull.box[0, 0] for hull in link.hulls) == pytest.approx([0, 0.1, 5], abs=1e-5)


def test_few_shapes_are_cut_where_the_next_link_is(tmp_path: Path) -> None:
    """A block with two slots and four shapes: by volume alone the wide slot would have most of the cuts, and
    the hull of what is beside the narrow one would go through the arm that stands in it."""
    slots = [box((1, -1, 0.3), (2.5, 2, 2)), box((4, -1, 0.5), (4.6, 2, 2))]
    without(box((0, 0, 0), (6, 1, 1)), *slots).export(tmp_path / "block.stl")
    box((4.1, 0.1, 0.55), (4.5, 0.9, 2)).export(tmp_path / "arm.stl")
    mesh = '<collision><geometry><mesh filename="{0}.stl"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{mesh.format(name)}</link>' for name in ("block", "arm"))
    joint = '<joint name="turn" type="continuous"><parent link="block"/><child link="arm"/></joint>'
    (tmp_path / "robot.urdf").write_text(f'<robot name="slots">{links}{joint}</robot>')
    result = collide(tmp_path / "robot.urdf", CollideOptions(enclose=True, max_parts=4))
    assert result.pairs_after == {}
    assert [(link.count, link.sticking_out) for link in result.links] == [(4, 0), (1, 0)]
