"""Screw threads are found, measured and taken out; springs, gears and turned grooves are not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

from partwright.approximation.sketches import threads
from partwright.approximation.sketches.threads import without_threads
from partwright.meshing.manifolds import closed
from tests.threaded import INNER, LENGTH, PITCH, RADIUS, threaded


def turned_askew(body: Manifold) -> Manifold:
    return body.rotate((20, 30, 40)).translate((0.1, -0.2, 0.3))


def head() -> Manifold:
    """That a neck goes over into."""
    arc = math.pi / 2 * np.arange(11) / 10
    neck = np.column_stack([RADIUS + 0.3 * (1 - np.cos(arc)), 0.2 + 0.3 * np.sin(arc)])
    profile = [(0, 0), (RADIUS, 0), *neck.tolist(), (0, 0.5)]
    return CrossSection([profile]).revolve(60).translate((0, 0, 0.4))


def running_out() -> Manifold:
    """A finely meshed screw, whose thread ends before its head."""
    return threaded(along=40, ends=0.3) + head()


@pytest.mark.parametrize("pitch", [PITCH, -PITCH])
def test_a_rod_becomes_the_cylinder_around_it(pitch: float) -> None:
    rod = turned_askew(threaded(pitch))
    plain, (thread,) = without_threads(rod)
    assert thread.pitch == pytest.approx(pitch, rel=5e-3)
    assert (thread.inner, thread.outer) == pytest.approx((INNER, RADIUS), abs=3e-3)
    assert thread.length == pytest.approx(LENGTH, abs=PITCH)
    assert not thread.internal
    ends = turned_askew(Manifold.cube((1e-6, 1e-6, 1.0))).bounding_box()
    assert thread.axis == pytest.approx((0.1, -0.2, 0.3), abs=PITCH / 2)
    assert abs(thread.direction) == pytest.approx(np.abs(np.subtract(ends[3:], ends[:3])), abs=1e-3)
    assert plain.volume() == pytest.approx(math.pi * RADIUS**2 * LENGTH, rel=5e-3)
    assert plain.genus() == 0
    assert plain.volume() > 1.1 * rod.volume()


def test_both_flanks_are_one_thread_in_coarse_chords_too() -> None:
    _, found = without_threads(threaded(around=24))
    assert [thread.pitch for thread in found] == [pytest.approx(PITCH, rel=0.01)]


def test_a_thread_that_runs_out_is_one_though_it_goes_over_into_the_rod_and_its_head() -> None:
    """Where it is less deep, flanks lean less: they came as one patch with the crests, and
    with a neck and a head that these go over into."""
    plain, (thread,) = without_threads(running_out())
    assert thread.pitch == pytest.approx(PITCH, rel=1e-2)
    assert (thread.inner, thread.outer) == pytest.approx((INNER, RADIUS), abs=3e-3)
    whole = math.pi * RADIUS**2 * (0.4 + LENGTH / 2) + head().volume()
    assert plain.volume() == pytest.approx(whole, rel=5e-3)


@pytest.mark.parametrize("slotted", [False, True])
def test_threads_of_coarse_and_of_fine_meshes_are_found_beside_one_another(slotted: bool) -> None:
    """Only where no patch of coarse faces was a thread, finer ones were looked at: a plain rod hid a screw
    that runs out, and so did what was no thread after all."""
    plate = Manifold.cube((3.4, 1.6, 0.2)).translate((-0.7, -0.8, -0.75))
    slot = Manifold.cube((0.15, 1.0, 2.0), True).translate((2.4, 0, 0)) if slotted else Manifold()
    screw, rod = running_out(), threaded().translate((2, 0, 0)) - slot
    _, found = without_threads(screw + rod + plate)
    assert sorted(round(thread.axis[0]) for thread in found) == ([0] if slotted else [0, 2])


def test_a_thread_is_one_though_coarse_and_fine_faces_tell_its_pitch_differently(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real = threads._candidates

    def told(mesh: trimesh.Trimesh, smooth: float) -> list[threads.Thread]:
        share = 1.0 if smooth > 0.2 else 1.05
        return [replace(one, pitch=share * one.pitch) for one in real(mesh, smooth)]

    monkeypatch.setattr(threads, "_candidates", told)
    assert len(without_threads(threaded())[1]) == 1


@pytest.mark.parametrize(
    ("around", "shank", "other"), [(60, RADIUS, 1.0), (60, RADIUS, 1.5), (24, INNER, 1.0)]
)
def test_both_ends_of_a_stud_are_threads_of_their_own(around: int, shank: float, other: float) -> None:
    """Those of coarse chords came as flanks of one, and one went; fine ones went over into one another along
    the shank, and came as one thread of both and a pitch that neither had."""
    above = LENGTH / 2 + 0.3
    rod = Manifold.cylinder(0.3 + 2e-3, shank, shank, around).translate((0, 0, LENGTH / 2 - 1e-3))
    ends = threaded(around=around), threaded(other * PITCH, around).translate((0, 0, above + LENGTH / 2))
    plain, found = without_threads(turned_askew(ends[0] + ends[1] + rod))
    assert sorted(thread.pitch for thread in found) == pytest.approx([PITCH, other * PITCH], rel=0.01)
    assert [thread.length for thread in found] == pytest.approx([LENGTH, LENGTH], abs=PITCH)
    volume = math.pi * (2 * RADIUS**2 * LENGTH + shank**2 * 0.3)
    assert plain.volume() == pytest.approx(volume, rel=5e-3 if around > 24 else 0.02)  # of 24 chords 1 %


def test_a_tapped_hole_becomes_as_narrow_as_its_crests() -> None:
    block = Manifold.cube((1.4, 1.4, 0.9), True)
    nut = block - threaded()
    plain, (thread,) = without_threads(nut)
    assert thread.internal
    assert thread.pitch == pytest.approx(PITCH, rel=5e-3)
    assert thread.length == pytest.approx(0.9, abs=1e-3)
    assert plain.volume() == pytest.approx(block.volume() - math.pi * INNER**2 * 0.9, rel=5e-3)
    assert plain.genus() == 1


@pytest.mark.parametrize("starts", [2, 3])
def test_ridges_that_wind_beside_one_another_are_one_thread(starts: int) -> None:
    plain, (thread,) = without_threads(turned_askew(threaded(starts * PITCH, starts=starts)))
    assert thread.pitch == pytest.approx(starts * PITCH, rel=5e-3)
    assert plain.volume() == pytest.approx(math.pi * RADIUS**2 * LENGTH, rel=0.02)  # of crests in chords


def wavy_neck(winds: int, around: int, rows: int, askew: float) -> Manifold:
    """Of a bottle: as many waves wind around it, or rings where it is 0.

    askew: of a chord, by which the corners of each row are turned on from those of the row below."""
    k, j = (index.ravel() for index in np.meshgrid(np.arange(rows + 1), np.arange(around), indexing="ij"))
    turns, heights = (j + askew * k) / around, LENGTH * (k / rows - 0.5)
    radius = RADIUS - 0.025 + 0.025 * np.cos(2 * np.pi * (heights / (2 * PITCH) - winds * turns))
    angle = 2 * np.pi * turns
    wall = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), heights])
    low, right = np.arange(rows * around), (j[: rows * around] + 1) % around + k[: rows * around] * around
    rim, end = np.arange(around), rows * around
    after = np.roll(rim, -1)
    caps = [
        (after, rim, np.full(around, len(wall))),
        (end + rim, end + after, np.full(around, len(wall) + 1)),
    ]
    sides = [(low, right, low + around), (right, right + around, low + around)]
    corners = np.concatenate([wall, [(0, 0, -LENGTH / 2), (0, 0, LENGTH / 2)]])
    return closed(corners, np.concatenate([np.column_stack(one) for one in [*sides, *caps]]))


@pytest.mark.parametrize(("around", "rows", "askew"), [(16, 30, 0.25), (16, 40, 0.25), (24, 40, 0.25)])
def test_rings_are_no_thread_though_their_chords_lean(around: int, rows: int, askew: float) -> None:
    """A bottle's neck had threads of a pitch that nothing on it had."""
    neck = wavy_neck(0, around, rows, askew)
    plain, found = without_threads(neck)
    assert found == []
    assert plain.volume() == neck.volume()


