"""Pictures: right places, right colours, nothing cropped, whole files."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from partwright.assembly import Assembly, Part
from partwright.assembly.palette import palette
from partwright.errors import EmptyShapeError, OutputError, SettingError
from partwright.fields import Box, Cylinder, Quadric, Sphere
from partwright.meshing import mesh_assembly
from partwright.render import Camera, preview, render_mesh, sheet, turntable, write_png
from partwright.render.camera import picture_axes
from partwright.render.deviation_map import add_legend, deviation_colours, round_limit
from partwright.render.part_colours import surface_parts
from partwright.render.raycast import Scene, cast
from partwright.render.shading import BACKGROUND
from partwright.shapes import load_shape
from partwright.shapes.corner_normals import corner_normals


def seen(image: np.ndarray) -> np.ndarray:
    """Pixels that are clearly not background or shadow: the ones with a hue."""
    spread = image.max(axis=-1).astype(int) - image.min(axis=-1)
    return spread > 40


@settings(max_examples=25)
@given(
    azimuth=st.floats(-180, 180),
    elevation=st.floats(-80, 80),
    field_of_view=st.floats(5, 90),
    up=st.sampled_from(["x", "y", "z", "-x", "-y", "-z"]),
    stretch=st.tuples(*[st.floats(0.01, 100)] * 3),
)
def test_everything_is_in_the_picture_and_touches_its_margin(
    azimuth, elevation, field_of_view, up, stretch
) -> None:
    points = np.random.default_rng(0).normal(size=(50, 3)) * stretch + 1000
    camera = Camera(azimuth, elevation, field_of_view, up, margin=0.1)
    view = camera.fitted(points, 300, 200)
    depth = (view.eye - points) @ view.back
    nearest = 0.5 * np.ptp(points, axis=0).max()
    assert depth.min() > 0.999 * nearest
    x = (points - view.eye) @ view.right / depth / view.half[0]
    y = (points - view.eye) @ view.up / depth / view.half[1]
    widest = max(np.abs(x).max(), np.abs(y).max())
    assert widest <= 0.8 + 1e-6
    assert widest == pytest.approx(0.8, abs=1e-6) or depth.min() < 1.001 * nearest
    np.testing.assert_allclose(np.stack([view.right, view.up, view.back]) @ view.back, [0, 0, 1], atol=1e-12)
    assert view.up @ camera.up_axis > 0


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_picture_axes_are_right_handed(up: str) -> None:
    right, above, front = picture_axes(up)
    np.testing.assert_allclose(np.cross(right, above), front)


def test_rays_meet_a_sphere_where_they_should() -> None:
    mesh = trimesh.creation.icosphere(5, 1.0).apply_translation([10, 20, 30])
    view = Camera().fitted(mesh.vertices, 64, 64)
    hits = cast(Scene(mesh.vertices, mesh.faces), view, view.rays(64, 64))
    outward = hits.point - [10, 20, 30]
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0, atol=2e-3)
    assert (np.einsum("nd,nd->n", hits.normal, outward) > 0.99).all()
    # The disc of a sphere that fills 84 % of the height.
    assert len(hits.pixel) / 64**2 == pytest.approx(np.pi / 4 * 0.84**2, rel=0.03)


def test_creases_stay_sharp_and_smooth_surfaces_smooth() -> None:
    box = trimesh.creation.box()
    flat = np.repeat(box.face_normals[:, None], 3, 1)
    np.testing.assert_allclose(corner_normals(box.vertices, box.faces), flat)
    cylinder = trimesh.creation.cylinder(1.0, 2.0, sections=64)
    normals = corner_normals(cylinder.vertices, cylinder.faces)
    side = np.abs(cylinder.face_normals[:, 2]) < 0.5
    corners = cylinder.triangles[side][..., :2]
    np.testing.assert_allclose(normals[side][..., :2], corners, atol=0.05)
    np.testing.assert_allclose(normals[~side], np.repeat(cylinder.face_normals[~side, None], 3, 1), atol=1e-6)


def test_a_mesh_is_drawn_in_its_colour_on_the_background() -> None:
    image = render_mesh(trimesh.creation.box(), size=(120, 90), colours=(220, 40, 40))
    assert image.shape == (90, 120, 3)
    assert image.dtype == np.uint8
    np.testing.assert_allclose(image[0, 0], BACKGROUND, atol=2)
    red = image[seen(image)]
    assert (red[:, 0] > red[:, 1] + 30).all()
    assert 0.2 < seen(image).mean() < 0.7


def test_faces_take_their_own_colours() -> None:
    box = trimesh.creation.box()
    colours = np.where(box.face_normals[:, 2:] > 0.5, (30, 200, 30), (200, 30, 30))
    image = render_mesh(box, Camera(elevation=89), (60, 60), colours, ground=False)
    centre = image[30, 30].astype(int)
    assert centre[1] > centre[0] + 50


def test_faces_turned_to_the_light_are_brighter() -> None:
    image = render_mesh(trimesh.creation.box(), Camera(azimuth=30, elevation=30), (100, 100), (200, 200, 200))
    grey = image.mean(axis=-1)
    top, right_side = grey[30, 50], grey[65, 70]
    assert top > right_side + 20


def test_ground_shadow_darkens_only_the_ground() -> None:
    box = trimesh.creation.box()
    with_shadow, without = (render_mesh(box, size=(80, 80), ground=g).astype(int) for g in (True, False))
    assert (with_shadow <= without).all()
    assert (without - with_shadow).max() > 20
    np.testing.assert_array_equal(with_shadow[30:40, 35:45], without[30:40, 35:45])


def test_rays_for_edges_alone_draw_nearly_what_rays_for_all_pixels_draw(monkeypatch) -> None:
    """The slow reference casts as many rays through every pixel as through one on an edge."""
    pole, turned = trimesh.creation.cylinder(0.5, 2.0, sections=48), trimesh.creation.box((2.5, 0.4, 0.9))
    turned.apply_transform(trimesh.transformations.rotation_matrix(0.7, (0.2, 1, 0.1)))
    mesh = trimesh.util.concatenate([pole, turned])
    colours = np.where(np.arange(len(mesh.faces))[:, None] % 7 < 3, (220, 60, 40), (60, 90, 210))

    def drawn(refined: np.ndarray | None) -> np.ndarray:
        if refined is not None:
            monkeypatch.setattr("partwright.render.shading.edge_pixels", lambda *_: refined)
        return render_mesh(mesh, size=(160, 120), colours=colours).astype(int)

    fast, slow, none = drawn(None), drawn(np.arange(160 * 120)), drawn(np.arange(0))
    off, jagged = (np.abs(image - slow).max(axis=-1) for image in (fast, none))
    assert off.mean() < 1.5
    assert (off > 40).mean() < min(0.005, 0.2 * (jagged > 40).mean())


def test_rays_through_places_of_a_picture_are_those_of_its_pixels() -> None:
    view = Camera().fitted(np.random.default_rng(0).normal(size=(20, 3)), 6, 4)
    rays = view.rays(6, 4)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1, atol=1e-6)
    np.testing.assert_array_equal(view.through(np.array([2.5 / 6]), np.array([1.5 / 4]))[0], rays[1 * 6 + 2])
    np.testing.assert_allclose(view.through(np.array([0.5]), np.array([0.5]))[0], -view.back, atol=1e-6)


def test_tiny_and_far_meshes_look_the_same() -> None:
    box = trimesh.creation.box()
    reference = render_mesh(box, size=(60, 60)).astype(int)
    small = box.copy()
    small.vertices = small.vertices * 1e-6 + 1.0
    assert np.abs(render_mesh(small, size=(60, 60)).astype(int) - reference).mean() < 1.0


def test_same_bytes_twice() -> None:
    mesh = trimesh.creation.icosphere(2)
    assert render_mesh(mesh, size=(50, 50)).tobytes() == render_mesh(mesh, size=(50, 50)).tobytes()


def test_empty_mesh_is_named() -> None:
    with pytest.raises(EmptyShapeError):
        render_mesh(trimesh.Trimesh())


@pytest.mark.parametrize("arguments", [{"up": "up"}, {"field_of_view": 0}, {"margin": 0.5}])
def test_bad_cameras_are_named(arguments: dict) -> None:
    with pytest.raises(SettingError):
        Camera(**arguments)


def test_sheet_places_pictures_and_writes_captions() -> None:
    images = [np.full((20, 100, 3), value, dtype=np.uint8) for value in (10, 60, 110)]
    captions = ["one", "two", "a caption that is much too long for the picture"]
    page = sheet(images, captions, columns=2, title="title")
    assert page.shape[1] == 200
    assert [np.count_nonzero((page == v).all(axis=-1)) >= 2000 for v in (10, 60, 110)] == [True] * 3
    assert (sheet(images, columns=3) == np.concatenate(images, axis=1)).all()


def test_sheet_refuses_what_does_not_fit() -> None:
    with pytest.raises(SettingError):
        sheet([])
    with pytest.raises(SettingError):
        sheet([np.zeros((4, 4, 3), np.uint8)], ["a", "b"])


def test_deviation_colours_diverge() -> None:
    missing, fits, excess = deviation_colours(np.array([-2.0, 0.0, 2.0]), 1.0)
    assert missing[2] > missing[0]
    assert np.ptp(fits) < 10
    assert excess[0] > excess[2]


@given(scale=st.floats(1e-9, 1e9))
def test_the_scale_ends_at_a_round_number_that_holds_all_deviations(scale: float) -> None:
    limit = round_limit(np.linspace(-scale, 0.9 * scale, 101))
    assert (1 - 1e-6) * scale <= limit <= 1.51 * scale
    assert round(limit / 10 ** np.floor(np.log10(limit) + 1e-9), 6) in (1, 1.5, 2, 3, 4, 5, 6, 8)


def test_a_scale_ends_before_a_single_far_place_but_not_far_below() -> None:
    mostly_fine = np.append(np.full(999, 0.001), -1.57)
    assert 1.57 / 4 <= round_limit(mostly_fine) <= 1.57


def test_a_scale_without_deviations_has_a_length() -> None:
    assert round_limit(np.zeros(5)) == round_limit(np.zeros(0)) == 1.0


def test_a_flat_face_that_parts_share_has_one_colour() -> None:
    block, flush = Part(Box((1.0, 1.0, 1.0))), Part(Box((0.5, 0.5, 1.0)), (0.4, 0.4, 0.0))
    hole = Part(Cylinder(0.2, 2.0), (-0.2, -0.2, 0.0))
    assembly = Assembly((block, flush)) - hole
    rng = np.random.default_rng(0)
    across = rng.uniform(0.16, 0.49, (200, 2))
    noise = rng.normal(0, 2e-4, 200)  # as of a mesh
    top = np.column_stack([across, 0.5 + noise])
    side = np.column_stack([np.full(200, 0.65), across[:, 0], rng.uniform(-0.4, 0.4, 200)])
    turn = rng.uniform(0, 2 * np.pi, 200)
    wall = np.column_stack([0.2 * np.cos(turn) - 0.2, 0.2 * np.sin(turn) - 0.2, rng.uniform(-0.4, 0.4, 200)])
    inward = np.column_stack([-np.cos(turn), -np.sin(turn), np.zeros(200)])
    points = np.concatenate([top, side, wall])
    normals = np.concatenate([np.tile([0.0, 0.0, 1.0], (200, 1)), np.tile([1.0, 0.0, 0.0], (200, 1)), inward])
    assert surface_parts(assembly, points, normals).tolist() == [0] * 200 + [1] * 200 + [2] * 200


def test_a_surface_that_only_crosses_a_face_leaves_no_line_on_it() -> None:
    cut = Assembly((Part(Quadric.plane((1.0, 0.0, 0.0), 0.0)), Part(Box((1.0, 1.0, 1.0)))), "intersection")
    y = np.linspace(-0.4, 0.4, 100)
    top = np.column_stack([np.linspace(-1e-3, 0, 100), y, np.full(100, 0.5)])
    assert set(surface_parts(cut, top, np.tile([0.0, 0.0, 1.0], (100, 1)))) == {1}
    front = np.column_stack([np.zeros(100), y, np.linspace(-0.4, 0.4, 100)])
    assert set(surface_parts(cut, front, np.tile([1.0, 0.0, 0.0], (100, 1)))) == {0}


def test_palette_is_stable_and_distinct() -> None:
    colours = palette(40)
    assert colours.shape == (40, 3)
    assert len(np.unique(colours, axis=0)) == 40
    np.testing.assert_array_equal(palette(7), colours[:7])
    assert np.linalg.norm(np.diff(colours.astype(float), axis=0), axis=1).min() > 60
    assert palette(0).shape == (0, 3)


def test_preview_colours_parts_and_errors(tmp_path) -> None:
    ball, block = Part(Sphere(0.5), (-0.6, 0.0, 0.0)), Part(Box((0.8, 0.8, 0.8)), (0.6, 0.0, 0.0))
    assembly = Assembly((ball, block))
    larger = mesh_assembly(Assembly((Part(Sphere(0.55), (-0.6, 0.0, 0.0)), block)), 48)
    shape = SimpleNamespace(vertices=larger.vertices, faces=larger.faces, points=None, unit="mm", up="z")
    target = tmp_path / "preview.png"
    page = preview(shape, assembly, path=target, title="two parts", panel=(160, 160))
    assert Image.open(target).size == (640, page.shape[0])
    np.testing.assert_array_equal(np.asarray(Image.open(target)), page)
    parts, error = page[:, 160:320].astype(int), page[-160:-40, 480:].astype(int)
    # The ball in the first colour on the left, the block in the second on the right.
    blue, orange = parts[..., 2] - parts[..., 0] > 60, parts[..., 0] - parts[..., 2] > 60
    assert blue.sum() > 800
    assert orange.sum() > 800
    assert np.argwhere(blue)[:, 1].mean() < np.argwhere(orange)[:, 1].mean()
    # The assembly's ball is too small: missing, blue; the block fits: grey.
    missing = error[..., 2] - error[..., 0] > 60
    assert missing[:, :80].sum() > 300
    assert missing[:, 85:].sum() < 0.05 * missing.sum()
    assert list(tmp_path.iterdir()) == [target]


def test_the_input_that_came_as_points_is_drawn_as_points() -> None:
    """A few hundred points of a ball: a surface laid through them would cover as much as the ball does."""
    points = np.random.default_rng(0).standard_normal((300, 3))
    shape = load_shape(points / np.linalg.norm(points, axis=1)[:, None])
    page = preview(shape, Assembly((Part(Sphere(1.0).superfrustum(), name="ball"),)), panel=(200, 200))
    panels = [page[-200:, 200 * i : 200 * (i + 1)].astype(int) for i in range(2)]
    drawn, ball = ((np.abs(panel - np.array(BACKGROUND)).max(axis=2) > 40).mean() for panel in panels)
    assert ball > 0.45
    assert 0.002 < drawn < 0.2


def test_turntable_turns(tmp_path) -> None:
    target = tmp_path / "turn.gif"
    turntable(trimesh.creation.box((1, 2, 0.5)), target, size=(48, 48), frames=6)
    with Image.open(target) as gif:
        assert gif.n_frames == 6
        first = np.asarray(gif.convert("RGB")).astype(int)
        gif.seek(2)
        assert np.abs(np.asarray(gif.convert("RGB")).astype(int) - first).mean() > 2


def test_unwritable_place_is_named_and_leaves_nothing(tmp_path) -> None:
    with pytest.raises(OutputError):
        write_png(tmp_path / "missing" / "a.png", np.zeros((2, 2, 3), np.uint8))
    (tmp_path / "a.png").mkdir()
    with pytest.raises(OutputError):
        write_png(tmp_path / "a.png", np.zeros((2, 2, 3), np.uint8))
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("stretch", [(4, 1, 1), (1, 1, 4), (1, 1, 1)])
def test_a_framed_object_fills_its_picture_both_ways(stretch: tuple[float, float, float]) -> None:
    points = trimesh.creation.icosphere(3).vertices * stretch
    camera = Camera(margin=0.1)
    width, height = camera.framed(points, 400, 240)
    assert width * height == pytest.approx(400**2, rel=0.01)
    assert min(width, height) >= 240
    view = camera.fitted(points, width, height)
    depth = (view.eye - points) @ view.back
    filled = [
        np.ptp((points - view.eye) @ axis / depth / half) / 2
        for axis, half in zip((view.right, view.up), view.half, strict=True)
    ]
    assert max(filled) == pytest.approx(0.8, abs=0.01)
    assert min(filled) > 0.6


def test_light_starts_on_the_round_surface_that_facets_stand_for() -> None:
    ball = trimesh.creation.icosphere(2)
    scene = Scene(ball.vertices, ball.faces)
    view = Camera().fitted(ball.vertices, 60, 60)
    hits = cast(scene, view, view.rays(60, 60))
    below, left = (1 - np.linalg.norm(place, axis=1) for place in (hits.point, hits.round))
    assert below.max() > 0.015
    assert left.max() < 0.1 * below.max()  # out of the shade of the neighbouring facets
    assert left.min() > -below.max()
    cube = trimesh.creation.box()
    scene = Scene(cube.vertices, cube.faces)
    hits = cast(scene, view, view.rays(60, 60))
    np.testing.assert_allclose(hits.round, hits.point, atol=1e-5)


def test_a_scale_that_ends_before_the_errors_do_says_so() -> None:
    blank = np.full((310, 400, 3), 255, dtype=np.uint8)
    within, beyond = add_legend(blank, 0.2, "mm", 0.2), add_legend(blank, 0.2, "mm", 1.57)
    np.testing.assert_array_equal(within, add_legend(blank, 0.2, "mm"))
    changed = np.argwhere((within != beyond).any(axis=-1))
    assert len(changed) > 100  # "largest 1.6 mm" in place of "0"
    assert abs(changed[:, 1].mean() - 200) < 5
