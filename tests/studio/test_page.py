"""The page in a browser: it shows the package's own distances, and edits them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, copies_of, load_assembly, mirrored
from partwright.assembly.file_text import to_text
from partwright.assembly.files import from_text
from partwright.export import export
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Extrusion,
    Frustum,
    HollowBox,
    HollowFrustum,
    Pipe,
    Profile,
    Quadric,
    Revolution,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)
from tests.studio.conftest import Page

PLATE = Profile([(-9, -6), (9, -6, 0.5), (9, 4), (-9, 4, -0.2)], [Profile.circle(2, (3, -1)).outline])
ROD = Pipe(((-15, 0, 0), (10, 0, 0, 6), (10, 12, 0, 5), (10, 12, 15)), 3)
SOLIDS = (
    Box((30, 20, 10)),
    Cylinder(8, 30),
    Cone(9, 20),
    Frustum(9, 4, 20),
    Sphere(11),
    Capsule(5, 20),
    Tube(10, 2, 20),
    Torus(12, 3),
    HollowBox((20, 24, 18), 3),
    HollowFrustum(12, 7, 2, 20),
    Extrusion(PLATE, 5),
    Extrusion(Profile.rectangle(20, 14, 4), 8, 12),
    Extrusion(Profile.rectangle(20, 14, 4), 8, top_fillet=3, bottom_chamfer=2),
    Revolution(PLATE.moved((14, 0))),
    Revolution(Profile([(0, -8), (9, -8), (9, 0, 0.6), (0, 7)]), 230),
    ROD,
    Pipe(((-15, 0, 0), (-15, 0, 15, 5), (-5, 0, 15, 5), (-5, 0, -9), (-5, 0, -12)), 3, 0.8),
)


def turned(seed: int, reach: float = 25.0) -> dict[str, tuple[float, ...]]:
    rng = np.random.default_rng(seed)
    return {"translation": tuple(rng.uniform(-reach, reach, 3)), "rotation": tuple(rng.normal(size=4))}


def many_kinds() -> Assembly:
    """Every kind of field, blends, copies, and groups in groups, in millimetres and off the origin."""
    rng = np.random.default_rng(4)
    bent = [
        Part(
            SuperFrustum(
                tuple(rng.uniform(8, 30, 3)),
                rng.random(),
                rng.random() * 2,
                rng.random() * 2,
                rng.random(),
                rng.random(),
            ),
            **turned(20 + i),
            blend=float(rng.random() * 4),
        )
        for i in range(8)
    ]
    solids = [Part(field, **turned(i), blend=i % 3) for i, field in enumerate(SOLIDS)]
    moves = (Similarity(translation=(0, 40, 0)), Similarity(rotation=(0, 0, 0, 1)))
    repeated = Part(Sphere(6), (20, 5, 0), blend=1.5, instances=moves)
    walls = Assembly(
        (
            Part(Quadric.plane((0, 0, 1), 12)),
            Part(Quadric.plane((0, 0, -1), 15), blend=2.0),
            Part(Quadric.sphere(18, (3, 2, 1)), **turned(40, 5)),
            Part(Quadric.cylinder(14), **turned(41, 5)),
        ),
        "intersection",
        blend=1.0,
    )
    cut = Assembly((Assembly(tuple(solids[:5])), solids[5], repeated), "difference", blend=2.0)
    whole = Assembly((*bent, cut, walls, *solids[6:]), unit="mm", up="z", name="kinds")
    return whole.translated((100, -30, 7))


def small() -> Assembly:
    """A body with a leg; 80 mm high."""
    body = Part(SuperFrustum((60, 40, 30), 0.4, 2.0), (0, 0, 40), name="body")
    leg = Part(Cylinder(5, 40), (20, 0, 10), blend=3.0, name="leg")
    return Assembly((body, leg), unit="mm", up="z", name="stool")


def test_the_graphics_card_finds_the_packages_distances(shown: Callable[[Assembly], Page]) -> None:
    assembly = many_kinds()
    page = shown(assembly)
    lower, upper = assembly.bounds()
    points = np.random.default_rng(0).uniform(lower - 20, upper + 20, (1000, 3))
    found = page.ask(
        """(points) => {
            const { renderer } = partwright.viewport, { scale, offset } = partwright.store.frame;
            const unit = Float32Array.from(points, (v, i) => v * scale + offset[i % 3]);
            return { scale, values: [...renderer.distances(unit)] };
        }""",
        points.ravel().tolist(),
    )
    off = np.abs(np.array(found["values"]) - assembly.distance(points) * found["scale"])
    assert off.max() < 1e-4
    assert not page.errors


def test_tiles_and_balls_that_leave_parts_out_change_no_pixel(shared: Callable[..., Page]) -> None:
    page = shared(many_kinds(), width=780, height=300)
    different = page.ask(
        """() => {
            const { renderer } = partwright.viewport, { gl } = renderer;
            const [width, height] = [renderer.canvas.width, renderer.canvas.height];
            const found = (everything) => {
                const pixels = new Uint32Array(width * height * 4);
                renderer.marchNow(everything);
                gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, pixels);
                return pixels;
            };
            const [culled, whole] = [found(false), found(true)];
            let [parts, seen] = [0, 0];
            for (let y = 1; y < height - 1; y++)
                for (let x = 1; x < width - 1; x++) {
                    const at = (y * width + x) * 4 + 3;
                    seen += whole[at] > 0;
                    // Along an edge the last bits of a distance decide on which side a ray ends.
                    let edge = false;
                    for (const off of [-1, 1, -width, width]) edge ||= whole[at + 4 * off] !== whole[at];
                    parts += !edge && whole[at] !== culled[at];
                }
            return { parts, seen, all: width * height };
        }"""
    )
    assert 0.1 * different["all"] < different["seen"] < 0.9 * different["all"]
    assert different["parts"] == 0


def test_a_shared_file_needs_no_network_and_is_small(shared: Callable[..., Page], tmp_path: Path) -> None:
    parts = tuple(Part(SuperFrustum((1, 1, 1), 0.5, 0.1), (2.0 * i, 0, 0)) for i in range(24))
    name = "</script><script>document.title='run'</script>"
    page = shared(Assembly(parts, name=name))
    assert (tmp_path / "shared.html").stat().st_size < 1_500_000
    assert all(url.startswith(("file:", "blob:", "data:")) for url in page.requests)
    assert page.ask("() => document.title") == f"{name} · Partwright"
    assert from_text(page.assembly()) == Assembly(parts, name=name)


def test_parts_are_selected_moved_and_bent_without_compiling(shown: Callable[[Assembly], Page]) -> None:
    page = shown(small())
    start = load_assembly_text(page)
    compiled = page.ask("() => partwright.viewport.renderer.compilations")
    uploads = page.ask("() => partwright.viewport.renderer.uploads")
    page.page.locator(".row[data-name=leg]").click()
    page.page.keyboard.press("g")
    page.page.keyboard.type("x12.5")
    assert "Move along X: 12.5 mm" in page.page.locator(".status").inner_text()
    page.page.keyboard.press("Enter")
    page.page.get_by_label("radius", exact=True).nth(1).fill("350")  # the slider, of 1000
    page.page.locator(".row[data-name=body]").click()
    taper = page.page.get_by_label("taper", exact=True).first
    taper.fill("1/4")
    taper.press("Enter")
    page.settle()
    edited = load_assembly_text(page)
    assert edited["leg"].translation == (32.5, 0, 10)
    assert edited["leg"].field.radius == pytest.approx(0.35 * 10, rel=1e-3)
    assert edited["body"].field.taper == 0.25
    assert page.ask("() => partwright.viewport.renderer.uploads") > uploads
    assert page.ask("() => partwright.viewport.renderer.compilations") == compiled
    for _ in range(3):
        page.page.keyboard.press("Control+z")
    assert load_assembly_text(page) == start
    for _ in range(3):
        page.page.keyboard.press("Control+y")
    assert load_assembly_text(page) == edited
    assert not page.errors


def test_a_drag_of_a_handle_is_one_step(shown: Callable[[Assembly], Page]) -> None:
    page = shown(small())
    page.settle()
    start = load_assembly_text(page)
    page.page.locator(".row[data-name=leg]").click()
    page.page.get_by_title("Move (W)").click()
    x, y = page.middle("[data-handle=move-z] .head")
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for i in range(1, 6):
        page.page.mouse.move(x, y - 8 * i)
    page.page.mouse.up()
    moved = np.subtract(load_assembly_text(page)["leg"].translation, start["leg"].translation)
    assert np.abs(moved[:2]).max() < 1e-9
    assert 5 < moved[2] < 30
    page.page.keyboard.press("Control+z")
    assert load_assembly_text(page) == start


def test_the_numbers_of_a_pipe_are_edited(shown: Callable[[Assembly], Page]) -> None:
    """A radius that its bends do not take is refused in words."""
    page = shown(Assembly((Part(ROD, name="pipe"),), unit="mm", up="z"))
    page.page.locator(".row[data-name=pipe]").click()
    assert page.page.get_by_label("Kind").input_value() == "pipe"
    for label, value in (("radius", "4"), ("thickness", "0.5"), ("radius", "5.5")):
        page.page.get_by_label(label, exact=True).first.fill(value)
        page.page.keyboard.press("Enter")
    assert "bends have to be wider" in page.page.locator("body").inner_text()
    assert load_assembly_text(page)["pipe"].field == Pipe(ROD.path, 4, 0.5)
    page.settle()
    assert not page.errors


def test_a_hole_is_drilled_and_measured(shown: Callable[[Assembly], Page]) -> None:
    page = shown(small())
    page.page.get_by_role("button", name="Add").click()
    page.page.get_by_role("menuitem", name="cylinder").click()
    page.page.get_by_label("radius", exact=True).first.fill("6")
    page.page.get_by_label("radius", exact=True).first.press("Enter")
    for axis, value in zip("XYZ", (-10, 0, 40), strict=True):
        field = page.page.get_by_label(axis, exact=True).first
        field.fill(str(value))
        field.press("Enter")
    page.page.get_by_label("height", exact=True).first.fill("100")
    page.page.get_by_label("height", exact=True).first.press("Enter")
    page.page.get_by_role("button", name="Taken away").click()
    drilled = load_assembly_text(page)
    assert drilled.operation == "difference"
    points = np.array([[-10.0, 0, 40], [-10, 5, 40], [-10, 7, 40], [20, 0, 0]])
    assert (drilled.distance(points) < 0).tolist() == [False, False, True, True]
    # From above, straight through beside the hole: the body is 30 mm high, and 2 mm thicker on either side.
    page.page.keyboard.press("7")
    page.page.keyboard.press("m")
    page.page.get_by_role("button", name="Diameter").click()
    page.settle()
    at = page.ask(
        """() => {
            const { viewport, store } = partwright, box = viewport.canvas.getBoundingClientRect();
            const [w, h] = [box.width, box.height], { eye, right, up, back, half } = viewport.view;
            const p = [10, 12, 57].map((v, i) => v * store.frame.scale + store.frame.offset[i] - eye[i]);
            const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], depth = -dot(p, back);
            const x = dot(p, right) / depth / half[0], y = dot(p, up) / depth / half[1];
            return [box.left + (x + 1) / 2 * w, box.top + (1 - y) / 2 * h];
        }"""
    )
    page.page.mouse.click(*at)
    page.page.get_by_role("button", name="Thickness").click()
    page.page.mouse.click(*at)
    labels = page.ask("() => partwright.viewport.measurements.map((m) => m.label)")
    assert labels == ["⌀ 34 mm", "34 mm"]


def test_the_size_is_that_of_the_surface(shown: Callable[[Assembly], Page]) -> None:
    """Not of what is taken away from it, and not of corners that a turned or a cut part has not."""
    turned_ball = Part(Sphere(10), (40, 0, 0), (0.8, 0.2, 0.5, -0.3))
    block = Part(Box((30, 20, 10)))
    slot = Part(Box((400, 6, 300)))
    halved = Assembly((Part(Box((40, 40, 16))), Part(Box((100, 100, 100)), (0, 0, 52))), "difference")
    for parts, operation, size in (
        ((block, turned_ball), "union", "≈ 65 × 20 × 20 mm"),
        ((halved, Part(Sphere(1))), "union", "≈ 40 × 40 × 10 mm"),
        ((block, slot), "difference", "30 × 20 × 10 mm"),
    ):
        page = shown(Assembly(parts, operation, unit="mm"))
        sides = page.page.locator("dt:text-is('Size') + dd")
        sides.filter(has_text="mm").wait_for()
        assert sides.text_content() == size
    # The frame is that of what is there, so that it fills the picture.
    assert np.isclose(page.ask("() => partwright.store.frame.scale"), 1.8 / 30)
    view = page.ask("() => partwright.viewport.view")
    corners = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * [1.8, 1.2, 0.6] - view["eye"]
    across = (corners @ np.transpose([view["right"], view["up"]])) / (corners @ view["back"])[:, None]
    assert np.isclose(np.abs(across / view["half"]).max(), 0.92, atol=1e-3)


def test_what_is_downloaded_is_read_by_the_package(shown: Callable[[Assembly], Page], tmp_path: Path) -> None:
    import trimesh

    from tests.export.opengl import run_sdf

    assembly = small()
    page = shown(assembly)

    def download(kind: str) -> Path:
        page.page.get_by_role("button", name="Download").click()
        with page.page.expect_download() as begun:
            page.page.get_by_role("menuitem", name=kind).click()
        path = tmp_path / begun.value.suggested_filename
        begun.value.save_as(path)
        return path

    assert load_assembly(download(".json")) == assembly
    points = np.random.default_rng(1).uniform(-60, 60, (1000, 3)).astype(np.float32)
    values = run_sdf(download(".glsl").read_text(), points)
    assert np.abs(values - assembly.distance(points)).max() < 1e-3
    for suffix, scale in ((".stl", 1.0), (".glb", 1e-3)):
        mesh = trimesh.load_mesh(download(suffix))
        mesh.merge_vertices(merge_norm=True)
        assert mesh.is_watertight
        x, y, z = mesh.vertices.T / scale
        surface = np.stack([x, y, z] if suffix == ".stl" else [x, -z, y], axis=1)  # glTF has y up
        assert np.abs(assembly.distance(surface)).max() < 0.3
        assert 60 * 40 * 30 < mesh.volume / scale**3 < 64 * 44 * 34 + 40 * 9**2
    assert download(".png").read_bytes().startswith(b"\x89PNG")


def test_edits_are_there_again_when_the_page_is_opened_again(shared: Callable[..., Page]) -> None:
    page = shared(small())
    page.page.locator(".row[data-name=leg]").click()
    page.page.keyboard.press("Delete")
    edited = load_assembly_text(page)
    page.page.reload()
    page.wait("() => !!window.partwright")
    assert load_assembly_text(page) == edited
    page.page.get_by_role("button", name="Undo them").click()
    assert load_assembly_text(page) == small()


def test_a_mirrored_part_is_the_mirror_image(shown: Callable[[Assembly], Page]) -> None:
    assembly = many_kinds()
    page = shown(assembly)
    points = np.random.default_rng(2).uniform(-60, 60, (500, 3)) + assembly.bounds().mean(axis=0)
    for axis in range(3):
        found = page.ask(
            """(axis) => {
                const { store, commands } = partwright, { frame } = store;
                const middle = -frame.offset[axis] / frame.scale;
                store.select(store.root.children.map((node) => node.id));
                commands.mirror(axis);
                const made = store.selected;
                store.commit({ ...store.root, children: made }, "only the copies");
                const text = partwright.text();
                store.undo();
                store.undo();
                return { text, middle };
            }""",
            axis,
        )
        flipped = points.copy()
        flipped[:, axis] = 2 * found["middle"] - flipped[:, axis]
        off = np.abs(from_text(found["text"]).distance(flipped) - assembly.distance(points))
        assert off.max() < 1e-3


def test_copies_of_groups_are_where_their_moves_take_them(shown: Callable[[Assembly], Page]) -> None:
    group = Assembly(tuple(part for part in many_kinds().parts if part.field.kind != "quadric"))
    move = Similarity(1.0, (0.5, 0.5, -0.5, 0.5), (70, 5, -20))
    made = Assembly((group, *copies_of(group, [move]), mirrored(group, "y", 30)))
    assert to_text(made).count('"kind"') == len(group)
    read = load_assembly_text(shown(made))
    assert [part.name for part in read.parts] == [part.name for part in made.parts]
    points = np.random.default_rng(5).uniform(-120, 120, (500, 3))
    np.testing.assert_allclose(read.distance(points), made.distance(points), atol=1e-3)


def test_without_webgl_the_page_says_so_and_still_edits(
    new_page: Callable[..., Page], tmp_path: Path
) -> None:
    export(small(), tmp_path / "small.html")
    page = new_page()
    page.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.page.goto((tmp_path / "small.html").as_uri())
    page.wait("() => !!window.partwright")
    assert "WebGL" in page.page.get_by_role("alert").inner_text()
    page.page.locator(".row[data-name=leg]").click()
    page.page.keyboard.press("Delete")
    assert [part.name for part in load_assembly_text(page).parts] == ["body"]


def test_a_file_that_is_no_assembly_is_refused_in_words(shown: Callable[[Assembly], Page]) -> None:
    page = shown(small())
    before = page.assembly()
    page.ask(
        """() => partwright.openFile(
            new File(['{"format": "partwright-assembly", "version": 1'], "cut.json")
        )"""
    )
    assert "cut.json: This is not complete JSON" in page.page.locator(".toast.error").inner_text()
    assert page.assembly() == before


def load_assembly_text(page: Page) -> Assembly:
    text = page.assembly()
    assert json.loads(text)["format"] == "partwright-assembly"
    return from_text(text)