def test_the_same_waves_are_a_thread_where_they_wind() -> None:
    (thread,) = without_threads(wavy_neck(1, 48, 60, 0.25))[1]
    assert thread.pitch == pytest.approx(2 * PITCH, rel=0.02)


def test_what_is_beside_a_thread_stays() -> None:
    head = Manifold.cylinder(0.4, 0.7, 0.7, 6).translate((0, 0, 0.5))
    shank = Manifold.cylinder(0.5, RADIUS, RADIUS, 60).translate((0, 0, -1.0))
    plain, found = without_threads(threaded() + head + shank)
    assert len(found) == 1
    whole = Manifold.cylinder(1.5, RADIUS, RADIUS, 96).translate((0, 0, -1.0)) + head
    assert (plain ^ whole).volume() == pytest.approx(whole.volume(), rel=5e-3)
    assert plain.volume() == pytest.approx(whole.volume(), rel=5e-3)


def test_what_is_no_thread_stays_as_it_is() -> None:
    ridges = [Manifold.cylinder(0.06, 0.3, 0.4, 60).translate((0, 0, 0.06 * k)) for k in range(8)]
    grooved = sum(ridges[1:], ridges[0])
    slotted = threaded() - Manifold.cube((0.15, 1.0, 2.0), True).translate((0.4, 0, 0))
    for body in (grooved, slotted, Manifold.cylinder(1.0, 0.4, 0.2, 60), Manifold.sphere(0.5, 60)):
        plain, found = without_threads(body)
        assert found == []
        assert plain.volume() == body.volume()


