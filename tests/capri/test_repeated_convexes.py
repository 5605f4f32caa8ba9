"""Alike convexes become copies of one: found in any order, by turns, moves and mirrors; the solid stays."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.approximation.named_convexes import with_named_convexes
from partwright.assembly import load_assembly
from partwright.assembly.motion import Motion
from partwright.assembly.similarity import Similarity
from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import Copy, CsgTree
from partwright.capri.motions import Face, axes_of, by_faces, moved
from partwright.capri.overlap import overlapped
from partwright.capri.repeated_convexes import _Search, with_repeated_convexes
from partwright.capri.repeated_quadrics import with_repeats
from partwright.capri.samples import OccupancySamples, draw_samples
from partwright.meshing import mesh_csg
from partwright.metrics.complexity import convexes, primitives
from partwright.shapes import load_shape

PRICES = 6e-4, 3e-3  # those of the settings
TEETH = 8


def slab(low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    """(6, 10) the planes of a box."""
    sides = [rows.plane(n, h) for n, h in zip(np.eye(3), high, strict=True)]
    return np.stack(sides + [rows.plane(-n, -v) for n, v in zip(np.eye(3), low, strict=True)])


def tree_of(*solids: np.ndarray) -> CsgTree:
    ends = np.cumsum([0, *map(len, solids)])
    layer = tuple(tuple(range(a, b)) for a, b in pairwise(ends))
    return CsgTree(np.concatenate(solids), np.zeros(ends[-1], dtype=bool), (layer,))


def samples_of(mesh: trimesh.Trimesh) -> OccupancySamples:
    """In the mesh's own coordinates, which are those of the tree."""
    shape = load_shape(mesh)
    found = draw_samples(shape, 12_000, 8_000, 0)
    points = shape.frame.from_unit(found.points).astype(np.float32)
    return OccupancySamples(points, found.inside, found.weight, found.near, found.uniform)


def turn(angle: float) -> Motion:
    return Motion(Similarity.turn((0, 0, 1), angle))


@pytest.fixture(scope="module")
def gear() -> tuple[CsgTree, OccupancySamples]:
    """A wheel whose teeth were found one by one, each a little off, and one of them not at all."""
    wheel = np.stack(
        [rows.cylinder((0, 0, 0), (0, 0, 1), 0.6), rows.plane((0, 0, 1), 0.2), rows.plane((0, 0, -1), 0.2)]
    )
    rng = np.random.default_rng(0)
    angles = 2 * np.pi * np.arange(TEETH) / TEETH
    teeth = []
    for angle in angles[:-1]:
        off = 0.004 * rng.uniform(-1, 1, 2)
        tooth = slab((0.4, -0.1 + off[0], -0.2), (0.9, 0.1 + off[1], 0.2))
        teeth.append(moved(turn(angle), tooth))
    blocks = [trimesh.creation.box(bounds=[(0.4, -0.1, -0.2), (0.9, 0.1, 0.2)]) for _ in angles]
    for block, angle in zip(blocks, angles, strict=True):
        block.apply_transform(trimesh.transformations.rotation_matrix(angle, (0, 0, 1)))
    solid = trimesh.creation.cylinder(0.6, 0.4, sections=128)
    return tree_of(wheel, *teeth), samples_of(trimesh.boolean.union([solid, *blocks]))


def test_teeth_are_one_convex_and_the_missing_one_is_put_in(gear: tuple[CsgTree, OccupancySamples]) -> None:
    tree, samples = gear
    found = with_repeated_convexes(tree, samples, *PRICES)
    assert [copy is None for copy in found.copies[0]].count(True) == 2
    assert found.convexes == 1 + TEETH
    wrong = samples.weight[found.occupancy(samples.points) != samples.inside].sum() / samples.volume
    before = samples.weight[tree.occupancy(samples.points) != samples.inside].sum() / samples.volume
    assert wrong < 0.2 * before


def test_nothing_is_a_copy_of_itself(gear: tuple[CsgTree, OccupancySamples]) -> None:
    tree, samples = gear
    search = _Search(tree, samples, *PRICES, lambda: None, further=True)
    search.gather(0)
    motions = [motion for group in search.layers[0] for motion in group.motions]
    assert len(motions) == TEETH - 1
    corners = np.eye(3)
    assert min(np.abs(motion(corners) - corners).max() for motion in motions) > 0.1


def test_without_further_ones_copies_are_where_convexes_were(
    gear: tuple[CsgTree, OccupancySamples],
) -> None:
    tree, samples = gear
    found = with_repeated_convexes(tree, samples, *PRICES, further=False)
    assert found.convexes == tree.convexes == TEETH
    assert sum(copy is None for copy in found.copies[0]) == 2


