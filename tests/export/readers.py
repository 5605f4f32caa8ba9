"""What other programs find in the files: extents, volume and unit, for formats that the tests can read."""

from __future__ import annotations

import importlib.util
import runpy
import xml.etree.ElementTree as xml
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from partwright.assembly import Assembly, load_assembly
from partwright.assembly.files import from_text
from partwright.export.threemf import UNITS
from partwright.meshing import mesh_assembly
from partwright.shapes import METRES


@dataclass(frozen=True)
class Read:
    """box: (2, 3). volume: overlaps counted once. metres: in a length of 1; None where the file is silent."""

    box: np.ndarray
    volume: float
    metres: float | None


def read(path: Path, suffix: str) -> Read | None:
    """None where no reader of the format is installed."""
    module, reader = READERS.get(suffix, ("", None))
    if reader is None or (module and importlib.util.find_spec(module) is None):
        return None
    return reader(path)


def _of_meshes(meshes: list[trimesh.Trimesh], metres: float | None) -> Read:
    """Each of them closed; read at a size of about 1, for the union's sake."""
    corners = np.concatenate([mesh.vertices for mesh in meshes])
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    side = float(np.ptp(box, axis=0).max())
    unit = [trimesh.Trimesh(mesh.vertices / side, mesh.faces) for mesh in meshes]
    assert all(mesh.is_watertight for mesh in unit)
    whole = trimesh.boolean.union(unit, engine="manifold") if len(unit) > 1 else unit[0]
    return Read(box, float(whole.volume) * side**3, metres)


def _scene(path: Path) -> list[trimesh.Trimesh]:
    return list(trimesh.load_scene(path).dump())


def _html(path: Path) -> Read:
    """The assembly that stands in the page; what is drawn of it is tested in a browser."""
    start = '<script type="application/json" id="assembly">'
    return _solid(from_text(path.read_text("utf-8").partition(start)[2].partition("</script>")[0]))


def _json(path: Path) -> Read:
    return _solid(load_assembly(path))


def _solid(assembly: Assembly) -> Read:
    mesh = mesh_assembly(assembly)
    return _of_meshes([mesh], METRES[assembly.unit] if assembly.unit else None)


def _mesh(path: Path) -> Read:
    return _of_meshes([trimesh.load_mesh(path)], None)


def _threemf(path: Path) -> Read:
    with zipfile.ZipFile(path) as archive:
        word = xml.fromstring(archive.read("3D/3dmodel.model")).get("unit")
    return _of_meshes(_scene(path), next(METRES[unit] for unit, name in UNITS.items() if name == word))


def _step(path: Path) -> Read:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()  # which turns all lengths into millimetres
    reader.ReadFile(str(path))
    reader.TransferRoots()
    properties, box = GProp_GProps(), Bnd_Box()
    BRepGProp.VolumeProperties_s(reader.OneShape(), properties, 1e-6)
    BRepBndLib.AddOptimal_s(reader.OneShape(), box)
    corners = np.array([(c.X(), c.Y(), c.Z()) for c in (box.CornerMin(), box.CornerMax())])
    return Read(corners, float(properties.Mass()), METRES["mm"])


def _build123d(path: Path) -> Read:
    solid: Any = runpy.run_path(str(path))["assembly"]
    box = solid.bounding_box()
    return Read(np.array([tuple(box.min), tuple(box.max)]), float(solid.volume), None)


def _mjcf(path: Path) -> Read:
    """The mass, of water, is that of the blended surface."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    corners = []
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            local = model.mesh_vert[first : first + count]
        else:
            centre, half = np.split(model.geom_aabb[geom], 2)
            local = centre + np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * half
        corners.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    places = np.concatenate(corners)
    return Read(np.array([places.min(axis=0), places.max(axis=0)]), float(model.body_mass.sum()) / 1000, 1.0)


def _urdf(path: Path) -> Read:
    import yourdfpy

    robot = yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)
    mass = sum(link.inertial.mass for link in robot.robot.links if link.inertial is not None)
    return Read(np.asarray(robot.collision_scene.bounds), mass / 1000, 1.0)


def _sdf(path: Path) -> Read:
    """What collides, placed by the link's and its own poses; the mass, of water, is the blended surface's."""
    model = xml.parse(path).getroot().find("model")
    assert model is not None
    corners, mass = [], 0.0
    for link in model.findall("link"):
        assert link.find("pose") is None  # one link, at the model's own origin
        mass += float(link.findtext("inertial/mass", ""))
        for shape in link.findall("collision"):
            x, y, z, *angles = map(float, shape.findtext("pose", "0 0 0 0 0 0").split())
            pose = trimesh.transformations.euler_matrix(*angles)
            pose[:3, 3] = x, y, z
            corners.append(trimesh.transform_points(_sdf_points(shape, path), pose))
    places = np.concatenate(corners)
    return Read(np.array([places.min(axis=0), places.max(axis=0)]), mass / 1000, 1.0)


def _sdf_points(shape: xml.Element, path: Path) -> np.ndarray:
    (solid,) = shape.findall("geometry/*")
    sizes = {child.tag: [float(x) for x in child.text.split()] for child in solid if child.tag != "uri"}
    match solid.tag:
        case "mesh":
            return np.asarray(trimesh.load_mesh(path.with_name(solid.findtext("uri", ""))).vertices)
        case "box":
            return np.asarray(trimesh.creation.box(sizes["size"]).vertices)
        case "cylinder":
            return np.asarray(trimesh.creation.cylinder(*sizes["radius"], *sizes["length"]).vertices)
        case "sphere":
            return np.asarray(trimesh.creation.icosphere(4, *sizes["radius"]).vertices)
        case "capsule":
            half = np.array([0, 0, sizes["length"][0] / 2])
            ball = np.asarray(trimesh.creation.icosphere(4, *sizes["radius"]).vertices)
            return np.concatenate([ball - half, ball + half])
        case "ellipsoid":
            return np.asarray(trimesh.creation.icosphere(4).vertices) * sizes["radii"]
    raise AssertionError(solid.tag)


def _usd(path: Path) -> Read:
    """What is shown: guides are not."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    meshes = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        mesh = UsdGeom.Mesh(prim)
        if not mesh or mesh.ComputePurpose() == UsdGeom.Tokens.guide:
            continue
        matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0))
        points = np.array(mesh.GetPointsAttr().Get(), dtype=np.float64) @ matrix[:3, :3] + matrix[3, :3]
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        meshes.append(trimesh.Trimesh(points, faces))
    return _of_meshes(meshes, float(UsdGeom.GetStageMetersPerUnit(stage)))


# suffix -> the module that it takes, and the reader
READERS: dict[str, tuple[str, Callable[[Path], Read]]] = {
    ".json": ("", _json),
    ".html": ("", _html),
    ".glb": ("", lambda path: _of_meshes(_scene(path), 1.0)),
    ".ply": ("", _mesh),
    ".stl": ("", _mesh),
    ".obj": ("", _mesh),
    ".3mf": ("", _threemf),
    ".step": ("OCP", _step),
    ".build123d.py": ("build123d", _build123d),
    ".mjcf.xml": ("mujoco", _mjcf),
    ".urdf": ("yourdfpy", _urdf),
    ".sdf": ("", _sdf),
    ".usda": ("pxr", _usd),
    ".usdc": ("pxr", _usd),
    ".usd": ("pxr", _usd),
}
