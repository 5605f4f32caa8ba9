"""UsdPhysics: colliders as native Gprims and convex meshes, and mass where the body may move.

They lie below the root, in a prim with the purpose "guide", which renderers leave out. All numbers are in the
stage's own unit, and masses in kilograms.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.approximation.collision import TOLERANCE
from partwright.approximation.round_cone import RoundCone
from partwright.assembly import Assembly, Similarity
from partwright.errors import SettingError
from partwright.export.collider_meshes import collider_mesh
from partwright.export.gltf_physics import principal_inertia
from partwright.export.rigid_body import DENSITY, Body
from partwright.export.usd_prims import define_mesh
from partwright.fields import Box, Capsule, Cone, Cylinder, Field, Frustum, Sphere
from partwright.meshing.mass import check_density
from partwright.shapes import METRES, canonical_unit

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Part

USD = "usd"
SHAPES: tuple[type[Field], ...] = (Box, Cylinder, Cone, Frustum, Sphere, Capsule, RoundCone)
_CELLS = 24  # along a part that becomes a hull


def check_physics(physics: str | None, density: float | None, tolerance: float | None, free: bool) -> None:
    """Raises SettingError for a kind of physics that there is not, or for options that need one."""
    if physics not in (None, USD):
        raise SettingError(f"physics: expected {USD}, got {physics!r}")
    if physics is None and (density is not None or tolerance is not None or free):
        raise SettingError(f"density, tolerance and free_joint are of rigid bodies: they need physics {USD}")


def body_of(assembly: Assembly, density: float | None, tolerance: float | None) -> Body:
    """The colliders in the assembly's own frame; its density is per cubic unit of length.

    Raises:
        NothingToExportError: no piece has a volume.
    """
    metres = METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0
    return Body.of(
        assembly,
        SHAPES,
        check_density(DENSITY if density is None else density) * metres**3,
        TOLERANCE if tolerance is None else tolerance,
        _CELLS,
        convex=True,
        frame=lambda _: Similarity(),
    )


def add_physics(stage: Any, root: Any, body: Body, moves: bool) -> None:
    """Add colliders below `root`, which becomes a rigid body where it `moves`."""
    from pxr import Gf, Tf, UsdGeom, UsdPhysics

    if moves:
        UsdPhysics.RigidBodyAPI.Apply(root)
        mass = UsdPhysics.MassAPI.Apply(root)
        moments, (w, x, y, z) = principal_inertia(body)
        mass.CreateMassAttr(body.properties.mass(body.density))
        mass.CreateCenterOfMassAttr(Gf.Vec3f(*body.properties.centre.tolist()))
        mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
        mass.CreatePrincipalAxesAttr(Gf.Quatf(w, x, y, z))
        UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    path = root.GetPath().AppendChild("colliders")
    number = 1
    while stage.GetPrimAtPath(path):
        number += 1
        path = root.GetPath().AppendChild(f"colliders_{number}")
    UsdGeom.Xform.Define(stage, path).CreatePurposeAttr(UsdGeom.Tokens.guide)
    for i, geometry in enumerate(body.geometries, 1):
        where = path.AppendChild(f"{Tf.MakeValidIdentifier(geometry.name)}_{i:02d}")
        mesh = collider_mesh(geometry) if geometry.part is None else None
        define_collider(stage, where, geometry.part, mesh)


def define_collider(stage: Any, path: Any, part: Part | None, mesh: trimesh.Trimesh | None) -> None:
    """A prim that collides: the Gprim of a part whose field is one of `SHAPES`, or a mesh as its hull."""
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    if part is None:
        gprim = define_mesh(stage, path, mesh)
        UsdPhysics.CollisionAPI.Apply(gprim.GetPrim())
        UsdPhysics.MeshCollisionAPI.Apply(gprim.GetPrim()).CreateApproximationAttr("convexHull")
        return
    gprim = _native(stage, path, part.field)
    double = UsdGeom.XformOp.PrecisionDouble
    gprim.AddTranslateOp(double).Set(Gf.Vec3d(*part.translation))
    gprim.AddOrientOp(double).Set(Gf.Quatd(*part.rotation))
    if isinstance(part.field, Box):
        gprim.AddScaleOp(double).Set(Gf.Vec3d(*part.field.size))
    time = Usd.TimeCode.Default()
    gprim.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(gprim, time))
    UsdPhysics.CollisionAPI.Apply(gprim.GetPrim())


def native_field(prim: Any) -> tuple[Field, np.ndarray] | None:
    """The field of a Gprim, and the (4, 4) that turns the field's z to the prim's axis; None for others."""
    from pxr import UsdGeom

    turn = np.eye(4)
    axes = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}
    if prim.IsA(UsdGeom.Cube):
        side = UsdGeom.Cube(prim).GetSizeAttr().Get()
        return Box((side, side, side)), turn
    if prim.IsA(UsdGeom.Sphere):
        return Sphere(UsdGeom.Sphere(prim).GetRadiusAttr().Get()), turn
    for schema, kind in ((UsdGeom.Cylinder, Cylinder), (UsdGeom.Capsule, Capsule), (UsdGeom.Cone, Cone)):
        if prim.IsA(schema):
            made = schema(prim)
            turn[:3, :3] = np.eye(3)[axes[str(made.GetAxisAttr().Get())]]
            return kind(made.GetRadiusAttr().Get(), made.GetHeightAttr().Get()), turn
    return None


def _native(stage: Any, path: Any, field: Field) -> Any:
    """The Gprim of one of `SHAPES`, about z; a box is a cube of side 1."""
    from pxr import UsdGeom

    match field:
        case Box():
            made, numbers = UsdGeom.Cube, {"Size": 1.0}
        case Sphere(radius=radius):
            made, numbers = UsdGeom.Sphere, {"Radius": radius}
        case Cylinder(radius=radius, height=height):
            made, numbers = UsdGeom.Cylinder, {"Radius": radius, "Height": height}
        case Capsule(radius=radius, height=height):
            made, numbers = UsdGeom.Capsule, {"Radius": radius, "Height": height}
        case Cone(radius=radius, height=height):
            made, numbers = UsdGeom.Cone, {"Radius": radius, "Height": height}
        case Frustum(bottom_radius=bottom, top_radius=top, height=height):
            made, numbers = UsdGeom.Cylinder_1, {"RadiusBottom": bottom, "RadiusTop": top, "Height": height}
        case RoundCone(bottom_radius=bottom, top_radius=top, height=height):
            made, numbers = UsdGeom.Capsule_1, {"RadiusBottom": bottom, "RadiusTop": top, "Height": height}
        case _:
            raise AssertionError(f"{field.kind} is not among SHAPES")
    gprim = made.Define(stage, path)
    for name, value in numbers.items():
        getattr(gprim, f"Create{name}Attr")(value)
    if "Height" in numbers:
        gprim.CreateAxisAttr(UsdGeom.Tokens.z)
    return gprim
