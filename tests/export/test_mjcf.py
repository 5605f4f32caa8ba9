"""MJCF as MuJoCo itself reads and simulates it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.atomic_io import report_path
from partwright.errors import NothingToExportError, ParameterError, SettingError, UnitError
from partwright.export import export
from partwright.export.axes import to_metres_z_up
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum, Tube
from partwright.meshing.mass import mass_properties
from tests.export.robotics import FLOOR, awkward, natives, with_others

mujoco = pytest.importorskip("mujoco")
VOLUME = 0.1 * 0.2 * 0.3 + np.pi * (0.05**2 * 0.2 + 4 / 3 * 0.06**3 + 0.04**2 * 0.12 + 4 / 3 * 0.04**3)


def model(assembly: Assembly, path: Path, floor: bool = False, **options: Any) -> Any:
    export(assembly, path, **options)
    return with_others(path, FLOOR if floor else "")


def report(path: Path) -> dict[str, Any]:
    return json.loads(report_path(path).read_text(encoding="utf-8"))


def test_native_geoms_in_metres_and_in_place(tmp_path: Path) -> None:
    path = tmp_path / "a.mjcf"
    loaded = model(natives(), path)
    assert [loaded.geom(i).name for i in range(4)] == ["base", "post", "ball & <socket>", "rod"]
    kinds = mujoco.mjtGeom
    expected = [kinds.mjGEOM_BOX, kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE]
    assert loaded.geom_type.tolist() == [int(kind) for kind in expected]
    sizes = [[0.05, 0.1, 0.15], [0.05, 0.1, 0], [0.06, 0, 0], [0.04, 0.06, 0]]
    assert np.allclose(loaded.geom_size, sizes)
    assert np.allclose(loaded.geom_pos[1], (0.3, 0, 0.15))
    assert np.allclose(loaded.geom_quat[1], (0.5, 0.5, 0.5, 0.5))
    assert not report_path(path).exists()


def test_mass_centre_and_inertia_are_the_surface_s(tmp_path: Path) -> None:
    loaded = model(natives(), tmp_path / "a.mjcf", density=7800.0)
    assert loaded.body_mass[1] == pytest.approx(7800 * VOLUME, rel=3e-3)
    expected = mass_properties(natives().scaled(1e-3))
    assert np.allclose(loaded.body_ipos[1], expected.centre, atol=1e-6)
    principal = np.sort(np.linalg.eigvalsh(expected.inertia)) * 7800
    assert np.allclose(np.sort(loaded.body_inertia[1]), principal, rtol=1e-5)


def test_overlaps_weigh_once(tmp_path: Path) -> None:
    twice = Assembly((Part(Box((1, 1, 1))), Part(Box((1, 1, 1)))), unit="m", up="z")
    assert model(twice, tmp_path / "a.mjcf").body_mass[1] == pytest.approx(1000, rel=1e-3)


def lifted(assembly: Assembly) -> Assembly:
    return assembly.translated((0, 0, 0.01 - assembly.bounds()[0, 2]))


@pytest.fixture(scope="module")
def awkward_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("awkward") / "a.mjcf"
    export(lifted(awkward()), path, free_joint=True)
    return path


@pytest.mark.parametrize("is_awkward", [False, True], ids=["natives", "awkward"])
def test_it_falls_and_comes_to_rest_on_a_plane(tmp_path: Path, awkward_file: Path, is_awkward: bool) -> None:
    if is_awkward:
        loaded = with_others(awkward_file, FLOOR)
    else:
        loaded = model(lifted(natives()), tmp_path / "a.mjcf", floor=True, free_joint=True)
    data = mujoco.MjData(loaded)
    for _ in range(200):
        mujoco.mj_step(loaded, data)
    assert np.isfinite(data.qpos).all()
    assert np.isfinite(data.qvel).all()
    assert data.ncon > 0
    assert data.contact.dist[: data.ncon].min() > -0.01


@pytest.mark.parametrize("axis", ["x", "-x", "y", "-y", "z", "-z"])
def test_every_up_axis_becomes_z(axis: str) -> None:
    up = np.zeros(3)
    up["xyz".index(axis[-1])] = -2.0 if axis.startswith("-") else 2.0
    frame = to_metres_z_up(Assembly((Part(Sphere(1)),), unit="cm", up=axis))
    assert np.allclose(frame(up), (0, 0, 0.02), atol=1e-12)


def test_what_has_no_native_geom_is_told(awkward_file: Path) -> None:
    path, loaded = awkward_file, with_others(awkward_file, "")
    kinds = {loaded.geom(i).name: loaded.geom_type[i] for i in range(loaded.ngeom)}
    assert kinds["base"] == mujoco.mjtGeom.mjGEOM_BOX
    assert {kinds[f"hook/{i}"] for i in (1, 2, 3)} == {int(mujoco.mjtGeom.mjGEOM_CAPSULE)}
    changes = {tuple(change["parts"]): change for change in report(path)["approximated"]}
    assert set(changes) == {("hook",), ("spike",), ("cup",), ("block", "hole")}
    assert changes["hook",]["blend_dropped"] == 0.05
    assert changes["spike",]["to"] == "convex mesh"
    assert changes["spike",]["volume_error_ratio"] < 1e-3
    assert changes["hook",]["to"] == "chain of 3 solids"
    assert 0 < changes["hook",]["max_deviation"] < 0.05
    assert changes["cup",]["to"].endswith("convex pieces")  # the tube stays open
    assert changes["cup",]["volume_error_ratio"] < 0.3
    assert changes["cup",]["max_deviation"] < 0.05 * 1.5

    assert changes["block", "hole"]["to"].endswith("convex pieces")
    assert changes["block", "hole"]["volume_error_ratio"] < 0.25  # its hull: 1.01
    assert report(path)["mass_properties"]["mass"] == pytest.approx(loaded.body_mass[1])


def test_a_ball_falls_into_a_hollow_part(tmp_path: Path) -> None:
    path = tmp_path / "a.mjcf"
    export(Assembly((Part(Tube(0.3, 0.05, 0.4), (0, 0, 0.2), name="ring"),), unit="m", up="z"), path)
    ball = '<body pos="0 0 0.5"><freejoint/><geom type="sphere" size="0.1"/></body>'
    loaded = with_others(path, FLOOR + ball)
    data = mujoco.MjData(loaded)
    for _ in range(1000):
        mujoco.mj_step(loaded, data)
    assert data.qpos[2] == pytest.approx(0.1, abs=0.01)


def test_the_tolerance_decides_between_geom_and_mesh(tmp_path: Path) -> None:
    """A cone is no cylinder to speak of, and its hull is exact; one that hardly tapers saves a mesh."""
    for taper, tolerance, native in ((0.6, 0.3, False), (0.98, 0.05, True), (0.98, 0.002, False)):
        cone = Assembly((Part(SuperFrustum((1, 1, 2), 1.0, taper=taper)),), unit="m", up="z")
        kind = model(cone, tmp_path / "a.mjcf", tolerance=tolerance).geom_type[0]
        assert (kind != mujoco.mjtGeom.mjGEOM_MESH) == native


def test_copies_of_a_repeated_part_are_geoms_of_their_own(tmp_path: Path) -> None:
    move = Similarity(translation=(2.0, 0.0, 0.0))
    leg = Part(Cylinder(0.1, 1.0), name="leg", instances=(move,))
    loaded = model(Assembly((leg,), unit="m", up="z"), tmp_path / "a.mjcf")
    assert [loaded.geom(i).name for i in range(2)] == ["leg", "leg_02"]
    assert np.allclose(loaded.geom_pos[1] - loaded.geom_pos[0], (2, 0, 0))


def test_unknown_units_are_said(tmp_path: Path) -> None:
    path = tmp_path / "a.mjcf"
    loaded = model(Assembly((Part(Sphere(3.0)), Part(Sphere(1.0), (3, 0, 0), blend=1.0))), path)
    assert loaded.geom_size[0, 0] == 3
    assert "the length unit is unknown" in path.read_text()
    assert "the length unit is unknown" in report(path)["notes"][0]


def test_a_part_without_volume_is_left_out_and_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mjcf"
    sheet = Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet")
    assert model(Assembly((Part(Sphere(1)), sheet), unit="m", up="z"), path).ngeom == 1
    assert report(path)["approximated"][0]["to"] == "nothing"


def test_bad_input(tmp_path: Path) -> None:
    path = tmp_path / "a.mjcf"
    with pytest.raises(NothingToExportError, match="nothing to export"):
        export(Assembly((Part(SuperFrustum((1, 1, 1), onion=1.0)),)), path)
    with pytest.raises(UnitError, match="too small for MuJoCo"):
        export(Assembly((Part(Sphere(1)),), unit="um"), path)
    with pytest.raises(ParameterError, match="density"):
        export(natives(), path, density=0.0)
    with pytest.raises(ParameterError, match="tolerance"):
        export(natives(), path, tolerance=-1.0)
    with pytest.raises(SettingError, match="furlong"):
        export(Assembly((Part(Sphere(1)),), unit="furlong"), path)
    assert not list(tmp_path.iterdir())
