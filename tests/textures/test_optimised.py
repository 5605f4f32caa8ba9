"""Optimised maps: what is read between texels is what was seen, and pictures come nearer to the input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity
from partwright.cli.main import main
from partwright.fields import Sphere, SuperFrustum
from partwright.meshing import mesh_assembly
from partwright.textures import PartMap, bake, likeness, load_colours, part_map
from partwright.textures.coordinates import directions, folded
from partwright.textures.likeness import SIDE
from partwright.textures.texels import Texels, filled

WHOLE_MOVE = Similarity(2.0, (0.5, 0.5, 0.5, 0.5), (1, 2, 3))
WHOLE = Assembly(
    (
        Part(Sphere(1.0), name="ball", blend=0.1),
        Part(
            SuperFrustum((0.8, 0.8, 2.4), 0.6, 0.1, 0.8), (0.9, 0, 0), (0.8, 0, 0.6, 0), name="arm", blend=0.1
        ),
    ),
    up="z",
)


@pytest.fixture(scope="module")
def checker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Squares with edges that are finer than texels."""
    path = tmp_path_factory.mktemp("checker") / "a.ply"
    mesh = mesh_assembly(WHOLE, 96)
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).subdivide_to_size(0.02, max_iter=12)
    odd = np.floor(np.asarray(mesh.vertices) / 0.2).sum(axis=1) % 2 == 1
    mesh.visual.vertex_colors = np.where(odd[:, None], (240, 220, 40, 255), (20, 40, 130, 255)).astype(
        np.uint8
    )
    mesh.export(path)
    return path


def test_texels_are_found_again_from_what_is_read_between_them() -> None:
    rng = np.random.default_rng(0)
    truth = PartMap(rng.integers(0, 256, (16, 32, 3)).astype(np.uint8))
    points = rng.normal(size=(60_000, 3))
    field = SuperFrustum((2, 2, 2), onion=0.3)
    towards, inner = directions(field, points)
    texels = Texels(16, 2, 3)
    for half in (slice(0, 7_000), slice(7_000, None)):  # in any number of pieces
        values = truth.at(field, points[half])
        texels.add(folded(towards[half]), inner[half], values, np.ones(len(values)))
    solved, seen = texels.solved()
    means, _ = texels.means()
    known = seen > 0
    assert known.mean() > 0.8
    wanted = truth.image.astype(float)
    assert np.median(np.abs(solved - wanted)[known]) < 1
    assert np.abs(means - wanted)[known].mean() > 8 * np.abs(solved - wanted)[known].mean()


def test_texels_that_nothing_reaches_are_as_their_neighbours() -> None:
    texels = Texels(8, 1, 1)
    place = np.array([[0.2, 0.2], [0.8, 0.8]])
    texels.add(place, np.zeros(2, bool), np.array([[10.0], [90.0]]), np.ones(2))
    values, seen = texels.solved()
    whole = filled(values, seen, 1)
    assert not (seen > 0).all()
    assert whole[0, 0, 0] == pytest.approx(10, abs=0.5)
    assert whole[-1, -1, 0] == pytest.approx(90, abs=0.5)


def test_borders_of_what_is_seen_do_not_run_away() -> None:
    """A bright disc, and beyond its edge a dark rim of which little is seen, as of another part's colour."""
    rng = np.random.default_rng(2)
    place = rng.random((20_000, 2))
    radius = np.hypot(*(place - 0.5).T)
    place, radius = place[radius < 0.3], radius[radius < 0.3]
    values = np.where(radius < 0.27, 200.0, 40.0)[:, None] + rng.normal(0, 5, (len(place), 1))
    texels = Texels(32, 1, 1)
    texels.add(place, np.zeros(len(place), bool), values, np.where(radius < 0.27, 1.0, 1e-3))
    solved, seen = texels.solved()
    assert solved[seen > 0].min() > 20
    assert solved[seen > 0].max() < 220
    whole = filled(solved, seen, 1)
    assert np.ptp(whole[seen == 0]) < 60
    assert whole[seen == 0].min() > 150  # the rim tells nothing of what is around it


def test_a_checkers_pictures_come_nearer_and_its_bytes_stay(checker: Path) -> None:
    colours = load_colours(checker)
    plain, baked = bake(WHOLE, colours, 48, optimise=False), bake(WHOLE, colours, 48)
    before, after = likeness.likeness([plain, baked], colours)
    assert after[1] > before[1] + 0.5  # dB of the surface
    assert after[0] > before[0]
    assert bake(WHOLE, colours, 48) == baked
    far = Assembly(tuple(p.transformed(WHOLE_MOVE) for p in baked.parts), up="z")
    for part, moved in zip(baked.parts, far.parts, strict=True):
        assert moved.metadata == part.metadata
    assert part_map(baked["arm"]).image.std() > 20


def test_the_command_says_how_near(tmp_path: Path, checker: Path) -> None:
    WHOLE.save(tmp_path / "a.json")
    command = ["texture", str(tmp_path / "a.json"), str(checker), "--size", "32"]
    assert main([*command, "-o", str(tmp_path / "b.json")]) == 0
    report = json.loads((tmp_path / "b.json.report.json").read_text())
    psnr = report["psnr"]
    assert (psnr["views"], psnr["side"]) == (8, likeness.SIDE)
    assert SIDE == 512  # as it was before pictures were made smaller for tests
    assert psnr["after"]["surface"] > psnr["before"]["surface"]
    assert report["texels_a_side"] == 32
    assert report["cpu_seconds"] > 0
