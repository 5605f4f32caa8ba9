"""USD: links are rigid bodies of UsdPhysics; the root layer gets new colliders, and all files stay beside it.

Colliding meshes stay where they are and collide no longer: others may show them, or draw materials from them.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from partwright.errors import MissingDependencyError, RobotError, UnreadableFileError
from partwright.export.usd_physics import define_collider, native_field
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.model import Files, Link, MeshUse, RobotFile, Shape, frame

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Part


class Usd(RobotFile):
    """A USD file with rigid bodies, in the stage's own unit; links are in metres."""

    kinds: ClassVar[tuple[type[Field], ...]] = (Box, Cylinder, Sphere, Capsule)

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        """Raises UnreadableFileError, RobotError or MissingDependencyError."""
        self.path, self.packages = path, packages
        self._metres = 1.0
        stage = _opened(path)
        from pxr import UsdGeom, UsdPhysics

        self._metres = float(UsdGeom.GetStageMetersPerUnit(stage))
        bodies = [prim for prim in _all(stage) if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
        if not bodies:
            raise RobotError(f"{path}: none of its prims is a rigid body (PhysicsRigidBodyAPI)")
        self._paths = {_name(prim, bodies): str(prim.GetPath()) for prim in bodies}
        owner = {path: name for name, path in self._paths.items()}
        parents = _parents(stage, owner)
        self._replaced: dict[str, list[str]] = {}
        self._kept: dict[str, list[str]] = {}
        self.links = [self._link(stage, name, tuple(parents.get(name, ())), owner) for name in self._paths]

    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        from pxr import UsdPhysics, UsdUtils

        stage = _opened(self.path)
        stage.SetEditTarget(stage.GetRootLayer())
        for name, made in shapes.items():
            for path in self._replaced[name]:
                prim = _editable(stage, path)
                UsdPhysics.CollisionAPI(prim).CreateCollisionEnabledAttr(False)
            for path in self._kept[name]:
                UsdPhysics.CollisionAPI.Apply(_editable(stage, path))
            link = _editable(stage, self._paths[name])
            if link.IsInstance():  # which takes no children of its own
                link.SetInstanceable(False)
            self._add(stage, link, made)
        files = Files()
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder) / self.path.name
            stage.GetRootLayer().Export(str(whole))
            files.written[self.path.name] = whole.read_bytes()
        layers, assets, missing = UsdUtils.ComputeAllDependencies(str(self.path))
        if missing:
            raise UnreadableFileError(f"{self.path}: it refers to {missing[0]}, which is not there")
        home = self.path.resolve().parent
        for used in (*(layer.realPath for layer in layers), *assets):
            file = Path(used).resolve()
            if file == self.path.resolve():
                continue
            if not file.is_relative_to(home):
                raise RobotError(f"{self.path}: it refers to {file}, which lies outside of its folder")
            files.copied[file.relative_to(home).as_posix()] = file
        return files

    def _link(self, stage: Any, name: str, parents: tuple[str, ...], owner: Mapping[str, str]) -> Link:
        from pxr import UsdGeom, UsdPhysics

        prim = stage.GetPrimAtPath(self._paths[name])
        pose = self._pose(prim)
        collisions, visuals, natives = [], [], []
        replaced, lent = [], []
        for below in _below(prim, owner):
            said = _colliders(below, prim)
            enabled = said and UsdPhysics.CollisionAPI(said[0]).GetCollisionEnabledAttr().Get() is not False
            if below.IsA(UsdGeom.Mesh):
                use = self._use(below, pose)
                if use is not None and enabled:
                    collisions.append(use)
                    replaced += [str(one.GetPath()) for one in said]
                elif use is not None and not said:
                    visuals.append(use)
            elif enabled and (part := self._native(below, pose)) is not None:
                natives.append(part)
                if said[0] != below:
                    lent.append((str(said[0].GetPath()), str(below.GetPath())))
        self._replaced[name] = list(dict.fromkeys(replaced))
        self._kept[name] = [path for above, path in lent if above in replaced]
        return Link(name, pose, parents, tuple(collisions), tuple(visuals), tuple(natives))

    def _pose(self, prim: Any) -> np.ndarray:
        """(4, 4) of the link: where it is in metres, without its scale."""
        matrix = self._world(prim)
        turn, _ = _rotation(matrix[:3, :3])
        return frame(turn, matrix[:3, 3])

    def _world(self, prim: Any) -> np.ndarray:
        """(4, 4) from the prim's coordinates to the world in metres."""
        from pxr import UsdGeom

        matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
        if not np.isfinite(matrix).all():
            raise RobotError(f"{self.path}: the place of {prim.GetPath()} is no number")
        return np.diag([self._metres] * 3 + [1.0]) @ matrix

    def _use(self, prim: Any, pose: np.ndarray) -> MeshUse | None:
        mesh = _triangles(prim, self.path)
        if mesh is None:
            return None
        return MeshUse(Path(str(prim.GetPath())), np.linalg.inv(pose) @ self._world(prim), mesh)

    def _native(self, prim: Any, pose: np.ndarray) -> Part | None:
        """A Gprim that collides already, in the link's frame; None for one that is none of ours."""
        from partwright.assembly import Part, Similarity

        found = native_field(prim)
        if found is None:
            return None
        field, turned = found
        matrix = np.linalg.inv(pose) @ self._world(prim) @ turned
        turn, scale = _rotation(matrix[:3, :3])
        if isinstance(field, Box):
            x, y, z = (a * b for a, b in zip(field.size, scale.tolist(), strict=True))
            field = Box((x, y, z))
        else:
            field = field.scaled(float(scale.mean()))
        placed = Similarity.from_matrix(frame(turn, matrix[:3, 3]))
        return Part(field, placed.translation, placed.rotation)

    def _add(self, stage: Any, link: Any, shapes: Sequence[Shape]) -> None:
        from pxr import Tf, UsdGeom

        path = _free(stage, link.GetPath().AppendChild("collision_shapes"))
        group = UsdGeom.Xform.Define(stage, path)
        group.CreatePurposeAttr(UsdGeom.Tokens.guide)
        world = self._world(link)
        step = np.linalg.inv(world) @ self._pose(link)  # the link's own scale, and the unit, undone
        group.AddTransformOp().Set(_gf_matrix(step))
        for shape in shapes:
            where = _free(stage, path.AppendChild(Tf.MakeValidIdentifier(shape.name)))
            define_collider(stage, where, shape.part, shape.mesh)


