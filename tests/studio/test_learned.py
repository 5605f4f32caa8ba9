"""Learned parts in the page: as meshes that follow the edits, with other forms from the server."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.errors import UnsupportedFormatError
from partwright.export import export
from partwright.fields import Box
from tests.studio.conftest import Page, Server

pytest.importorskip("torch", reason="learned parts need torch")


@pytest.fixture(scope="module")
def car() -> Assembly:
    from partwright.partsdf.sources import open_source

    source = open_source("cars:0")
    return source.assembly(source.shape).scaled(100.0)


# The nearest of the mesh's vertices to each of some places, own units.
SPREAD = """(name) => {
    const { learned } = partwright.viewport, { parts } = partwright.store.program, rows = [];
    const part = parts.findIndex((one) => one.name === name);
    for (let i = 0; i < learned.owners.length; i++)
        if (learned.owners[i] === part) rows.push([...learned.places.subarray(3 * i, 3 * i + 3)]);
    return rows;
}"""


def vertices(page: Page, name: str) -> np.ndarray:
    return np.array(page.ask(SPREAD, name))


def test_a_shared_file_shows_learned_parts(
    car: Assembly, shared: Callable[..., Page], tmp_path: Path
) -> None:
    roof = Part(Box((20, 5, 20)), (0, 60, 0), name="rack")
    page = shared(Assembly((*car.parts, roof), up="y"), width=1000, height=500)
    assert (tmp_path / "shared.html").stat().st_size < 1_500_000
    page.settle()
    for part in car.parts:
        # Of the mesh at 64 cells, on the surface that the package knows.
        places = vertices(page, part.name)
        assert len(places) > 50
        off = np.abs(car.part_distances(places)[[p.name for p in car.parts].index(part.name)])
        assert np.quantile(off, 0.9) < 2.0
    at = page.ask(
        """() => {
            const { viewport, store } = partwright, box = viewport.element.getBoundingClientRect();
            for (let y = 5; y < box.height; y += 6) for (let x = 5; x < box.width; x += 6) {
                const hit = viewport.hitAt({ x, y });
                const name = hit && store.program.parts[hit.part].name;
                if (name?.includes("wheel")) return [name, box.left + x, box.top + y];
            }
        }"""
    )
    wheel = at[0]
    page.page.mouse.click(*at[1:])
    assert page.ask("() => partwright.store.selectedParts.map((p) => p.name)") == [wheel]
    before = vertices(page, wheel)
    page.page.keyboard.press("g")
    page.page.keyboard.type("y7")
    page.page.keyboard.press("Enter")
    assert np.abs(vertices(page, wheel) - before - [0, 7, 0]).max() < 1e-3
    # What would be shown wrongly is refused.
    text = page.assembly()
    page.page.get_by_role("button", name="Taken away").click()
    assert "neither cut nor taken away" in page.page.locator(".toast.error").inner_text()
    assert page.assembly() == text
    page.page.get_by_role("button", name="Download").click()
    with page.page.expect_download() as begun:
        page.page.get_by_role("menuitem", name=".stl").click()
    begun.value.save_as(tmp_path / "car.stl")
    import trimesh

    mesh = trimesh.load_mesh(tmp_path / "car.stl")
    places = np.concatenate([vertices(page, part.name) for part in car.parts])
    rack = [[-10, 57.5, -10], [10, 62.5, 10]]
    expected = np.array([np.minimum(places.min(0), rack[0]), np.maximum(places.max(0), rack[1])])
    assert np.abs(mesh.bounds - expected).max() < 0.1
    assert not page.errors


def test_learned_parts_that_are_cut_are_refused(car: Assembly, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormatError, match="whole"):
        export(car - Part(Box((10, 10, 10))), tmp_path / "a.html")


def test_one_is_changed_and_the_others_follow(
    car: Assembly, tmp_path: Path, serve: Callable[..., Server], new_page: Callable[..., Page]
) -> None:
    car.save(tmp_path / "car.json")
    page = new_page(1100, 600).open(serve("car.json").url)
    page.wait("() => !!partwright.viewport.learned && !live.decoding")
    names = [part.name for part in car.parts]
    wheel = next(name for name in names if "wheel" in name)
    body = next(name for name in names if "wheel" not in name)
    before = vertices(page, body)
    page.page.locator(f".row[data-name={wheel}]").click()
    page.page.keyboard.press("s")
    page.page.keyboard.type("1.4")
    page.page.keyboard.press("Enter")
    page.wait(
        "(n) => partwright.viewport.learned.places.length && !live.decoding && partwright.store.undoLabel",
        None,
    )
    scaled = from_text(page.assembly())
    assert np.allclose(scaled[wheel].field.half_lengths, 1.4 * np.array(car[wheel].field.half_lengths))
    page.wait(
        "(n) => partwright.viewport.meshes.get(n[0]).halfLengths[0] > n[1]",
        [wheel, 1.39 * car[wheel].field.half_lengths[0]],
    )
    after = vertices(page, body)
    assert before.shape != after.shape or np.abs(before - after).max() > 1e-3  # the body has followed
    page.page.get_by_role("button", name="Sample anew").click()
    page.wait("(l) => partwright.store.undoLabel === l", f"Sample {wheel}")
    sampled = from_text(page.assembly())
    assert sampled[wheel].field.latent != scaled[wheel].field.latent
    assert sampled[body] == scaled[body]
    page.page.get_by_label("Take it from").select_option(index=3)
    page.wait("(l) => partwright.store.undoLabel === l", f"Swap {wheel}")
    swapped = from_text(page.assembly())
    assert swapped[wheel].field.latent != sampled[wheel].field.latent
    for _ in range(3):
        page.page.keyboard.press("Control+z")
    assert from_text(page.assembly()) == car
    page.wait("() => !live.decoding && !live.link.waiting.length")
    assert not page.errors
