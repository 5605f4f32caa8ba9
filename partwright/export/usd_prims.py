"""What files of USD are made of: Xforms under names that USD takes, meshes, places."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from partwright.assembly import Similarity


def define_xform(stage: Any, parent: str, name: str) -> Any:
    """An Xform under the name, or what of it USD allows, which its display name makes good."""
    from pxr import Tf, UsdGeom

    stem = plain = Tf.MakeValidIdentifier(name)
    number = 1
    while stage.GetPrimAtPath(f"{parent}/{plain}"):
        number += 1
        plain = f"{stem}_{number:02d}"
    prim = UsdGeom.Xform.Define(stage, f"{parent}/{plain}").GetPrim()
    if plain != name:
        prim.SetDisplayName(name)
    return prim


def define_mesh(stage: Any, path: Any, mesh: Any, colour: np.ndarray | None = None) -> Any:
    """A Mesh of triangles, not subdivided; colour: (3,) linear, 0 to 1."""
    from pxr import UsdGeom, Vt

    points, faces = np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32)
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([points.min(axis=0), points.max(axis=0)])))
    if colour is not None:
        prim.CreateDisplayColorAttr(Vt.Vec3fArray.FromNumpy(colour[None].astype(np.float32)))
    return prim


def define_normals(mesh: Any, normals: Any) -> None:
    """Of a mesh's vertices (V, 3)."""
    from pxr import UsdGeom, Vt

    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(normals, np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)


def define_texture(mesh: Any, path: str, uv: np.ndarray, picture: str, relief: str | None = None) -> None:
    """A mesh's coordinates (V, 2) and a material with a picture beside the file, bound to it; relief: a
    normal map, too."""
    from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

    kinds, stage = Sdf.ValueTypeNames, mesh.GetPrim().GetStage()
    primvars = UsdGeom.PrimvarsAPI(mesh)
    coordinates = primvars.CreatePrimvar("st", kinds.TexCoord2fArray, UsdGeom.Tokens.vertex)
    coordinates.Set(Vt.Vec2fArray.FromNumpy(np.asarray(uv, np.float32)))
    material = UsdShade.Material.Define(stage, path)
    reader = UsdShade.Shader.Define(stage, f"{path}/coordinates")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", kinds.String).Set("st")
    place = reader.CreateOutput("result", kinds.Float2)

    def read(name: str, file: str, space: str) -> Any:
        texture = UsdShade.Shader.Define(stage, f"{path}/{name}")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", kinds.Asset).Set(Sdf.AssetPath(f"./{file}"))
        texture.CreateInput("sourceColorSpace", kinds.Token).Set(space)
        for axis in ("wrapS", "wrapT"):
            texture.CreateInput(axis, kinds.Token).Set("clamp")
        texture.CreateInput("st", kinds.Float2).ConnectToSource(place)
        return texture

    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    colour = read("picture", picture, "sRGB").CreateOutput("rgb", kinds.Float3)
    shader.CreateInput("diffuseColor", kinds.Color3f).ConnectToSource(colour)
    if relief is not None:
        texture = read("relief", relief, "raw")
        texture.CreateInput("scale", kinds.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
        texture.CreateInput("bias", kinds.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
        bent = texture.CreateOutput("rgb", kinds.Float3)
        shader.CreateInput("normal", kinds.Normal3f).ConnectToSource(bent)
    shader.CreateInput("roughness", kinds.Float).Set(0.7)
    surface = shader.CreateOutput("surface", kinds.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def place(prim: Any, pose: Similarity) -> None:
    """Its translation and rotation."""
    from pxr import Gf, UsdGeom

    xform = UsdGeom.Xformable(prim)
    double = UsdGeom.XformOp.PrecisionDouble
    xform.AddTranslateOp(double).Set(Gf.Vec3d(*pose.translation))
    xform.AddOrientOp(double).Set(Gf.Quatd(*pose.rotation))


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """USD's colours are linear."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def exported(stage: Any, suffix: str) -> bytes:
    """The root layer as a file. Where USD itself cannot write, it says so in errors of its own: our own file
    errors are clearer."""
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / f"stage{suffix}"
        stage.GetRootLayer().Export(str(whole))
        return whole.read_bytes()
