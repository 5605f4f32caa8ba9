"""Maps of parts in USD and in Blender's script: as the part has them, those that are alike stored once."""

from __future__ import annotations

import base64
import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import UnreadableFileError
from partwright.export import export
from partwright.fields import Box, Cylinder, Sphere
from partwright.textures import PartMap, load_colours, part_map


def smooth(blue: int) -> str:
    """A map that goes over into itself at the folds of the octahedron: coordinates by their distance from
    the middle."""
    across = np.abs(np.linspace(-1, 1, 32))
    image = np.full((32, 32, 3), blue, np.uint8)
    image[..., 0], image[..., 1] = 255 * across[:, None], 255 * across[None]
    return PartMap(image).text()


def toy() -> Assembly:
    """Box and ball look alike; the ball is there twice; the knob has one colour."""
    return Assembly(
        (
            Part(Box((1, 1, 1)), name="a box", metadata={"texture": smooth(40)}),
            Part(
                Sphere(0.7),
                (2, 0, 0),
                name="ball",
                metadata={"texture": smooth(40)},
                instances=(Similarity(translation=(0, 2, 0)),),
            ),
            Part(Cylinder(0.3, 2.0), (0, 2, 0), name="rod", metadata={"texture": smooth(200)}),
            Part(Sphere(0.4), (0, -2, 0), name="knob", metadata={"colour": "#ff8000"}),
        ),
        unit="m",
        up="z",
        name="toy",
    )


def looked_up(png: bytes, uv: np.ndarray) -> np.ndarray:
    """Colours of a picture at (N, 2) from its lower left, as renderers look them up: bilinear."""
    with Image.open(io.BytesIO(png)) as opened:
        image = np.asarray(opened.convert("RGB"), float)[::-1]
    height, width = image.shape[:2]
    place = uv * (width, height) - 0.5
    low = np.floor(place).astype(int)
    share = place - low
    result = np.zeros((len(uv), 3))
    for dx, dy in np.ndindex(2, 2):
        x, y = np.clip(low[:, 0] + dx, 0, width - 1), np.clip(low[:, 1] + dy, 0, height - 1)
        weight = np.abs(1 - dx - share[:, 0]) * np.abs(1 - dy - share[:, 1])
        result += weight[:, None] * image[y, x]
    return result


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_usd_shows_each_part_in_its_map(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdShade, UsdValidation

    export(toy(), tmp_path / f"toy{suffix}")
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["toy_a_box.png", "toy_rod.png"]
    stage = Usd.Stage.Open(str(tmp_path / f"toy{suffix}"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert not errors, [error.GetMessage() for error in errors]
    parts = {part.name: part for part in toy().parts}
    seen = []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Mesh):
            continue
        part = parts[{"a_box": "a box", "ball_2": "ball"}.get(n := prim.GetParent().GetName(), n)]
        seen.append(part.name)
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        if part.name == "knob":
            assert not material
            linear = UsdGeom.Mesh(prim).GetDisplayColorAttr().Get()[0]
            assert np.allclose(linear, [1, 0.2159, 0], atol=1e-3)
            continue
        surface = material.ComputeSurfaceSource()[0]
        texture = UsdShade.Shader(surface.GetInput("diffuseColor").GetConnectedSource()[0].GetPrim())
        picture = tmp_path / texture.GetInput("file").Get().path
        uv = np.array(UsdGeom.PrimvarsAPI(prim).GetPrimvar("st").Get())
        points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get())
        own = part_map(part)
        assert own is not None
        wanted = own.at(part.field, points)
        assert np.abs(looked_up(picture.read_bytes(), uv) - wanted).max() < 9  # half a texel at the border
    assert sorted(seen) == ["a box", "ball", "ball", "knob", "rod"]
    assert b"base64" not in (tmp_path / f"toy{suffix}").read_bytes()  # the picture alone has the map


def test_blenders_script_has_each_map_once_and_corners_that_fit(tmp_path: Path) -> None:
    export(toy(), tmp_path / "toy.blender.py")
    text = (tmp_path / "toy.blender.py").read_text("ascii")
    data: dict = {}
    exec(text[: text.index("import base64")], data)
    exec(text[text.index("MESHES = {") : text.rindex("main()")], data)
    assert len(data["PICTURES"]) == 2
    assert set(data["MAPS"]) == {"a box", "ball", "ball_02", "rod"}
    assert next(entry["colour"] for entry in data["PARTS"] if entry["name"] == "knob") == [1.0, 0.502, 0.0]
    for name, (coordinates, number) in data["MAPS"].items():
        vertices, faces = map(np.array, data["MESHES"][name])
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed, for booleans
        part = next(part for part in toy().parts if part.name == name.removesuffix("_02"))
        own = part_map(part)
        assert own is not None
        shown = looked_up(base64.b64decode(data["PICTURES"][number]), np.array(coordinates))
        assert np.abs(shown - own.at(part.field, vertices[faces.ravel()])).max() < 9


def test_blender_itself_packs_the_pictures(tmp_path: Path) -> None:
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is missing (Debian: blender)")
    export(toy(), tmp_path / "toy.blender.py")
    asked = tmp_path / "ask.py"
    asked.write_text(
        "import bpy\n"
        "assert sorted(i.size[0] for i in bpy.data.images if i.packed_file) == [32, 32]\n"
        "assert [len(bpy.data.objects[n].data.uv_layers) for n in ('a box', 'knob')] == [1, 0]\n"
    )
    command = [
        blender,
        "-b",
        "--factory-startup",
        "--python-exit-code",
        "3",
        "-P",
        tmp_path / "toy.blender.py",
    ]
    done = subprocess.run([*command, "-P", asked], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_picture_that_ends_too_early_is_named(tmp_path: Path) -> None:
    """Its header says how large it is, so only reading it whole tells."""
    rng = np.random.default_rng(0)
    Image.fromarray(rng.integers(0, 256, (64, 64, 3)).astype(np.uint8)).save(tmp_path / "wood.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd wood.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
    )
    assert load_colours(tmp_path / "a.obj")
    whole = (tmp_path / "wood.png").read_bytes()
    (tmp_path / "wood.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UnreadableFileError, match=r"a\.obj: its picture wood\.png cannot be read"):
        load_colours(tmp_path / "a.obj")
    (tmp_path / "wood.png").unlink()
    with pytest.raises(UnreadableFileError, match=r"a\.obj: its picture wood\.png: .*no such file"):
        load_colours(tmp_path / "a.obj")
