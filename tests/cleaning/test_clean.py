"""A known assembly that was shaken comes back, number for number; nothing gets worse than it may."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.cleaning import clean
from partwright.cleaning.dimensions import values, with_values
from partwright.cli.main import main
from partwright.errors import CancelledError, SettingError, UncleanableError
from partwright.fields import Box, Capsule, Cylinder, Field, Frustum, Solid, Sphere, SuperFrustum
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import solid_of
from partwright.meshing.manifolds import surface_of
from partwright.methods import Cancellation
from partwright.shapes import load_shape

ALONG_X, ALONG_Y = (math.sqrt(0.5), 0, math.sqrt(0.5), 0), (0.5, -0.5, 0.5, 0.5)
TOLERANCE = 0.9  # of lengths about 100: rounding may then move a face by 0.3


def plate(holes: int = 6) -> Assembly:
    """A plate with a boss and holes on a circle, in mm."""
    angles = 2 * np.pi * np.arange(holes) / holes
    drills = [Part(Cylinder(4, 20), (30 * math.cos(a), 30 * math.sin(a), 5), name="hole") for a in angles]
    body = Assembly((Part(Box((100, 80, 10)), (0, 0, 5), name="plate"), Part(Cylinder(15, 30), (0, 0, 15))))
    return Assembly((body, *drills), "difference", name="plate", unit="mm")


def bracket() -> Assembly:
    """Boxes, a bar along x and posts on both sides, in mm."""
    post = Part(Frustum(6, 4, 40), (40, 25, 30), name="post")
    other = dataclasses.replace(post, translation=(40, -25, 30))
    return Assembly(
        (
            Part(Box((100, 60, 10)), (0, 0, 5), name="base"),
            Part(Box((10, 60, 50)), (-45, 0, 25), name="wall"),
            Part(Cylinder(8, 60), (-10, 0, 35), ALONG_X, name="bar"),
            post,
            other,
            Part(Sphere(8), (20, 0, 35), name="knob"),
        ),
        unit="mm",
    )


def shaken(assembly: Assembly, seed: int, share: float = 0.005) -> Assembly:
    """Every dimension and place a little off by up to a share of itself, every part turned by up to 0.3
    degrees."""
    rng = np.random.default_rng(seed)
    for part in assembly.parts:
        numbers = values(part.field)
        numbers = numbers * (1 + rng.uniform(-share, share, len(numbers)))
        if isinstance(part.field, SuperFrustum):
            numbers[[3, 6, 7]] = np.minimum(numbers[[3, 6, 7]], 1.0)  # roundness, bulge, onion
        field = with_values(type(part.field), numbers)
        place = np.array(part.translation) * (1 + rng.uniform(-share, share, 3))
        turn = np.append(1.0, np.radians(rng.uniform(-0.3, 0.3, 3)) / 2)
        pose = Similarity(1.0, part.rotation) @ Similarity(1.0, tuple((turn / np.linalg.norm(turn)).tolist()))
        moved = dataclasses.replace(part, field=field, translation=tuple(place), rotation=pose.rotation)
        assembly = assembly.replace_part(part.name, moved)
    return assembly


def as_superfrusta(assembly: Assembly) -> Assembly:
    """What a fit would give: the same numbers as bare SuperFrusta, a little blended."""
    for part in assembly.parts:
        assert isinstance(part.field, Solid)
        bare = dataclasses.replace(part, field=part.field.superfrustum(), blend=0.05123)
        assembly = assembly.replace_part(part.name, bare)
    return assembly


def fields(assembly: Assembly) -> list[Field]:
    return [part.field for part in assembly.parts]


@pytest.mark.parametrize("seed", range(3))
def test_a_plate_with_holes_comes_back(seed: int) -> None:
    cleaned = clean(shaken(plate(), seed), tolerance=TOLERANCE)
    made = cleaned.assembly
    assert fields(made) == [Box((100, 80, 10)), Cylinder(15, 30), Cylinder(4, 20)]
    assert [part.translation for part in made.parts] == [(0, 0, 5), (0, 0, 15), (30, 0, 5)]
    assert all(part.rotation == (1, 0, 0, 0) for part in made.parts)
    assert [len(part.copies) for part in made.parts] == [1, 1, 6]
    assert made.operation == "difference"
    truth = np.array(sorted(part.translation for part in plate().parts[2:]))
    assert np.allclose(sorted(copy.translation for copy in made.parts[2].copies), truth, atol=1e-9)
    kinds = {relation.kind for relation in cleaned.relations}
    assert {"aligned", "repeated", "circle", "centred", "flush"} <= kinds
    assert any("6 around a circle of radius 30 mm about z" in str(one) for one in cleaned.relations)


@pytest.mark.parametrize("seed", range(3))
def test_a_bracket_comes_back(seed: int) -> None:
    cleaned = clean(shaken(bracket(), seed), tolerance=TOLERANCE)
    made = cleaned.assembly
    assert fields(made) == fields(bracket())[:4] + fields(bracket())[5:]
    for part in made.parts:
        assert part.translation == bracket()[part.name].translation
    post = made["post"]
    assert [copy.translation for copy in post.copies] == [(40, 25, 30), (40, -25, 30)]
    points = np.random.default_rng(0).uniform(-60, 60, (2000, 3))
    assert np.abs(made.distance(points) - bracket().distance(points)).max() < 1e-4
    text = "\n".join(map(str, cleaned.relations))
    for line in (
        "bar, knob: equal radius 8 mm",
        "post: mirror images across y = 0 mm",
        "base, wall: flush at z = 0 mm",
    ):
        assert line in text


def test_superfrusta_that_are_nearly_solids_become_them() -> None:
    made = clean(shaken(as_superfrusta(bracket()), 0, 0.002), tolerance=TOLERANCE).assembly
    assert fields(made) == fields(bracket())[:4] + fields(bracket())[5:]
    assert all(part.blend == 0 for part in made.parts)


@pytest.mark.parametrize("seed", range(2))
def test_cleaning_twice_changes_nothing(seed: int) -> None:
    for given in (shaken(plate(5), seed), shaken(as_superfrusta(bracket()), seed)):
        once = clean(given, tolerance=TOLERANCE)
        again = clean(once.assembly, tolerance=TOLERANCE)
        assert once.changed
        assert not again.changed
        assert again.assembly is once.assembly
        assert again.relations == once.relations


@pytest.mark.parametrize("tolerance", [0.1, 0.5])
def test_the_surface_moves_less_than_the_tolerance(tolerance: float) -> None:
    given = shaken(bracket(), 5, 0.02)
    cleaned = clean(given, tolerance=tolerance)
    assert cleaned.changed
    points = mesh_assembly(given, 64).sample(4000, seed=0)
    # On average over each part, so on average over all; a ten-thousandth of the side is rounding's.
    assert np.abs(cleaned.assembly.distance(points)).mean() < tolerance + 0.01
    assert cleaned.after.mean_deviation < tolerance + 0.01


def test_an_assembly_that_lies_askew_is_cleaned_along_its_own_axes() -> None:
    move = Similarity(1.0, (0.9, 0.3, -0.2, 0.1), (13.7, -4.2, 8.1))  # its numbers are those it had upright
    made = clean(shaken(bracket(), 1).transformed(move), tolerance=TOLERANCE).assembly
    assert fields(made) == fields(bracket())[:4] + fields(bracket())[5:]
    back = made.transformed(move.inverse())
    points = mesh_assembly(bracket()).sample(2000, seed=0)
    assert np.abs(back.distance(points)).max() < 1.0


def test_with_a_shape_the_numbers_are_fitted_to_it() -> None:
    truth = bracket()
    shape = load_shape(mesh_assembly(truth), unit="mm")
    cleaned = clean(shaken(truth, 2), shape, tolerance=TOLERANCE)
    assert fields(cleaned.assembly) == fields(truth)[:4] + fields(truth)[5:]
    assert cleaned.after.iou > 0.99
    assert cleaned.after.iou > cleaned.before.iou
    assert cleaned.after.mean_deviation < cleaned.before.mean_deviation


def test_what_a_person_typed_stays() -> None:
    typed = Assembly(
        (Part(Box((4.01, 4, 2)), (0.003, 0, 0)), Part(Cylinder(1.01, 3), (0, 0.5, 1))), unit="mm"
    )
    cleaned = clean(typed, tolerance=0.1)
    assert not cleaned.changed
    assert cleaned.assembly is typed
    assert cleaned.before == cleaned.after


def test_repeats_of_a_fit_stay_one_part() -> None:
    moves = (
        Similarity(translation=(40.2, 0.1, 0)),
        Similarity(1.0, (0.0008, 0, 0, 1), (0.0123, -0.0512, 0.0512)),
    )
    legs = Part(
        SuperFrustum((6.02123, 6.01234, 30.0512), 0.01234),
        (-20.1012, 30.0512, 0.02012),
        name="leg",
        instances=moves,
    )
    made = clean(Assembly((legs,), unit="mm"), tolerance=0.6).assembly
    assert made["leg"].field == Box((6, 6, 30))
    assert [copy.translation for copy in made["leg"].copies] == [(-20, 30, 0), (20, 30, 0), (20, -30, 0)]
    assert all(copy.rotation == (1, 0, 0, 0) for copy in made["leg"].copies)


@pytest.mark.parametrize(
    ("tolerance", "says"),
    [(-1.0, "expected a length above 0"), (math.nan, "above 0"), (50.0, "at most"), (1e-5, "below what")],
)
def test_wrong_tolerances(tolerance: float, says: str) -> None:
    with pytest.raises(SettingError, match=says):
        clean(bracket(), tolerance=tolerance)


def test_a_tolerance_below_the_meshs_noise_is_refused() -> None:
    rough = trimesh.creation.icosphere(4, 10.0)
    rough.vertices *= 1 + np.random.default_rng(0).normal(0, 0.005, (len(rough.vertices), 1))
    ball = load_shape(rough)
    fitted = Assembly((Part(Sphere(9.93123), (0.021234, 0.012345, 0)),))
    with pytest.raises(SettingError, match="the mesh's own noise, 0"):
        clean(fitted, ball, tolerance=0.005)
    assert clean(fitted, ball, tolerance=0.2).changed
    assert clean(fitted, ball, tolerance=0.0101).tolerance == 0.0101  # a mean over many samples tells as much


def test_of_a_scan_numbers_land_on_what_its_noise_allows() -> None:
    """A hole of 4.45 mm in a scan that is 0.2 mm off here and there is one of 4.5; in an exact mesh not."""
    plate = Part(Box((60, 40, 12)), name="plate")
    hole = Part(Cylinder(2.25, 30), (15, 0, 0), name="hole")
    fine = solid_of(Assembly((plate, hole), "difference", unit="mm"), 0.02).refine_to_length(1.5)
    vertices, faces = surface_of(fine)
    exact = trimesh.Trimesh(vertices, faces, process=False)
    noise = np.random.default_rng(0).normal(0, 0.2, (len(vertices), 1))
    scan = trimesh.Trimesh(vertices + exact.vertex_normals * noise, faces, process=False)
    fitted = Assembly((plate, dataclasses.replace(hole, field=Cylinder(2.2262, 30))), "difference", unit="mm")
    for mesh, noisy in ((scan, True), (exact, False)):
        cleaned = clean(fitted, load_shape(mesh, unit="mm"))
        assert (cleaned.assembly["hole"].field == Cylinder(2.25, 30)) is noisy
        assert (cleaned.tolerance > 0.05) is noisy


def test_a_fit_to_be_cleaned_fails_before_it_starts() -> None:
    import trimesh

    from partwright.fitting import Clean, fit

    block = load_shape(trimesh.creation.box((3, 2, 1)))
    for tolerance in (1e-9, 1.0, math.nan):
        with pytest.raises(SettingError, match="clean tolerance"):
            fit(block, "solids", clean=Clean(tolerance), progress=pytest.fail)


def test_a_field_of_another_kind_is_refused() -> None:
    class Foreign(Capsule):
        kind = "latent"

    part = Part(Foreign(1, 2), name="soft")
    object.__setattr__(part, "field", _Latent())
    with pytest.raises(UncleanableError, match="'soft' is a latent"):
        clean(Assembly((part,)))


@pytest.mark.parametrize("beside", [(), (Part(Box((1, 1, 1)), (2, 0, 0)),)])
def test_a_part_without_a_size_is_named(beside: tuple[Part, ...]) -> None:
    flat = Part(SuperFrustum((0, 0, 0)), name="flat")
    with pytest.raises(UncleanableError, match="'flat' has no size"):
        clean(Assembly((flat, *beside)))


def test_too_many_parts_are_refused_before_the_memory_is_full() -> None:
    copies = tuple(Similarity(translation=(2.0 * i, 0.0, 0.0)) for i in range(1, 501))
    with pytest.raises(UncleanableError, match=r"501 parts, copies counted; .* at most 500"):
        clean(Assembly((Part(Box((1, 1, 1)), instances=copies),)))


def test_steps_are_told_in_order() -> None:
    told: list[str] = []
    clean(Assembly((Part(Box((1, 2, 3))),)), told=told.append)
    assert told == ["sampling", "naming solids", "turning", "relating", "finding repeats", "measuring"]


class _Latent(Field):
    kind = "latent"

    def __call__(self, points):  # type: ignore[no-untyped-def]
        return points[:, 0]

    def bounds(self):  # type: ignore[no-untyped-def]
        return -np.ones(3), np.ones(3)

    def scaled(self, factor):  # type: ignore[no-untyped-def]
        return self


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given, out = tmp_path / "given.json", tmp_path / "clean.json"
    shaken(plate(), 0).save(given)
    assert main(["clean", str(given), "-o", str(out), "--clean-tolerance", "0.4"]) == 0
    assert load_assembly(out).parts[0].field == Box((100, 80, 10))
    report = json.loads((tmp_path / "clean.json.report.json").read_text())
    assert report["tolerance"] == 0.4
    assert report["unit"] == "mm"
    assert {"kind": "repeated", "parts": ["hole"], "text": "one part, 6 times"} in report["relations"]
    assert "hole: 6 around a circle of radius 30 mm about z" in capsys.readouterr().out

    again = tmp_path / "again.json"
    assert main(["clean", str(out), "-o", str(again)]) == 2
    assert "nothing to clean" in capsys.readouterr().err
    assert not again.exists()
    assert main(["clean", str(given), "-o", str(tmp_path / "x.step")]) == 2
    assert "use a .json" in capsys.readouterr().err


def test_cancelled_it_leaves_the_assembly() -> None:
    cancel = Cancellation()
    cancel.request()
    with pytest.raises(CancelledError):
        clean(shaken(bracket(), 0), tolerance=TOLERANCE, cancel=cancel)


def test_sixteen_parts_become_two() -> None:
    tiles = [Box((8, 6, 10)), Cylinder(4, 10)]
    parts = tuple(Part(tiles[i % 2], (12 * (i % 8), 15 * (i // 8), 5)) for i in range(16))
    made = clean(shaken(Assembly(parts, unit="mm"), 0, 0.002), tolerance=0.6).assembly
    assert fields(made) == tiles
    assert [len(part.copies) for part in made.parts] == [8, 8]
