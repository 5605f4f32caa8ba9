"""Groups that are copies of one another in scenes: meshes are there once, and in every place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, copies_of, line, ring
from partwright.export import export
from partwright.export.shared_groups import shared
from partwright.fields import Box, Cylinder, Quadric
from tests.assembly.test_repeated_groups import FOOT, RIB, table
from tests.export.test_export import header
from tests.export.test_gltf_validator import validated


def drilled() -> Assembly:
    """A plate with four counterbored holes, each two cylinders."""
    hole = Assembly(
        (Part(Cylinder(2, 20), (20, 10, 0), name="hole"), Part(Cylinder(4, 4), (20, 10, 3), name="bore"))
    )
    plate = Part(Box((60, 60, 6)), name="plate")
    return Assembly((plate, hole, *copies_of(hole, ring(4))), "difference", unit="mm", up="z")


def rows() -> Assembly:
    """Two rows of three ribs."""
    row = Assembly((RIB, *copies_of(RIB, line(3, (12, 0, 0)))), name="row")
    return Assembly((row, *copies_of(row, line(2, (0, -20, 0)))), unit="mm")


@pytest.mark.parametrize(("whole", "meshes"), [(table(), 4), (rows(), 2)])
def test_glb_has_the_meshes_of_a_group_once(tmp_path: Path, whole: Assembly, meshes: int) -> None:
    path = tmp_path / "t.glb"
    export(whole, path)
    tree = header(path)
    assert len(tree["meshes"]) == meshes
    nodes = {node["name"]: node for node in tree["nodes"]}
    assert all(part.name in nodes for part in whole.parts)
    assert sum(node.get("extras", {}).get("role") == "copy" for node in tree["nodes"]) == 5
    scene = trimesh.load_scene(path)
    expected = sum(mesh.volume for mesh in own_meshes(whole))
    assert sum(m.volume for m in scene.dump()) * 1e9 == pytest.approx(expected, rel=1e-4)
    if whole == table():
        assert [m["message"] for m in validated(path)["messages"]] == []


def own_meshes(whole: Assembly) -> list[trimesh.Trimesh]:
    """One for each group of feet and part of others, with no word about copies."""
    from partwright.approximation.pieces import piece_meshes

    return [mesh for _, mesh in piece_meshes(whole, 32)]


def test_glb_copies_are_where_and_what_they_were(tmp_path: Path) -> None:
    whole = replace(rows(), unit=None)
    export(whole, tmp_path / "t.glb")
    scene = trimesh.load_scene(tmp_path / "t.glb")
    nodes = {node["name"]: node for node in header(tmp_path / "t.glb")["nodes"]}
    for part in whole.parts:
        pose, _ = scene.graph.get(part.name)
        np.testing.assert_allclose(pose[:3, 3], part.translation, atol=1e-6)
        assert nodes[part.name]["extras"]["translation"] == pytest.approx(part.translation)
    assert nodes["row_02"]["extras"]["role"] == "copy"
    assert nodes["row_02"]["matrix"][12:15] == pytest.approx([0, -20, 0])


def test_glb_copies_of_a_part_that_are_cut_alike_are_all_there(tmp_path: Path) -> None:
    """The pieces are copies of one another, and have one part's name."""
    leg = Part(Box((2, 2, 8)), name="leg", instances=line(3, (5, 0, 0)))
    holes = [Part(Cylinder(0.5, 4), (5 * i, 0, 0), (1, 1, 0, 0), name=f"hole_{i}") for i in range(3)]
    whole = Assembly((Assembly((leg, Part(Box((1, 1, 1)), (0, 9, 0), name="pin"))), *holes), "difference")
    export(whole, tmp_path / "t.glb")
    tree = header(tmp_path / "t.glb")
    assert len(tree["meshes"]) == 2
    assert {"leg", "leg_02", "leg_03"} < {node["name"] for node in tree["nodes"]}
    scene = trimesh.load_scene(tmp_path / "t.glb")
    assert sum(m.volume for m in scene.dump()) == pytest.approx(whole_volume(whole), rel=1e-3)
    assert np.allclose(scene.bounds, whole.bounds(), atol=1e-2)


def whole_volume(whole: Assembly) -> float:
    from partwright.meshing import mesh_assembly

    return float(mesh_assembly(whole).volume)


def test_engines_get_colliders_for_every_copy(tmp_path: Path) -> None:
    export(rows(), tmp_path / "t.glb", physics="godot")
    names = [node["name"] for node in header(tmp_path / "t.glb")["nodes"]]
    assert sum(name.endswith("convcolonly") for name in names) == 12


def test_usd_copies_are_instances_in_place(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from tests.export.test_usd import opened

    for whole, instances, meshes in ((table(), 5, 4), (rows(), 5, 2)):
        stage = opened(whole, tmp_path / f"t{meshes}.usda")
        every = traversed(stage)
        assert sum(prim.IsInstance() for prim in every) == instances
        assert sum(points.shape[0] > 0 for points in shown(stage, own=True)) == meshes
        there = np.concatenate(shown(stage, own=False))
        np.testing.assert_allclose([there.min(axis=0), there.max(axis=0)], whole.bounds(), atol=1e-2)
        assert np.abs(whole.part_distances(there)).min(axis=0).max() < 1e-2


def test_usd_has_holes_that_repeat_once_and_is_valid(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import UsdValidation

    from tests.export.test_usd import opened

    stage = opened(drilled(), tmp_path / "t.usda")
    assert sum(prim.IsInstance() for prim in traversed(stage)) == 3
    copy = next(prim for prim in traversed(stage) if prim.IsInstance())
    assert list(copy.GetCustomData()["partwright"]["copied_parts"]) == ["hole_02", "bore_02"]
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert not UsdValidation.ValidationContext(validators).Validate(stage)


def traversed(stage: Any) -> list[Any]:
    from pxr import Usd

    return list(stage.Traverse(Usd.TraverseInstanceProxies()))


def shown(stage: Any, own: bool) -> list[np.ndarray]:
    """Points (N, 3) in the world of each mesh that is shown; own: of those that are stored."""
    from pxr import UsdGeom

    result = []
    for prim in traversed(stage):
        if not prim.IsA(UsdGeom.Mesh) or (own and prim.IsInstanceProxy()):
            continue
        if UsdGeom.Imageable(prim).ComputePurpose() == "default":
            matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), np.float64)
            result.append(points @ matrix[:3, :3] + matrix[3, :3])
    return result


def test_only_what_looks_and_ends_alike_is_shared() -> None:
    second, third = copies_of(FOOT, line(3, (5, 0, 0)))
    red = second.replace_part("foot_02", replace(second["foot_02"], metadata={"colour": "#ff0000"}))
    groups = shared([FOOT, red, third])
    assert [len(group.copies) for group in groups] == [1, 0]
    slab = Assembly((Part(Quadric((1, 1, 0, 0, 0, 0, -1))), Part(Box((1, 1, 1)))), "intersection")
    assert [len(group.copies) for group in shared([slab, *copies_of(slab, line(2, (9, 0, 0)))])] == [0, 0]
