"""Method "solids": kinds, subtraction, and the tree that comes of it."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.rows import rows as rows_of
from partwright.errors import SettingError
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    HollowBox,
    HollowFrustum,
    Sphere,
    Torus,
    Tube,
    kernel,
)
from partwright.fields.columns import WIDTH, Column
from partwright.methods import FitRequest, Fitted, Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import flat_tree
from partwright.superfrusta.flat_tree import Meetings, flattened, nested
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.samples import NOTHING, FitSamples
from partwright.superfrusta.simplification import extend_cuts
from partwright.superfrusta.solid_kinds import is_solid, kind_freedom, round_parts, solid
from partwright.superfrusta.solids import Settings
from tests.superfrusta.rows import row, subtracting

DRAFT = Settings.for_quality("draft")


def fit(shape: Shape, settings: Settings, **given: Any) -> Fitted:
    return FitRequest(shape, settings, Run(threads=1), **given).fitted()


SOLIDS: list[tuple[Field, int]] = [  # and the number of its own parameters, sx = sy counted once
    (Box((0.5, 0.25, 0.75)), 3),
    (Cylinder(0.25, 0.5), 2),
    (Cone(0.5, 0.75), 2),
    (Frustum(0.5, 0.25, 0.75), 3),
    (Sphere(0.5), 1),
    (Capsule(0.25, 0.5), 2),
    (Tube(0.5, 0.125, 0.75), 3),
    (Torus(0.5, 0.125), 2),
    (HollowBox((0.5, 0.75, 1.0), 0.125), 4),
    (HollowFrustum(0.5, 0.25, 0.125, 0.75), 4),
]


def signed_rows(*parts: Part) -> np.ndarray:
    return subtracting(rows_of(parts))


@pytest.mark.parametrize(("field", "count"), SOLIDS)
def test_a_row_says_what_kind_it_is(field: Field, count: int) -> None:
    one = signed_rows(Part(field))
    assert is_solid(one[0])
    assert solid(one[0]) == field
    free = kind_freedom(one)[0]
    assert free[:6].all()
    own = int(free[6:].sum()) - int(round_parts(one)[0])
    assert own == count
    assert not is_solid(row(roundness=0.4))
    assert not is_solid(row(bulge=0.2))


def plate() -> trimesh.Trimesh:
    """A plate with two pairs of holes, made by another program."""
    block = trimesh.creation.box((1.8, 1.2, 0.2))
    places = [(-0.6, -0.3, 0.1), (0.6, -0.3, 0.1), (-0.6, 0.3, 0.1), (0.6, 0.3, 0.1)]
    holes = [trimesh.creation.cylinder(radius=r, height=1, sections=64) for *_, r in places]
    for hole, (x, y, _) in zip(holes, places, strict=True):
        hole.apply_translation((x, y, 0))
    return trimesh.boolean.difference([block, *holes])


def test_a_plate_with_holes_is_a_box_minus_cylinders() -> None:
    fitted = fit(load_shape(plate()), DRAFT)
    tree = fitted.assembly
    assert tree.operation == "difference"
    block, *cuts = tree.parts
    assert isinstance(block.field, Box)
    np.testing.assert_allclose(sorted(block.field.size), (0.2, 1.2, 1.8), atol=0.01)
    assert all(isinstance(cut.field, Cylinder) for cut in cuts)
    copies = [copy for cut in cuts for copy in cut.copies]
    places = sorted((round(abs(c.translation[0]), 1), round(abs(c.translation[1]), 1)) for c in copies)
    assert places == [(0.6, 0.3)] * 4
    for cut in cuts:
        assert isinstance(cut.field, Cylinder)
        assert cut.field.radius == pytest.approx(0.1, abs=0.01)
        assert cut.field.height > 0.22  # goes beyond both faces
    volume = pw.meshing.mesh_assembly(tree).volume
    assert volume == pytest.approx(plate().volume, rel=0.01)


def test_without_subtraction_every_part_is_added() -> None:
    settings = dataclasses.replace(DRAFT, subtract=False, rounds=1)
    tree = fit(load_shape(plate()), settings).assembly
    assert tree.operation == "union"
    assert all(isinstance(child, Part) for child in tree.children)


def test_a_fit_of_solids_goes_on_from_its_own_tree_and_keeps_what_is_locked() -> None:
    shape = load_shape(plate())
    holes = [Part(Cylinder(0.1, 0.4), (x, 0.3, 0), name=f"hole_{i}") for i, x in enumerate((-0.6, 0.6))]
    start = Assembly((Part(Box((1.8, 1.2, 0.2)), name="plate"), *holes), operation="difference")
    fitted = fit(shape, dataclasses.replace(DRAFT, symmetry=False), start=start, locked=("plate",))
    locked = fitted.assembly["plate"].field
    assert isinstance(locked, Box)
    np.testing.assert_allclose(locked.size, (1.8, 1.2, 0.2), rtol=1e-6)
    assert len(fitted.assembly) == 5
    assert fitted.assembly.operation == "difference"
    with pytest.raises(SettingError, match="--no-subtract"):
        fit(shape, dataclasses.replace(DRAFT, subtract=False), start=start)


def test_settings_of_solids_stay_solids() -> None:
    for quality in ("draft", "normal", "high"):
        settings = Settings.for_quality(quality)
        assert (settings.family, settings.smooth, settings.subtract) == ("solid", False, True)
    with pytest.raises(SettingError, match="do not blend"):
        Settings(smooth=True)
    with pytest.raises(SettingError, match="unknown settings: colour"):
        Settings.for_quality("draft", colour=1)


@pytest.mark.parametrize("kind", ["cylinder", "sphere", "torus", "tube"])
def test_the_kind_of_a_single_solid_is_found(kind: str) -> None:
    made = {
        "cylinder": (trimesh.creation.cylinder(0.5, 1.8, sections=96), Cylinder),
        "sphere": (trimesh.creation.icosphere(4, 0.9), Sphere),
        "torus": (trimesh.creation.torus(0.6, 0.3, 96, 48), Torus),
        "tube": (trimesh.creation.annulus(0.4, 0.9, 1.0, sections=96), Tube),
    }
    mesh, wanted = made[kind]
    settings = dataclasses.replace(DRAFT, rounds=1, cycles=0, subtract=False)
    parts = fit(load_shape(mesh), settings).assembly.parts
    assert [type(part.field) for part in parts] == [wanted]


PIN, BLOCK, FAR = Part(Box((0.1, 0.1, 1))), Part(Box((1, 1, 1))), Part(Box((1, 1, 1)), (3, 0, 0))
HOLE, OTHER = Part(Cylinder(0.3, 2)), Part(Cylinder(0.2, 2), (3, 0, 0))


def test_what_is_subtracted_belongs_to_what_it_cuts() -> None:
    tree = nested((BLOCK, FAR, HOLE, OTHER), (True, True, False, False), plain=True)
    assert tree.operation == "union"
    assert [child.operation for child in tree.children if isinstance(child, Assembly)] == ["difference"] * 2
    assert [[p.translation[0] for p in child.parts] for child in tree.children] == [[0, 0], [3, 3]]  # type: ignore[union-attr]


def test_a_pin_in_a_hole_is_a_nested_union() -> None:
    tree = nested((BLOCK, HOLE, PIN), (True, False, True), plain=True)
    (carved, pin) = tree.children
    assert isinstance(carved, Assembly)
    assert carved.operation == "difference"
    assert isinstance(pin, Part)


def test_parts_that_come_again_are_not_asked_again_whether_they_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    parts, added, known = (BLOCK, FAR, HOLE, OTHER), (True, True, False, False), Meetings()
    first = nested(parts, added, True, known)
    monkeypatch.setattr(flat_tree, "_meet", None)
    assert nested(parts, added, True, known) == first
    renamed = [dataclasses.replace(part, name=f"part_{k}") for k, part in enumerate(parts)]
    assert [part.name for part in nested(renamed, added, True, known).parts] == [
        "part_0", "part_2", "part_1", "part_3",
    ]  # fmt: skip


@pytest.mark.parametrize("plain", [True, False])
def test_the_tree_is_the_fold_and_comes_back_as_it(plain: bool) -> None:
    generator = np.random.default_rng(1)
    points = generator.uniform(-1, 1, (4000, 3)).astype(np.float32)
    for seed in range(5):
        drawn = np.random.default_rng(seed)
        added = [True, True, *(drawn.random(6) < 0.5).tolist()]
        parts = [
            Part(Box(tuple(drawn.uniform(0.2, 0.9, 3))), tuple(drawn.uniform(-0.6, 0.6, 3))) for _ in added
        ]
        fold = subtracting(rows_of(parts), *np.flatnonzero(~np.array(added)).tolist())
        expected = kernel.evaluate(fold, points) < 0
        tree = nested(parts, added, plain)
        assert ((tree.distance(points) < 0) != expected).mean() < 1e-3
        leaves = flattened(tree)
        again = subtracting(
            rows_of([part for part, _ in leaves]), *[i for i, (_, plus) in enumerate(leaves) if not plus]
        )
        if not plain:
            np.testing.assert_array_equal(kernel.evaluate(again, points) < 0, expected)


def test_a_start_with_an_intersection_is_refused() -> None:
    with pytest.raises(SettingError, match="intersection"):
        flattened(Assembly((BLOCK, HOLE), operation="intersection"))
    with pytest.raises(SettingError, match="only unions"):
        flattened(BLOCK - (HOLE - PIN))


def test_repeated_holes_are_subtracted_with_all_their_copies() -> None:
    turn = Similarity(rotation=(0, 0, 0, 1))
    hole = Part(Cylinder(0.1, 2), (0.3, 0, 0), instances=(turn,))
    tree = nested((BLOCK, hole), (True, False), plain=True)
    inside = tree.distance(np.array([[0.3, 0, 0], [-0.3, 0, 0], [0, 0.3, 0]]))
    assert (np.sign(inside) == (1, 1, -1)).all()


def test_thin_cuts_far_apart_are_not_lost() -> None:
    """A rebate along either side: between the two, no more than a hundredth of the way is in one."""
    rebate = Part(Box((0.02, 2, 0.2)), (0.5, 0, 0.4), instances=(Similarity(rotation=(0, 0, 0, 1)),))
    tree = nested((Part(Box((1, 1, 1))), rebate), (True, False), plain=True)
    assert tree.operation == "difference"
    assert (
        np.sign(tree.distance(np.array([[0.495, 0, 0.4], [-0.495, 0, 0.4], [0, 0, 0.4]]))) == (1, 1, -1)
    ).all()


def test_cuts_end_a_little_beyond_the_solid_in_the_open_and_nowhere_else() -> None:
    mesh = plate()
    samples = FitSamples.of(load_shape(mesh), DRAFT)
    block = row(size=(1.8, 1.2, 0.2), blend=0)
    cuts = [
        row((x, y, 0.1 * y), size=(0.2, 0.2, 0.3), roundness=1, blend=0)
        for x in (-0.6, 0.6)
        for y in (-0.3, 0.3)
    ]
    blind = row((0, 0, 0.1), size=(0.1, 0.1, 0.1), roundness=1, blend=0)
    rows = subtracting(np.stack([block, *cuts, blind]), 1, 2, 3, 4, 5)
    longer = extend_cuts(samples, rows)
    np.testing.assert_allclose(longer[1:5, 9], 0.26, atol=1e-4)  # 0.03 on both sides, though they lay askew
    np.testing.assert_allclose(longer[1:5, 2], 0, atol=1e-4)
    np.testing.assert_allclose(longer[5, [2, 9]], (0.09, 0.08), atol=1e-4)  # from 0.05, upwards only


def test_a_cut_is_fitted_to_what_is_covered_too_much() -> None:
    samples = FitSamples.of(load_shape(plate()), DRAFT)
    rows = row(size=(1.8, 1.2, 0.2), blend=0)[None]
    over = np.maximum(samples.grid_field(rows), -samples.grid.values) < 0
    corner = (samples.grid_points[:, 0] > 0) & (samples.grid_points[:, 1] > 0)
    region = Region(over.ravel() & corner, rows, 0.1, 0.2, 0.15, sign=-1.0)
    (cut,) = fit_regions(samples, [region], DRAFT)
    assert cut[Column.SIGN] == -1
    np.testing.assert_allclose(cut[:2], (0.6, 0.3), atol=0.01)
    assert NOTHING.shape == (0, WIDTH)


def test_hollow_solids_are_their_pieces() -> None:
    frame, cup = HollowBox((4, 3, 2), 0.5), HollowFrustum(1, 0.5, 0.25, 2)
    generator = np.random.default_rng(0)
    points = generator.uniform(-2, 2, (5000, 3)).astype(np.float32)
    for field in (frame, cup):
        outer, hole = (Part(piece) for piece in field.pieces())
        inside, expected = field(points) < 0, (outer - hole).distance(points) < 0
        assert (inside != expected).mean() < 1e-3
    volume = math.pi * 2 / 3 * (1 + 0.5 + 0.25) * (1 - 0.75**2)
    mesh = pw.meshing.mesh_assembly(Assembly((Part(cup),)))
    assert mesh.volume == pytest.approx(volume, rel=5e-3)
    assert mesh.is_watertight
