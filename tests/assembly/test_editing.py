"""Numbers set by name, and what follows: parts on a face, cuts through it, cuts of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.assembly.editing import with_numbers
from partwright.assembly.instance_patterns import Circle, Grid, Ring, pattern, with_pattern
from partwright.assembly.numbers import numbers_of
from partwright.assembly.repeated_groups import copies_of, line, ring
from partwright.cli.main import main
from partwright.errors import ParameterError
from partwright.fields import Box, Cylinder, Extrusion, Pipe, Profile, Revolution
from partwright.meshing import mesh_assembly

SHIFT = Similarity(translation=(40, 0, 0))


def bracket() -> Assembly:
    """A plate 5 thick from z = 0, two holes through it, a pocket 2 deep in its top, a foot under it, and a
    boss on it with a hole of its own."""
    hole = Part(Cylinder(2, 7), (15, 0, 2.5), name="hole", instances=(Similarity(translation=(-30, 0, 0)),))
    pocket = Part(Box((6, 6, 3)), (8, 0, 4.5), name="pocket")
    plate = Assembly((Part(Box((40, 20, 5)), (0, 0, 2.5), name="base_plate"), hole, pocket), "difference")
    boss = Assembly(
        (Part(Cylinder(4, 10), (0, 0, 10), name="boss"), Part(Cylinder(1, 30), name="bore")), "difference"
    )
    foot = Part(Box((4, 4, 3)), (0, 0, -1.5), name="foot")
    return Assembly((plate, boss, foot), unit="mm")


def test_a_thicker_plate_takes_along_what_it_carries() -> None:
    edited = with_numbers(bracket(), {"base_plate.size.z": 9.0})
    after = edited.assembly
    assert edited.changed == ("base_plate.size.z: 5 to 9",)
    assert after["hole"].field == Cylinder(2, 11)
    assert after["hole"].translation == (15, 0, 2.5)
    assert after["pocket"].translation[2] == pytest.approx(6.5)
    assert after["boss"].translation[2] == pytest.approx(12)
    assert after["foot"].translation[2] == pytest.approx(-3.5)
    assert len(edited.followed) == 4
    assert "hole goes through base_plate as before" in edited.followed
    mesh, before = mesh_assembly(after), mesh_assembly(bracket())
    assert mesh.euler_number == before.euler_number
    holes = 2 * 3.1416 * 4 * 4
    assert mesh.volume - before.volume == pytest.approx(40 * 20 * 4 - holes - 3.1416 * 4, rel=0.01)


def test_what_carries_a_part_stays_where_it_is() -> None:
    """A boss that gets higher stands on its plate as before: neither that nor what is beside it moves."""
    plate = Part(Box((40, 20, 5)), (0, 0, 2.5), name="plate")
    rib = Part(Box((20, 2, 6)), (0, 5, 8), name="rib")
    ring = Profile(((2, -2, 0), (3, -2, 0), (3, 2, 0), (2, 2, 0)))
    across = (Similarity(translation=(10, 0, 0)),)
    boss = Part(Revolution(ring), (-5, -5, 7), name="boss", instances=across)
    whole = Assembly((plate, boss, rib))
    for number, value, height in (("boss.profile.y.1", -1.0, 3.0), ("boss.profile.y.2", 4.0, 6.0)):
        edited = with_numbers(whole, {number: value})
        assert (edited.assembly["plate"], edited.assembly["rib"]) == (plate, rib)
        for copy in edited.assembly["boss"].copies:
            assert copy.bounds()[:, 2] == pytest.approx((5.0, 5.0 + height))
    assert with_numbers(whole, {"boss.profile.y.1": -1.0}).followed == ("boss still stands on plate",)
    lid = Part(Box((40, 20, 5)), (0, 0, 11.5), name="lid")  # a post between two plates grows about its middle
    post = Part(Box((2, 2, 4)), (0, -5, 7), name="post")
    between = with_numbers(Assembly((plate, post, lid)), {"post.size.z": 6.0}).assembly
    assert [between[name].translation[2] for name in ("plate", "post", "lid")] == [1.5, 7.0, 12.5]


def test_copies_change_together_and_patterns_name_several() -> None:
    after = with_numbers(bracket(), {"hole.diameter": 6.0}).assembly
    assert after["hole"].field == Cylinder(3, 7)
    assert len(after["hole"].copies) == 2
    wider = with_numbers(bracket(), {"bo*.radius": 1.5})
    assert [after.radius for name in ("boss", "bore") if (after := wider.assembly[name].field)] == [1.5, 1.5]
    assert len(wider.changed) == 2
    assert with_numbers(bracket(), {"foot.x": 3}).assembly["foot"].translation == (3, 0, -1.5)
    assert numbers_of(bracket()["hole"])["diameter"] == 4


def test_a_wider_hole_moves_nothing_that_ends_where_its_wall_does() -> None:
    """A block far away ends at the same x as the hole: nothing stands on a round wall."""
    block = Part(Box((4, 4, 6)), (11, -7, 8), name="block")  # to x = 13, as the hole from there on
    edited = with_numbers(bracket() | block, {"hole.radius": 2.5})
    assert edited.assembly["block"].translation == (11, -7, 8)
    assert edited.followed == ()


def test_what_is_as_high_but_beside_a_plate_stays() -> None:
    aside = Part(Box((4, 4, 4)), (40, 0, 7), name="aside")  # from z = 5, as the plate's top
    edited = with_numbers(bracket() | aside, {"base_plate.size.z": 9.0})
    assert edited.assembly["aside"].translation == (40, 0, 7)
    assert not any("aside" in sentence for sentence in edited.followed)


def test_what_is_on_the_floor_of_a_pocket_goes_down_with_it() -> None:
    """A stud that stands on it, and a hole that begins in it; the plate whose underside is as high stays."""
    plate = Part(Box((40, 20, 10)), (0, 0, 5), name="plate")
    pocket = Part(Box((20, 10, 6)), (0, 0, 9), name="pocket")  # from z = 6
    hole = Part(Cylinder(1, 2), (5, 0, 5), name="hole")  # from 4 to 6
    stud = Part(Cylinder(1, 3), (-5, 0, 7.5), name="stud")  # from 6
    shelf = Part(Box((60, 4, 2)), (0, 20, 7), name="shelf")  # from 6, beside
    before = Assembly((Assembly((plate, pocket, hole), "difference"), stud, shelf))
    edited = with_numbers(before, {"pocket.size.z": 8.0})  # from 5
    after = edited.assembly
    assert [after[name].translation[2] for name in ("hole", "stud", "shelf", "plate")] == [4, 6.5, 7, 5]
    assert len(edited.followed) == 2
    assert mesh_assembly(after).body_count == mesh_assembly(before).body_count


def test_what_is_rooted_in_a_plate_stands_out_of_it_as_far_as_before() -> None:
    """Fits let what is added reach into what it stands on: down to its other face, or a little way."""
    plate = Part(Box((60, 40, 6)), (0, 0, 3), name="plate")
    boss = Part(Cylinder(4, 15), (-20, 0, 7.5), instances=(SHIFT,), name="boss")  # from 0 to 15
    fin = Part(Box((2, 30, 20)), (0, 0, 15), name="fin")  # from 5 to 25
    post = Part(Cylinder(3, 10), (10, 0, -1), name="post")  # from -6 to 4, with a hole
    hole = Part(Cylinder(1, 12), (10, 0, -4), name="hole")
    shaft = Part(Cylinder(1, 30), (0, 15, 0), name="shaft")  # through both faces
    wall = Part(Box((4, 40, 30)), (29, 2, 15), name="wall")  # not over the plate alone
    before = Assembly((plate, boss, fin, Assembly((post, hole), "difference"), shaft, wall))
    edited = with_numbers(before, {"plate.size.z": 10.0})  # from -2 to 8
    after = edited.assembly
    ends = {part.name: part.bounds()[:, 2].tolist() for part in after.parts}
    assert ends == {
        "plate": [-2, 8],
        "boss": [-2, 17],
        "fin": [7, 27],
        "post": [-8, 2],
        "hole": [-12, 0],
        "shaft": [-15, 15],
        "wall": [0, 30],
    }
    assert [line.split()[0] for line in edited.followed] == ["boss", "fin", "post"]
    thin = with_numbers(before, {"plate.size.z": 0.5}).assembly  # from 2.75 to 3.25
    assert thin["fin"].bounds()[:, 2].tolist() == [2.75, 22.25]  # and not out of its other face


def test_a_counterbored_hole_goes_through_a_thicker_plate_and_keeps_its_depth() -> None:
    """It is a profile that is turned: its shoulder goes with the face of its wider end."""
    plate = Part(Box((60, 40, 10)), (0, 0, 5), name="plate")
    sunk = Revolution(Profile.polygon([(0, -6), (2, -6), (2, 2), (4, 2), (4, 6), (0, 6)]))
    over = Part(sunk, (20, 0, 5), (0, 1, 0, 0), name="from_below")
    before = Assembly((plate, Part(sunk, (0, 0, 5), name="from_above"), over), "difference")
    after = with_numbers(before, {"plate.size.z": 14.0}).assembly  # from -2 to 12
    assert (
        after["from_above"].bounds()[:, 2].tolist() == after["from_below"].bounds()[:, 2].tolist() == [-3, 13]
    )
    depth = [[x, 0, z] for x, z in ((3, 9.5), (3, 8.5), (23, 0.5), (23, 1.5))]  # 3 mm deep from either face
    assert (after.distance(depth) < 0).tolist() == [False, True, False, True]
    assert mesh_assembly(after).euler_number == mesh_assembly(before).euler_number == -2
    thin = with_numbers(before, {"plate.size.z": 6.0}).assembly  # from 2 to 8
    assert thin["from_above"].bounds()[:, 2].tolist() == thin["from_below"].bounds()[:, 2].tolist() == [1, 9]
    depth = [[x, 0, z] for x, z in ((3, 5.5), (3, 4.5), (23, 4.5), (23, 5.5))]
    assert (thin.distance(depth) < 0).tolist() == [False, True, False, True]
    sheet = with_numbers(before, {"plate.size.z": 2.0})  # thinner than the counterbore is deep
    assert sheet.assembly["from_above"] == before["from_above"]
    assert "from_above stays as it is: it cannot be made shorter by 8 with plate" in sheet.followed


def test_copies_at_two_faces_go_each_with_its_own() -> None:
    """Rounded corners at both ends of a bar, and feet under it and on it."""
    bar = Part(Box((60, 20, 10)), name="bar")
    both = (Similarity(rotation=(0, 0, 0, 1)),)
    notch = Part(Box((4, 4, 20)), (30, 10, 0), instances=both, name="notch")
    foot = Part(Box((2, 2, 6)), (0, 0, -8), instances=(Similarity(rotation=(0, 1, 0, 0)),), name="foot")
    before = Assembly((Assembly((bar, notch), "difference"), foot))
    edited = with_numbers(before, {"bar.size.x": 70.0, "bar.size.z": 12.0})
    assert [copy.translation[:2] for copy in edited.assembly["notch"].copies] == [(35, 10), (-35, -10)]
    assert [copy.translation[2] for copy in edited.assembly["foot"].copies] == [-9, 9]
    assert "notch moved by -5 and 5 with the face of bar: its depth is kept" in edited.followed


def test_profiles_have_numbers_to_set() -> None:
    """All corners at one place move: a flange becomes wider, or thicker, and the hole still goes through."""
    hub = Revolution(Profile.polygon([(5, 0), (30, 0), (30, 8), (9, 8), (9, 20), (5, 20)]))
    hole = Part(Cylinder(2, 10), (20, 0, 4), name="hole")
    nut = Part(Cylinder(4, 3), (-20, 0, 9.5), name="nut")
    before = Assembly((Assembly((Part(hub, name="hub"), hole), "difference"), nut))
    numbers = numbers_of(before["hub"])
    wanted = {"diameter.1": 10, "diameter.2": 18, "diameter.3": 60, "y.1": 0, "y.2": 8, "y.3": 20}
    assert {name: numbers[f"profile.{name}"] for name in wanted} == wanted
    for number, value, ends, seat in (
        ("diameter.3", 70.0, [-1, 9], 8),
        ("y.2", 10.0, [-1, 11], 10),
        ("y.1", -3.0, [-4, 9], 8),
        ("y.3", 25.0, [-1, 9], 8),
    ):
        after = with_numbers(before, {f"hub.profile.{number}": value}).assembly
        assert numbers_of(after["hub"])[f"profile.{number}"] == value
        assert after["hole"].bounds()[:, 2].tolist() == ends
        assert after["nut"].bounds()[0, 2] == seat
        assert mesh_assembly(after).euler_number == mesh_assembly(before).euler_number
    with pytest.raises(ParameterError, match="sides cross"):
        with_numbers(before, {"hub.profile.diameter.3": 8.0})


def test_pipes_have_corners_and_bends_to_set() -> None:
    """Several at once, as none may fit without the others."""
    pipe = Pipe(((0, 0, 0), (30, 0, 0, 10), (30, 20, 0, 8), (30, 20, 30)), 3)
    before = Assembly((Part(pipe, name="pipe"),))
    numbers = numbers_of(before["pipe"])
    assert {
        "path.2.x": 30,
        "bend.2": 10,
        "bend.3": 8,
        "path.4.z": 30,
        "diameter": 6,
    }.items() <= numbers.items()
    assert "bend.1" not in numbers
    after = with_numbers(before, {"pipe.bend.2": 24.0, "pipe.path.3.y": 40.0, "pipe.path.4.y": 40.0}).assembly
    assert after["pipe"].field == Pipe(((0, 0, 0), (30, 0, 0, 24), (30, 40, 0, 8), (30, 40, 30)), 3)
    with pytest.raises(ParameterError, match="smaller bend"):
        with_numbers(before, {"pipe.bend.2": 24.0})


def hub(*corners: tuple[float, float]) -> Part:
    """Turned: of 5 to 30, from 0 on, with an end of 9 at 20, and in between as it is given."""
    return Part(Revolution(Profile.polygon([(5, 0), (30, 0), *corners, (9, 20), (5, 20)])), name="hub")


def hole(low: float, high: float, x: float = 25.0) -> Part:
    return Part(Cylinder(2, high - low), (x, 0, (low + high) / 2), name="hole")


def test_what_stands_on_a_turned_part_moves_once_though_its_shoulders_move_too() -> None:
    """A nut under a flange with the hole in it: the lower face is an end of the hub and of its flange."""
    nut = Assembly((Part(Cylinder(4, 3), (-20, 0, -1.5), name="nut"), hole(-9, 9, -20)), "difference")
    edited = with_numbers(Assembly((hub((30, 8), (9, 8)), nut)), {"hub.profile.y.1": -3.0})
    assert edited.assembly["nut"].bounds()[:, 2].tolist() == [-6, -3]
    assert edited.assembly["hole"].bounds()[:, 2].tolist() == [-12, 6]
    knob = Part(Cylinder(1, 10), (7, 0, 20), name="knob")  # out of the end that stays
    edited = with_numbers(Assembly((hub((30, 8), (9, 8)), knob)), {"hub.profile.y.1": -3.0})
    assert edited.assembly["knob"] == knob
    assert edited.followed == ()


@pytest.mark.parametrize(
    ("ends", "number", "value", "then"),
    [
        ((-1, 9), "y.1", -3.0, [-4, 9]),  # through the flange
        ((-1, 5), "y.1", -3.0, [-4, 2]),  # blind, from below
        ((3, 9), "y.1", -3.0, [3, 9]),  # blind, from the flange's shoulder
        ((3, 9), "y.2", 10.0, [5, 11]),
        ((-1, 5), "y.3", 13.0, [-1, 5]),
    ],
)
def test_a_cut_goes_with_the_shoulder_that_it_is_open_at(
    ends: tuple[float, float], number: str, value: float, then: list[float]
) -> None:
    turned = hub((30, 8), (20, 8), (20, 12), (9, 12))
    before = Assembly((turned, hole(*ends)), "difference")
    after = with_numbers(before, {f"hub.profile.{number}": value}).assembly
    assert after["hole"].bounds()[:, 2].tolist() == then


def test_a_shoulder_with_a_groove_moves_what_begins_there_once() -> None:
    grooved = hub((30, 8), (25, 8), (25, 6), (20, 6), (20, 8), (9, 8))
    before = Assembly((grooved, hole(5, 9, 15)), "difference")
    edited = with_numbers(before, {"hub.profile.y.3": 9.0})
    assert edited.assembly["hole"].bounds()[:, 2].tolist() == [6, 10]
    assert len(edited.followed) == 1


def test_a_shoulder_is_level_within_rounding_and_straight() -> None:
    nut = Part(Cylinder(4, 3), (-20, 0, 9.5), name="nut")
    rough = Assembly((hub((30, 8.0001), (9, 8)), nut))
    seat = with_numbers(rough, {"hub.profile.y.2": 10.0}).assembly["nut"].bounds()[0, 2]
    assert seat == pytest.approx(10, abs=2e-4)
    loop = ((5, 0, 0), (30, 0, 0), (30, 8, 0.2), (9, 8, 0), (9, 20, 0), (5, 20, 0))
    domed = Assembly((Part(Revolution(Profile(loop)), name="hub"), nut))
    assert with_numbers(domed, {"hub.profile.y.2": 10.0}).assembly["nut"] == nut


def test_copies_with_cuts_go_each_with_its_own_face_too() -> None:
    over = (Similarity(rotation=(0, 1, 0, 0)),)  # from below to above
    foot = Part(Box((8, 8, 6)), (0, 0, -8), instances=over, name="foot")
    bore = Part(Cylinder(1, 4), (0, 0, -11), instances=over, name="bore")
    bar = Part(Box((60, 20, 10)), name="bar")
    after = with_numbers(Assembly((bar, Assembly((foot, bore), "difference"))), {"bar.size.z": 12.0}).assembly
    assert [copy.translation[2] for copy in after["foot"].copies] == [-9, 9]
    assert [copy.translation[2] for copy in after["bore"].copies] == [-12, 12]


def test_numbers_of_one_profile_are_counted_before_any_is_set() -> None:
    before = Assembly((hub((30, 8), (9, 8)), Part(Cylinder(4, 3), (-20, 0, 9.5), name="nut")))
    edited = with_numbers(before, {"hub.profile.y.2": 25.0, "nut.radius": 3, "hub.profile.y.3": 30.0})
    assert edited.changed == (
        "hub.profile.y.2: 8 to 25",
        "hub.profile.y.3: 20 to 30",
        "nut.radius: 4 to 3",
    )
    levels = edited.assembly["hub"].field.profile.corners[:, 1].tolist()
    assert levels == [0, 0, 25, 25, 30, 30]
    assert edited.assembly["nut"].bounds()[0, 2] == 25


def test_a_slot_of_an_outline_gets_wider_by_its_sides() -> None:
    slot = Part(Extrusion(Profile(((-5, -3, 0), (5, -3, 1), (5, 3, 0), (-5, 3, 1))), 4), name="slot")
    assert [name for name in numbers_of(slot) if "profile" in name] == ["profile.y.1", "profile.y.2"]
    wider = with_numbers(Assembly((slot,)), {"slot.profile.y.1": -4.0, "slot.profile.y.2": 4.0}).assembly
    assert wider["slot"].field.profile.area == pytest.approx(80 + 16 * math.pi)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("lid.radius", 1.0, "the parts are base_plate, hole"),
        ("hole", 1.0, "expected PART.NUMBER"),
        ("hole.size.x", 1.0, "has no number 'size.x'; it has radius, diameter, height, x, y, z"),
        ("hole.radius", -1.0, "radius"),
    ],
)
def test_what_cannot_be_set_is_named(name: str, value: float, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        with_numbers(bracket(), {name: value})


def test_the_command_takes_units_and_says_what_followed(tmp_path: Path, capsys: Any) -> None:
    source, target = tmp_path / "a.json", tmp_path / "b.json"
    bracket().save(source)
    words = [
        "edit",
        str(source),
        "--set",
        "base_plate.size.z=0.9cm",
        "--set",
        "hole.diameter = 6mm",
        "-o",
        str(target),
    ]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert (
        "base_plate.size.z: 5 to 9\nhole.diameter: 4 to 6\n  hole goes through base_plate as before" in said
    )
    assert load_assembly(target)["hole"].field == Cylinder(3, 11)
    for bad in ("hole.diameter=", "hole.radius=3parsecs", "lid.radius=2"):
        assert main(["edit", str(source), "--set", bad, "-o", str(tmp_path / "c.json")]) == 2
    assert main(["edit", str(source), "--set", "hole.radius=1", "-o", str(tmp_path / "c.stl")]) == 2
    assert not (tmp_path / "c.json").exists()


def test_patterns_have_numbers_to_set() -> None:
    hole = with_pattern(Part(Cylinder(1, 20), name="hole"), Circle(6, 34, 30, (0, 0, 5)))
    post = with_pattern(Part(Box((2, 2, 9)), name="post"), Grid((2, 2, 1), (50, 30, 0), (0, 0, 5)))
    tooth = Part(Box((2, 3, 9)), (20, 0, 0), name="tooth", instances=ring(24))
    part = Assembly((post, tooth)) - hole
    values = {"hole.count": 8, "hole.circle": 40, "post.counts.x": 3, "post.spacing.y": 44, "tooth.count": 30}
    edited = with_numbers(part, values).assembly
    assert pattern(edited["hole"]) == Circle(8, 40, 30, (0, 0, 5))
    assert pattern(edited["post"]) == Grid((3, 2, 1), (50, 44, 0), (0, 0, 5))
    assert pattern(edited["tooth"]) == Ring(30, "z", (0, 0, 0))
    assert edited["tooth"].translation == (20, 0, 0)
    assert with_numbers(part, {"hole.start": 0}).assembly["hole"].translation == (17, 0, 5)
    endless = {"hole.count": 1e9}, {"tooth.count": float("inf")}
    for wrong in (
        *endless,
        {"hole.count": 2.5},
        {"tooth.count": 1},
        {"hole.circle": -3},
        {"post.spacing.x": 0},
    ):
        with pytest.raises(ParameterError, match="expected a"):
            with_numbers(part, wrong)
    with pytest.raises(ParameterError, match=r"has no number 'count'; it has .*spacing.x"):
        with_numbers(part, {"post.count": 3})


def test_patterns_within_groups_that_are_copies_change_alike() -> None:
    hole = with_pattern(Part(Cylinder(1, 20), name="hole"), Circle(6, 34, 30, (0, 0, 5)))
    flange = Assembly((Part(Box((50, 50, 4)), (0, 0, 5), name="flange"), hole), "difference")
    pair = Assembly((flange, *copies_of(flange, line(2, (0, 0, 80)))))
    edited = with_numbers(pair, {"hole.count": 8}).assembly
    assert pattern(edited["hole_02"]) == Circle(8, 34, 30, (0, 0, 85))
