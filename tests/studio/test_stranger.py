"""What somebody does who sees the page for the first time, and where such people stumbled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.files import from_text
from partwright.fields import Box, Cylinder, Tube
from tests.studio.conftest import Page

MOVES = tuple(Similarity(translation=t) for t in ((60, 0, 0), (0, 60, 0), (60, 60, 0)))
STOOL = Assembly(
    (
        Part(Box((90, 90, 10)), (30, 30, 50), name="seat"),
        Part(Cylinder(4, 50), (0, 0, 20), name="leg", instances=MOVES),
    ),
    unit="mm",
    up="z",
)


def test_one_of_four_legs_that_are_copies_is_removed(shown: Callable[[Assembly], Page]) -> None:
    page = shown(STOOL)
    page.page.locator(".row[data-name=leg]").click()
    page.page.keyboard.press("Delete")
    assert len(from_text(page.assembly())) == 1
    page.page.get_by_role("button", name="Keep the others").click()
    apart = from_text(page.assembly())
    assert [part.name for part in apart.parts] == ["seat", "leg", "leg_02", "leg_03", "leg_04"]
    points = np.random.default_rng(0).uniform(-20, 90, (400, 3))
    assert np.allclose(apart.distance(points), STOOL.distance(points))
    page.page.locator(".row[data-name=leg_03]").click()
    page.page.keyboard.press("Delete")
    three = from_text(page.assembly())
    assert len(three) == 4
    assert three.distance(np.array([[0.0, 60, 10]]))[0] > 5
    for _ in range(2):
        page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == STOOL
    assert not page.errors


def test_a_hole_is_drilled_where_the_surface_is_clicked(shown: Callable[[Assembly], Page]) -> None:
    mug = Assembly(
        (Part(Tube(30, 4, 80), name="wall"), Part(Box((10, 10, 10)), (0, 0, -36))), unit="mm", up="z"
    )
    page = shown(mug)
    page.page.keyboard.press("1")  # from the front: the wall at y = -30
    page.settle()
    page.page.get_by_role("button", name="Add", exact=True).click()
    page.page.get_by_role("menuitem", name="Hole, where you click").click()
    page.page.mouse.click(*page.middle(".viewport"))
    drilled = from_text(page.assembly())
    assert drilled.operation == "difference"
    hole = drilled["hole"]
    assert abs(hole.translation[0]) < 1
    axis = Similarity(1.0, hole.rotation)(np.array([[0.0, 0, 1]]))[0]
    assert np.abs(np.abs(axis) - [0, 1, 0]).max() < 0.1
    # Through this wall, and not through the other one.
    x, _, z = hole.translation
    walls = drilled.distance(np.array([[x, -28.0, z], [x, 28.0, z], [x + 2 * hole.field.radius, -27.5, z]]))
    assert (walls < 0).tolist() == [False, True, True]
    page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == mug
    assert not page.errors


def test_what_is_added_is_seen_at_once(shown: Callable[[Assembly], Page]) -> None:
    page = shown(STOOL)
    page.page.get_by_role("button", name="Add", exact=True).click()
    page.page.get_by_role("menuitem", name="sphere").click()
    page.settle()
    new = from_text(page.assembly())["sphere"]
    assert abs(STOOL.distance(np.array([new.translation]))[0]) < 1  # on the surface
    seen = page.ask(
        """() => {
            const { viewport, store } = partwright, { clientWidth: w, clientHeight: h } = viewport.element;
            return store.program.parts[viewport.hitAt({ x: w / 2, y: h / 2 }).part].name;
        }"""
    )
    assert seen == "sphere"


def test_copies_in_a_difference_stay_what_they_are(shown: Callable[[Assembly], Page]) -> None:
    holes = Part(Cylinder(3, 30), (10, 10, 50), name="hole", instances=(Similarity(translation=(30, 30, 0)),))
    plate = Assembly((STOOL["seat"], holes), "difference", unit="mm")
    cut_first = Assembly(
        (dataclasses.replace(STOOL["leg"], name="legs"), STOOL["seat"]), "difference", unit="mm"
    )
    points = np.random.default_rng(0).uniform(-20, 90, (400, 3))
    for assembly, name in ((plate, "hole"), (cut_first, "legs")):
        page = shown(assembly)
        page.page.locator(f".row[data-name={name}]").click()
        page.page.get_by_role("button", name="Repeat").click()
        page.page.get_by_role("menuitem", name="Each a part of its own").click()
        apart = from_text(page.assembly())
        assert all(not part.instances for part in apart.parts)
        assert np.allclose(apart.distance(points), assembly.distance(points))