def test_a_spring_is_no_thread() -> None:
    turns, around, along = 5.0, 12, 240
    t = np.linspace(0, 2 * math.pi * turns, along + 1)[:, None]
    a = 2 * math.pi * np.arange(around) / around
    out = 0.4 + 0.05 * np.cos(a)
    points = np.stack([out * np.cos(t), out * np.sin(t), 0.03 * t + 0.05 * np.sin(a)], axis=-1)
    k, j = np.divmod(np.arange(along * around), around)
    right = (j + 1) % around
    one, two, three, four = k * around + j, k * around + right, (k + 1) * around + j, (k + 1) * around + right
    walls = [np.column_stack(c) for c in ((one, three, two), (two, three, four))]
    caps = [[(0, i, i + 1) for i in range(1, around - 1)]]
    last = along * around
    caps += [[(last, last + i + 1, last + i) for i in range(1, around - 1)]]
    body = closed(points.reshape(-1, 3), np.concatenate([*walls, *map(np.array, caps)]))
    assert abs(body.volume()) > 0
    assert without_threads(body)[1] == []


def test_waves_that_wind_around_a_rod_are_no_thread() -> None:
    """Too flat to have flanks, as of a corrugated tube: there was nothing to measure one by."""
    around, along = np.meshgrid(2 * np.pi * np.arange(64) / 64, np.linspace(0, 6, 289), indexing="ij")
    radius = 1 + 0.04 * np.sin(around + 2 * np.pi * along)
    rings = np.stack([radius * np.cos(around), radius * np.sin(around), along], axis=-1)
    middles = np.array([[0, 0, 0.0], [0, 0, 6.0]])
    a = np.arange(64 * 289).reshape(64, 289)
    b = np.roll(a, -1, axis=0)
    sides = [np.stack([a[:, :-1], b[:, :-1], b[:, 1:]], -1), np.stack([a[:, :-1], b[:, 1:], a[:, 1:]], -1)]
    low, high = np.full(64, a.size), np.full(64, a.size + 1)
    ends = [np.stack([b[:, 0], a[:, 0], low], -1), np.stack([a[:, -1], b[:, -1], high], -1)]
    faces = np.concatenate([one.reshape(-1, 3) for one in sides + ends])
    rod = closed(np.concatenate([rings.reshape(-1, 3), middles]), faces)
    assert rod.volume() == pytest.approx(6 * math.pi, rel=0.02)
    plain, found = without_threads(rod)
    assert found == []
    assert plain.volume() == pytest.approx(rod.volume())