def test_copies_end_where_what_they_are_copies_of_ends() -> None:
    """A wedge that is open upwards and outwards, and its mirror image."""
    wedge = slab((0.3, -0.3, -0.1), (0.8, 0.4, 0.5))[[1, 3, 4, 5]]
    image = Motion(mirror=True)
    open_ = tree_of(wedge, moved(image, wedge))
    open_ = CsgTree(open_.rows, open_.complement, open_.layers, ((None, Copy(0, image)),))
    assert not np.isfinite(open_.assembly().bounds()).all()
    closed = open_.closed((-0.9, -0.4, -0.3), (0.9, 0.4, 0.5))
    assert closed.copies == open_.copies
    np.testing.assert_allclose(closed.assembly().bounds(), [(-0.9, -0.3, -0.1), (0.9, 0.4, 0.5)], atol=1e-9)
    first, copy = (closed.rows[list(convex)] for convex in closed.layers[0])
    np.testing.assert_allclose(copy, moved(image, first), atol=1e-12)
    assert len(closed.complement) == len(closed.rows)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_holes_that_are_copies_join_all_that_are_alike(angle: float) -> None:
    """Turned about an axis of their own direction they are one leaf with a hole that is no copy."""
    hole = rows.cylinder((0.5, 0.1, 0), (0, 0, 1), 0.1)[None]
    motion = (
        Motion(Similarity.turn((0, 0, 1), angle)) if angle else Motion(Similarity(translation=(0, 0.2, 0)))
    )
    another = rows.cylinder((-0.5, 0.1, 0), (0, 0, 1), 0.1)[None]
    block = slab((-0.9, -0.9, -0.3), (0.9, 0.9, 0.3))
    table = np.concatenate([block, hole, moved(motion, hole), another])
    layers = (tuple(range(6)),), ((6,), (7,), (8,))
    copies = (None,), (None, Copy(0, motion), None)
    tree = CsgTree(table, np.zeros(len(table), dtype=bool), layers, copies)
    whole = with_repeats(tree.assembly())
    assert primitives(whole) == 6 + 1
    assert [len(part.copies) for part in whole.parts][-1] == 3


def test_the_assembly_says_them_once_and_is_the_tree(gear: tuple[CsgTree, OccupancySamples]) -> None:
    tree, samples = gear
    found = overlapped(with_repeated_convexes(tree, samples, *PRICES), samples)
    whole = found.assembly()
    assert (convexes(whole), convexes(whole, groups_once=True)) == (1 + TEETH, 2)
    assert (primitives(whole), primitives(whole, groups_once=True)) == (3 + 6 * TEETH, 9)
    distance = whole.distance(samples.points)
    sure = np.abs(distance) > 1e-4
    np.testing.assert_array_equal((distance < 0)[sure], found.occupancy(samples.points)[sure])
    mesh = mesh_csg(whole)
    assert mesh.is_watertight
    assert mesh.body_count == 1


def test_the_file_keeps_them_as_copies(gear: tuple[CsgTree, OccupancySamples], tmp_path: Path) -> None:
    tree, samples = gear
    whole = with_repeated_convexes(tree, samples, *PRICES).assembly()
    whole.save(tmp_path / "gear.json")
    again = load_assembly(tmp_path / "gear.json")
    assert convexes(again, groups_once=True) == 2
    np.testing.assert_allclose(again.distance(samples.points), whole.distance(samples.points), atol=1e-6)


def test_named_copies_are_places_of_one_part(gear: tuple[CsgTree, OccupancySamples]) -> None:
    tree, samples = gear
    whole = with_repeated_convexes(tree, samples, *PRICES).assembly()
    named = with_named_convexes(whole)
    assert [(part.field.kind, len(part.copies)) for part in named.parts] == [("cylinder", 1), ("box", TEETH)]
    assert mesh_csg(named).volume == pytest.approx(mesh_csg(whole).volume, rel=3e-3)


def test_mirror_images_count_once() -> None:
    """Two wedges, the one the other's image, neither of which is its own image in any plane."""
    base = slab((-0.9, -0.4, -0.3), (0.9, 0.4, 0.0))
    wedge = np.concatenate([slab((0.3, -0.3, -0.1), (0.8, 0.4, 0.5)), [rows.plane((0.6, 0.64, 0.48), 0.6)]])
    image = moved(Motion(mirror=True), wedge)
    tree = tree_of(base, wedge, image)
    found = with_repeated_convexes(tree, samples_of(mesh_csg(tree.assembly())), *PRICES)
    copies = [copy for copy in found.copies[0] if copy is not None]
    assert [copy.motion.mirror for copy in copies] == [True]
    whole = found.assembly()
    assert convexes(whole, groups_once=True) == 2
    assert mesh_csg(whole).volume == pytest.approx(mesh_csg(tree.assembly()).volume, rel=1e-6)