def _opened(path: Path) -> Any:
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        raise MissingDependencyError(
            "USD robots need usd-core; install it with: pip install 'partwright[usd]'"
        ) from error
    if path.suffix.lower() == ".usdz":
        raise RobotError(f"{path}: a package cannot be changed in place; unpack it, and give the layer in it")
    try:
        return Usd.Stage.Open(os.fspath(path))
    except Tf.ErrorException as error:
        reason = " ".join(str(error).split())[-300:]
        raise UnreadableFileError(f"{path}: it cannot be read as USD: {reason}") from error


def _all(stage: Any) -> Iterator[Any]:
    """Every active prim, those in instances, too."""
    from pxr import Usd

    return iter(stage.Traverse(Usd.TraverseInstanceProxies()))


def _below(prim: Any, owner: Mapping[str, str]) -> Iterator[Any]:
    """The prim and what is below it, but for other rigid bodies."""
    from pxr import Usd

    walk = iter(Usd.PrimRange(prim, Usd.TraverseInstanceProxies()))
    for below in walk:
        if below != prim and str(below.GetPath()) in owner:
            walk.PruneChildren()
        else:
            yield below


def _colliders(prim: Any, link: Any) -> list[Any]:
    """What says that a prim of a link collides, the nearest first: itself, and groups above it, as meshes
    that are merged or instanced have it."""
    from pxr import UsdGeom, UsdPhysics

    found = [prim] if prim.HasAPI(UsdPhysics.CollisionAPI) else []
    while prim != link:
        prim = prim.GetParent()
        if prim.HasAPI(UsdPhysics.CollisionAPI) and not prim.IsA(UsdGeom.Gprim):
            found.append(prim)
    return found


def _name(prim: Any, bodies: Sequence[Any]) -> str:
    """Its own name, or its path where another body has that name."""
    same = [other for other in bodies if other.GetName() == prim.GetName()]
    return str(prim.GetName() if len(same) == 1 else prim.GetPath())


def _parents(stage: Any, owner: Mapping[str, str]) -> dict[str, list[str]]:
    """The links that each one hangs on, by the joints between two of them."""
    from pxr import UsdPhysics

    found: dict[str, list[str]] = {}
    for prim in _all(stage):
        joint = UsdPhysics.Joint(prim)
        if not joint:
            continue
        ends = [rel.GetTargets() for rel in (joint.GetBody0Rel(), joint.GetBody1Rel())]
        names = [owner.get(str(end[0])) if end else None for end in ends]
        if names[0] and names[1]:
            found.setdefault(names[1], []).append(names[0])
    return found


def _triangles(prim: Any, path: Path) -> trimesh.Trimesh | None:
    """A mesh's faces as triangles, fans of their first corners; None where it has none."""
    import trimesh
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    points = np.array(mesh.GetPointsAttr().Get() or (), dtype=np.float64).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or (), dtype=np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or (), dtype=np.int64)
    if not len(points) or not len(counts):
        return None
    if counts.sum() != len(corners) or corners.min() < 0 or corners.max() >= len(points):
        raise RobotError(f"{path}: the mesh {prim.GetPath()} names corners that it does not have")
    starts = np.cumsum(counts) - counts
    faces = [
        np.column_stack([corners[starts[own]], corners[starts[own] + i], corners[starts[own] + i + 1]])
        for i in range(1, int(counts.max()) - 1)
        if len(own := np.flatnonzero(counts > i + 1))
    ]
    if not faces:
        return None
    triangles = np.concatenate(faces)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        triangles = triangles[:, ::-1]
    return trimesh.Trimesh(points, triangles, process=False)


def _rotation(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and scale (3,) along its axes, of a matrix without shear."""
    scale = np.linalg.norm(matrix, axis=0)
    if not (scale > 0).all():
        raise RobotError("a prim is scaled to nothing")
    turn = matrix / scale
    if np.linalg.det(turn) < 0:  # a mirror: of a link's frame it is the meshes'
        turn = turn * [1, 1, -1]
    return turn, scale


def _editable(stage: Any, path: str) -> Any:
    """The prim, where need be with the instances above it made prims of their own."""
    prim = stage.GetPrimAtPath(path)
    while prim.IsInstanceProxy():
        above = prim
        while above.IsInstanceProxy():
            above = above.GetParent()
        above.SetInstanceable(False)
        prim = stage.GetPrimAtPath(path)
    return prim


def _free(stage: Any, path: Any) -> Any:
    number, stem = 1, path.name
    while stage.GetPrimAtPath(path):
        number += 1
        path = path.ReplaceName(f"{stem}_{number:02d}")
    return path


def _gf_matrix(matrix: np.ndarray) -> Any:
    from pxr import Gf

    return Gf.Matrix4d(matrix.T.tolist())
