"""Baked colours in the page: the shader's are the package's, edits keep them, and nothing of them is lost."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.files import from_text
from partwright.fields import Box, Cylinder, SuperFrustum, Tube
from partwright.meshing import mesh_assembly
from partwright.textures import PartMap, load_colours, part_map
from partwright.textures.likeness import map_normals
from tests.studio.conftest import Page, Server

MUG = Assembly(
    (
        Part(Tube(30, 4, 70), (0, 0, 35), name="wall"),
        Part(Cylinder(30, 6), (0, 0, 3), name="floor"),
        Part(SuperFrustum((9, 7, 50), 0.9, 1, bulge=0.8), (-38, 0, 35), (1, 0, 0.1, 0.2), name="handle"),
    ),
    unit="mm",
    up="z",
)


def mapped(assembly: Assembly) -> Assembly:
    """With a smooth map of its own for each part: on the inner side of the tube in other colours."""
    v, u = np.meshgrid(*[np.linspace(0, 1, 64)] * 2, indexing="ij")
    for i, part in enumerate(assembly.parts):
        waves = [np.sin(3 * u + 2 * i) * np.cos(4 * v + c) for c in range(3)]
        image = np.stack([127 + 100 * wave for wave in waves], axis=-1)
        if part.name == "wall":
            image = np.concatenate([image, 255 - image], axis=1)
        metadata = {"texture": PartMap(image.round().astype(np.uint8)).text()}
        assembly = assembly.replace_part(
            part.name, Part(part.field, part.translation, part.rotation, name=part.name, metadata=metadata)
        )
    return assembly


# Of pixels of the picture's buffer: where it is in own units, colour, part, and normal, not of unit length.
SEEN = """() => {
    const { renderer } = partwright.viewport, { gl } = renderer, { frame } = partwright.store;
    const [width, height] = [renderer.canvas.width, renderer.canvas.height];
    const pixels = new Uint32Array(width * height * 4);
    renderer.marchNow(false);
    gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, pixels);
    const floats = new Float32Array(pixels.buffer);
    const { eye, right, up, back, half } = partwright.viewport.view, rows = [];
    for (let n = 0; n < width * height; n += 7) {
        if (!pixels[4 * n + 3]) continue;
        const x = (2 * ((n % width) + 0.5) / width - 1) * half[0];
        const y = (2 * (Math.floor(n / width) + 0.5) / height - 1) * half[1];
        const ray = [0, 1, 2].map((i) => right[i] * x + up[i] * y - back[i]), size = Math.hypot(...ray);
        const p = ray.map((r, i) => (eye[i] + (floats[4 * n] * r) / size - frame.offset[i]) / frame.scale);
        const c = pixels[4 * n + 2], shorts = new Int16Array(pixels.buffer, 4 * (4 * n + 1), 2);
        const [a, b] = [shorts[0] / 32767, shorts[1] / 32767], z = 1 - Math.abs(a) - Math.abs(b);
        const fold = (v, w) => (z < 0 ? (1 - Math.abs(w)) * (v < 0 ? -1 : 1) : v);
        const colour = [c & 255, (c >> 8) & 255, (c >> 16) & 255];
        rows.push([...p, ...colour, pixels[4 * n + 3] - 1, fold(a, b), fold(b, a), z]);
    }
    return rows;
}"""


def check_picture(page: Page, assembly: Assembly) -> None:
    """Colours of the shader against the maps, at the places that it shows."""
    page.wait("() => partwright.viewport.maps.maps?.count === 3")
    rows = np.array(page.ask(SEEN))
    assert len(rows) > 1000
    seen = 0
    for i, part in enumerate(assembly.parts):
        mine = rows[rows[:, 6] == i]
        if len(mine) < 20:
            continue
        seen += 1
        local = Similarity(1.0, part.rotation, part.translation).inverse()(mine[:, :3])
        off = np.abs(part_map(part).at(part.field, local) - mine[:, 3:6]).max(axis=1)
        # Where the outer and the inner side of a wall meet, a hair decides which it is.
        assert np.quantile(off, 0.97) < 3
    assert seen >= 2


def test_the_shader_shows_the_maps_and_edits_keep_them(shared: Callable[..., Page], tmp_path: Path) -> None:
    assembly = mapped(MUG)
    page = shared(assembly, width=800, height=500, device_scale_factor=1)
    check_picture(page, assembly)
    compiled = page.ask("() => partwright.viewport.renderer.compilations")
    page.page.locator(".row[data-name=handle]").click()
    page.page.keyboard.press("g")
    page.page.keyboard.type("z12")
    page.page.keyboard.press("Enter")
    bulge = page.page.get_by_label("bulge", exact=True).first
    bulge.fill("0.4")
    bulge.press("Enter")
    edited = from_text(page.assembly())
    assert edited["handle"].metadata == assembly["handle"].metadata
    assert edited["handle"].field.bulge == 0.4
    check_picture(page, edited)
    assert page.ask("() => partwright.viewport.renderer.compilations") == compiled
    # The page's own GLB has them as colours of vertices.
    page.page.get_by_role("button", name="Download").click()
    with page.page.expect_download() as begun:
        page.page.get_by_role("menuitem", name=".glb").click()
    begun.value.save_as(tmp_path / "a.glb")
    colours = load_colours(tmp_path / "a.glb")
    x, y, z = colours.vertices.T * 1e3
    points = np.stack([x, -z, y], axis=1)
    part = edited["floor"]
    near = (np.abs(part.field(points - part.translation)) < 0.1) & (points[:, 2] < 1)
    found = colours.at(colours.vertices[near])
    off = np.abs(found - part_map(part).at(part.field, points[near] - part.translation))
    assert np.median(off) < 3
    # A format that holds none is told of.
    assert page.page.locator(".toast").count() == 0
    page.page.get_by_role("button", name="Download").click()
    with page.page.expect_download():
        page.page.get_by_role("menuitem", name=".glsl").click()
    page.page.locator(".toast", has_text="Without the maps of 3 parts").wait_for()
    # And the list's colours come back where they are asked for.
    page.page.get_by_role("button", name="View").click()
    page.page.get_by_role("menuitem", name="Parts in plain colours").click()
    assert len({tuple(row[3:6]) for row in page.ask(SEEN)}) < 40
    assert not page.errors


def with_normals(assembly: Assembly) -> Assembly:
    """With a normal map of its own for each part, of another image on the inner side of the tube."""
    v, u = np.meshgrid(*[np.linspace(0, 1, 128)] * 2, indexing="ij")
    for i, part in enumerate(assembly.parts):
        x, y = 0.5 * np.sin(9 * u + i), 0.5 * np.cos(7 * v - 5 * u)
        image = 127.5 * (1 + np.stack([x, y, np.sqrt(1 - x * x - y * y)], axis=-1))
        if part.name == "wall":
            image = np.concatenate([image, image[::-1, ::-1]], axis=1)
        metadata = {**part.metadata, "normals": PartMap(image.round().astype(np.uint8)).text()}
        assembly = assembly.replace_part(part.name, dataclasses.replace(part, metadata=metadata))
    return assembly


def test_the_shader_bends_normals_as_the_package_does(shared: Callable[..., Page]) -> None:
    assembly = with_normals(MUG)
    page = shared(assembly, width=800, height=500, device_scale_factor=1)
    page.wait("() => partwright.viewport.maps.maps?.count === 3")
    rows = np.array(page.ask(SEEN))
    found = rows[:, 7:] / np.linalg.norm(rows[:, 7:], axis=1, keepdims=True)
    points, step = rows[:, :3], 0.02
    slope = [assembly.distance(points + move) - assembly.distance(points - move) for move in step * np.eye(3)]
    smooth = np.stack(slope, axis=1) / np.linalg.norm(slope, axis=0)[:, None]
    wanted = map_normals(assembly, points, smooth)

    def angles(normals: np.ndarray) -> np.ndarray:
        return np.degrees(np.arccos(np.clip((normals * wanted).sum(axis=1), -1, 1)))

    assert np.median(angles(smooth)) > 15
    off = angles(found)
    for i in range(3):
        mine = off[rows[:, 6] == i]
        assert len(mine) < 20 or np.quantile(mine, 0.9) < 3  # creases have normals of either side
    # Plain colours are of smooth parts.
    page.page.get_by_role("button", name="View").click()
    page.page.get_by_role("menuitem", name="Parts in plain colours").click()
    rows = np.array(page.ask(SEEN))
    plain = rows[:, 7:] / np.linalg.norm(rows[:, 7:], axis=1, keepdims=True)
    assert np.median((plain * smooth).sum(axis=1)) > 0.999
    assert not page.errors


def test_what_is_no_image_is_no_harm(shown: Callable[[Assembly], Page]) -> None:
    bad = Part(Box((1, 1, 1)), name="bad", metadata={"texture": "data:image/png;base64,AAAA"})
    other = Part(Box((1, 1, 1)), (2, 0, 0), name="other", metadata={"texture": "https://example.com/a.png"})
    page = shown(Assembly((bad, other)))
    page.settle()
    assert page.ask("() => partwright.viewport.maps.maps") is None
    assert not page.errors
    assert all(url.startswith(("file:", "blob:", "data:")) for url in page.requests)


def test_a_lost_context_comes_back_with_all_that_it_showed(shared: Callable[..., Page]) -> None:
    page = shared(mapped(MUG), width=800, height=400, smooth=True)
    page.wait("() => partwright.viewport.maps.maps?.count === 3")
    page.page.locator(".row[data-name=handle]").click()
    page.settle()
    assert page.ask("() => partwright.viewport.renderer.complete") == 4  # pictures that it is smoothed of
    look = """() => {
        const { renderer } = partwright.viewport, { gl } = renderer;
        renderer.redraw(); renderer.draw();
        const [w, h] = [renderer.canvas.width, renderer.canvas.height], pixels = new Uint8Array(4 * w * h);
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return [...pixels.filter((_, i) => i % 64 < 3)];
    }"""
    before = np.array(page.ask(look))
    page.ask(
        """() => {
            window.lose = partwright.viewport.renderer.gl.getExtension("WEBGL_lose_context");
            window.lose.loseContext();
        }"""
    )
    page.wait("() => partwright.viewport.renderer.gl.isContextLost() && !partwright.viewport.renderer.ready")
    page.ask("() => window.lose.restoreContext()")
    page.wait("() => partwright.viewport.renderer.ready")
    page.settle()
    assert np.abs(np.array(page.ask(look)) - before).mean() < 0.5
    assert not page.errors


def test_colours_are_baked_from_the_page_and_kept_once(
    tmp_path: Path,
    serve: Callable[..., Server],
    new_page: Callable[..., Page],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("uvicorn", reason="the studio's server needs uvicorn")
    monkeypatch.setattr("partwright.textures.sightings._SIDE", 128)  # pixels of 384, as in tests/textures
    mesh = mesh_assembly(MUG, 64)
    red = mesh.vertices[:, 2] > 40
    mesh.visual.vertex_colors = np.where(red[:, None], [200, 40, 30, 255], [30, 60, 200, 255]).astype(
        np.uint8
    )
    mesh.export(tmp_path / "mug.ply")
    MUG.save(tmp_path / "mug.json")
    server = serve("mug.json", "--shape=mug.ply")
    page = new_page().open(server.url)
    page.wait("() => live.state?.input === 'mug.ply' && partwright.viewport.renderer.hasInput")
    page.page.get_by_role("button", name="Bake its colours").click()
    shown = "() => partwright.store.undoLabel === 'Bake colours' && partwright.viewport.maps.maps?.count >= 3"
    page.wait(shown)
    baked = from_text(page.assembly())
    top, low = (part_map(baked["wall"]).at(baked["wall"].field, np.array([[30.0, 0, z]])) for z in (25, -25))
    assert np.abs(top - [200, 40, 30]).max() < 20
    assert np.abs(low - [30, 60, 200]).max() < 20
    for _ in range(3):
        page.page.locator(".row[data-name=handle]").click()
        page.page.keyboard.press("g")
        page.page.keyboard.type("z1")
        page.page.keyboard.press("Enter")
    page.wait("() => !live.link.waiting.length")
    assert "partwright-image:" not in page.assembly()
    edited = from_text(page.assembly())
    (journal,) = (tmp_path / "state").rglob("*.jsonl")
    images = [json.loads(line) for line in journal.read_text().splitlines() if '"image"' in line]
    # Three of colours, and of normals where those pay; each once, however often its part is moved.
    assert 3 <= len(images) == len({image["data"] for image in images}) <= 6
    assert journal.stat().st_size < 1.2 * sum(len(image["data"]) for image in images) + 40_000
    page.page.reload()
    page.wait("() => !!window.live && live.link.revision > 3 && partwright.viewport.maps.maps?.count >= 3")
    assert from_text(page.assembly()) == edited
    page.page.keyboard.press("Control+z")
    assert from_text(page.assembly())["handle"].metadata == baked["handle"].metadata
    assert not page.errors


def test_images_are_taken_out_of_texts_and_put_back() -> None:
    from partwright.assembly.file_text import to_text
    from partwright.studio.images import Images

    images = Images()
    text = to_text(mapped(MUG))
    short, new = images.taken_out(text)
    assert len(new) == 3
    assert len(short) < 3000
    assert images.put_back(short) == text
    again: Any = images.taken_out(text)
    assert again == (short, [])