def test_what_is_not_alike_stays_as_it_is() -> None:
    solids = [slab((-0.9, -0.4, -0.3), (0.9, 0.4, 0.0)), slab((-0.7, -0.3, -0.1), (-0.2, 0.3, 0.6))]
    solids.append(slab((0.3, -0.1, -0.1), (0.5, 0.2, 0.4)))
    tree = tree_of(*solids)
    found = with_repeated_convexes(tree, samples_of(mesh_csg(tree.assembly())), *PRICES)
    assert set(found.copies[0]) == {None}
    assert found.convexes == 3


@pytest.mark.parametrize("mirror", [False, True])
def test_faces_tell_the_motion(mirror: bool) -> None:
    """Of a convex that only one motion takes to where it is, turned about an axis of the part."""
    sides = [slab((-0.2, -0.3, -0.4), (0.5, 0.3, 0.6)), [rows.plane((0.6, 0.0, 0.8), 0.5)]]
    convex = np.concatenate([*sides, [rows.cylinder((0.1, 0, 0), (0, 0, 1), 0.35)]])
    motion = Motion(Similarity.turn((0, 0, 1), 0.7, (0.2, -0.1, 0)), mirror)
    one, other = ([Face.of(row) for row in table] for table in (convex, moved(motion, convex)))
    found = by_faces(one, other, axes_of(convex), 20)
    points = np.random.default_rng(0).uniform(-1, 1, (20, 3))
    off = [np.abs(candidate(points) - motion(points)).max() for candidate in found]
    assert min(off) < 1e-6


def perforated() -> tuple[CsgTree, OccupancySamples]:
    """A plate, a third of its 24 holes, and its one slot."""
    low, high = (0.77, -0.06, -0.2), (0.81, 0.06, 0.2)
    places = [(x, y) for x in np.linspace(-0.7, 0.5, 6) for y in np.linspace(-0.5, 0.5, 4)]
    cuts = [trimesh.creation.cylinder(0.036, 0.3, sections=48) for _ in places]
    for cut, place in zip(cuts, places, strict=True):
        cut.apply_translation((*place, 0))
    cuts.append(trimesh.creation.box(bounds=(low, high)))
    block = trimesh.creation.box(bounds=[(-0.9, -0.7, -0.06), (0.9, 0.7, 0.06)])
    found = [places[i] for i in (0, 1, 5, 10, 11, 14, 17, 23)]
    holes = [rows.cylinder((x, y, 0), (0, 0, 1), 0.036) for x, y in found]
    table = np.stack([*slab(*block.bounds), *holes, *slab(low, high)])
    alone = range(6, 6 + len(holes))
    layers = (tuple(range(6)),), (*((k,) for k in alone), tuple(range(6 + len(holes), len(table))))
    tree = CsgTree(table, np.zeros(len(table), dtype=bool), layers)
    return tree, samples_of(trimesh.boolean.difference([block, *cuts]))


def test_holes_that_pay_only_together_stay_with_their_copies() -> None:
    tree, samples = perforated()

    def error(*layers: tuple[tuple[int, ...], ...]) -> float:
        occupied = CsgTree(tree.rows, tree.complement, layers).occupancy(samples.points)
        return float(samples.weight[occupied != samples.inside].sum()) / samples.volume

    plate, cuts = tree.layers
    for cut in cuts:
        assert error(plate) - error(plate, (cut,)) < len(cut) * PRICES[0] + PRICES[1]
    found = with_repeated_convexes(tree, samples, *PRICES, own=(1, 0))
    assert [copy is None for copy in found.copies[1]].count(True) == 1
    assert len(found.layers[1]) == 24
    wrong = samples.weight[found.occupancy(samples.points) != samples.inside].sum() / samples.volume
    assert wrong < 0.2 * error(*tree.layers)


def test_what_is_offered_and_pays_nothing_goes() -> None:
    tree, samples = perforated()
    few = CsgTree(tree.rows, tree.complement, (tree.layers[0], tree.layers[1][-1:]))
    found = with_repeated_convexes(few, samples, *PRICES, own=(1, 0))
    assert found.layers == (tree.layers[0], ())
    assert with_repeated_convexes(few, samples, *PRICES, own=(1, 1)).layers == few.layers
