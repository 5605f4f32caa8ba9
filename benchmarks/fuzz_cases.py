"""What `fuzz.py` tries: small whole files of every format that is read, ways to break them, odd commands."""

from __future__ import annotations

import io
import json
import os
import random
import re
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

import partwright as pw
from partwright.meshing import mesh_assembly
from partwright.shapes import MESH_SUFFIXES, load_shape

# Whole files by name; a file that is only there to be named by a command has no breaks of its own.
Files = dict[str, bytes]
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
ODD_NUMBERS = (
    b"0", b"-1", b"1", b"-0.0", b"1e200", b"-1e200", b"1e-300", b"1e999", b"nan", b"inf", b"-inf",
    b"4294967295", b"2147483648", b"-2147483649", b"99999999999999999999", b"1" * 5000, b"0x10", b"1,5", b"",
)  # fmt: skip
ODD_COUNTS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x10000, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000)
PIECES = (b"\0", b"\xff\xfe", b"\r", b"\n\n\n", b"{", b"[" * 3000, b'{"a":' * 3000, b"<", b"&amp;" * 100)


def whole_files(folder: Path) -> Files:
    """A file of every format that is read, of a block with a knob, and assemblies; written to `folder`."""
    cut = pw.fields.Cylinder(0.3, 2.0)
    block = pw.Assembly((pw.Part(pw.fields.Box((2, 1, 1)), name="block"),), unit="mm", up="z")
    drilled = block - pw.Part(cut, (0.4, 0, 0), name="hole")
    union = block | pw.Part(pw.fields.Sphere(0.6), (1, 0, 0), (0.8, 0.6, 0, 0), blend=0.1, name="knob")
    quadrics = pw.Assembly(
        tuple(
            pw.Part(pw.fields.Quadric.plane(normal, 0.5))
            for normal in np.vstack([np.eye(3), -np.eye(3)]).tolist()
        ),
        "intersection",
    )
    for name, assembly in {"drilled": drilled, "union": union, "quadrics": quadrics}.items():
        assembly.save(folder / f"{name}.json")
    mesh = mesh_assembly(union, 16)
    scene = trimesh.Scene()
    for name, x in (("left", 0.0), ("right", 3.0)):
        scene.add_geometry(mesh.copy().apply_translation((x, 0, 0)), node_name=name, geom_name=name)
    for suffix in MESH_SUFFIXES:
        (scene if suffix in (".glb", ".gltf", ".3mf") else mesh).export(folder / f"mesh{suffix}")
    (folder / "text.ply").write_bytes(trimesh.exchange.ply.export_ply(mesh, encoding="ascii"))
    (folder / "text.stl").write_text(trimesh.exchange.stl.export_stl_ascii(mesh))
    shape = load_shape((mesh.vertices, mesh.faces))
    samples = shape.unit_surface(400, seed=0)
    rows = np.hstack([samples.points, samples.normals])
    np.save(folder / "points.npy", rows)
    np.savez_compressed(folder / "points.npz", points=samples.points, normals=samples.normals)
    np.savetxt(folder / "points.xyz", rows, fmt="%.5f")
    trimesh.PointCloud(samples.points).export(folder / "points.ply")
    occupied = shape.unit_occupancy(16)
    np.savez_compressed(folder / "grid.npz", occupancy=occupied, origin=np.zeros(3), spacing=0.125)
    np.save(folder / "grid.npy", shape.unit_grid(16).values)
    (folder / "grid.binvox").write_bytes(_binvox(occupied))
    with_step(drilled, folder / "solid.step")
    files = {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}
    return {name: data for name, data in files.items() if not name.endswith(".report.json")}


def with_step(assembly: pw.Assembly, path: Path) -> None:
    """STEP needs the extra `cad`; without it the format is left out."""
    try:
        pw.export(assembly, path)
    except pw.errors.MissingDependencyError:
        return


def _binvox(occupied: np.ndarray) -> bytes:
    flat = occupied.transpose(0, 2, 1).ravel()
    runs = b"".join(bytes((int(value), 1)) for value in flat)
    side = len(occupied)
    return f"#binvox 1\ndim {side} {side} {side}\ntranslate 0 0 0\nscale 1\ndata\n".encode() + runs


Break = Callable[[bytes, random.Random], bytes]


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def flip(data: bytes, rng: random.Random) -> bytes:
    broken = bytearray(data)
    for _ in range(rng.choice((1, 1, 3, 30))):
        broken[rng.randrange(len(broken))] ^= 1 << rng.randrange(8)
    return bytes(broken)


def swap_numbers(data: bytes, rng: random.Random) -> bytes:
    """Some of the numbers that stand in the text (in a binary file, mostly in its header)."""
    found = list(NUMBER.finditer(data, 0, 200_000))
    if not found:
        return flip(data, rng)
    odd = rng.choice(ODD_NUMBERS)
    every = rng.random() < 0.1
    for match in reversed(found if every else rng.sample(found, min(len(found), rng.choice((1, 1, 5))))):
        data = data[: match.start()] + odd + data[match.end() :]
    return data


def edit_counts(data: bytes, rng: random.Random) -> bytes:
    """Four bytes somewhere, mostly near the front, become a number that counts rarely have."""
    end = len(data) if rng.random() < 0.4 else min(len(data), 200)
    place = rng.randrange(max(1, end - 4))
    return data[:place] + struct.pack("<I", rng.choice(ODD_COUNTS)) + data[place + 4 :]


def repeat(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted((rng.randrange(len(data)), rng.randrange(len(data))))
    return data[:b] + data[a:b] * rng.choice((1, 2, 20)) + data[b:]


def insert(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + rng.choice(PIECES) + data[place:]


def drop(data: bytes, rng: random.Random) -> bytes:
    a = rng.randrange(len(data))
    return data[:a] + data[a + rng.choice((1, 4, 40, 400)) :]


def shuffle_lines(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    rng.shuffle(lines)
    return b"".join(lines)


def other_encoding(data: bytes, rng: random.Random) -> bytes:
    return data.decode("latin-1").encode(rng.choice(("utf-16", "utf-32", "utf-7")))


BREAKS: tuple[Break, ...] = (
    cut, cut, flip, swap_numbers, swap_numbers, edit_counts, repeat, insert, drop, shuffle_lines,
    other_encoding,
)  # fmt: skip


def broken_file(files: Files, rng: random.Random) -> tuple[str, bytes, str]:
    """A file's name, its broken bytes, and how it was broken."""
    name = rng.choice(sorted(name for name in files if not name.endswith(".bin")))
    way = rng.choice(BREAKS)
    data, inner = files[name], ""
    if name.endswith((".3mf", ".npz")) and rng.random() < 0.6:
        data, inner = _broken_member(data, way, rng)
    elif name.endswith((".glb", ".gltf")) and rng.random() < 0.7:
        data, inner = _broken_gltf(data, name.endswith(".glb"), rng), "tree "
    elif name.endswith(".json") and rng.random() < 0.5:
        data, inner = _text(_broken_tree(json.loads(data), rng)), "tree "
    else:
        data = way(data, rng)
    return name, data, inner + ("" if inner == "tree " else way.__name__)


def _broken_member(data: bytes, way: Break, rng: random.Random) -> tuple[bytes, str]:
    """The archive with one file in it broken."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(target, "w") as copy:
        chosen = rng.choice(archive.namelist())
        for name in archive.namelist():
            content = archive.read(name)
            copy.writestr(name, way(content, rng) if name == chosen and content else content)
    return target.getvalue(), "inner "


def _broken_gltf(data: bytes, binary: bool, rng: random.Random) -> bytes:
    if not binary:
        return _text(_broken_tree(json.loads(data), rng))
    (length,) = struct.unpack("<I", data[12:16])
    text = _text(_broken_tree(json.loads(data[20 : 20 + length]), rng))
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


ODD_VALUES = (
    None, True, "", "x" * 100_000, [], {}, -1, 0, 1, 2**31, 2**64, 1e200, -1e200, 1e-300, [[]], [1, 2],
    [float("nan")] * 4, float("nan"), float("inf"), [1e200] * 3, [0, 0, 0], [0, 0, 0, 0], [1e30] * 16,
)  # fmt: skip


def _text(tree: object) -> bytes:
    """As JSON, however deep: whoever reads it has to do with less."""
    usual = sys.getrecursionlimit()
    sys.setrecursionlimit(20_000)
    try:
        return json.dumps(tree).encode()
    finally:
        sys.setrecursionlimit(usual)


def _broken_tree(tree: object, rng: random.Random) -> object:
    """One value of a JSON tree swapped, dropped, or put inside copies of itself."""
    places: list[tuple[dict | list, object]] = []

    def walk(node: object) -> None:
        entries = (
            node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        )
        for key, value in entries:
            places.append((node, key))
            walk(value)

    walk(tree)
    for _ in range(rng.choice((1, 1, 2))):
        holder, key = rng.choice(places)
        way = rng.random()
        if way < 0.65:
            holder[key] = rng.choice(ODD_VALUES)
        elif way < 0.8 and isinstance(holder, list):
            holder.extend([holder[key]] * rng.choice((1, 50)))
        elif way < 0.9:
            nested = holder[key]
            for _ in range(rng.choice((3, 90, 400))):
                nested = {"children": [nested], "operation": "union", "name": ""}
            holder[key] = nested
        elif isinstance(holder, dict):
            holder.pop(key, None)
    return tree


SOUND = ("mesh.stl", "mesh.glb", "mesh.obj", "points.xyz", "grid.npz", "text.ply")
SHAPES = (
    *SOUND, "missing.stl", "drilled.json",
    "folder", "pipe", "loop.stl", "empty.stl", "", "/dev/zero", "/dev/null", "no\nname.stl", "x" * 300,
)  # fmt: skip
ASSEMBLIES = (
    "drilled.json", "union.json", "quadrics.json", "flat.json", "apart.json", "huge.json", "mesh.stl",
    "missing.json", "folder", "pipe", "empty.json", "deep.json", "nested.json", "learned.json",
    "/dev/zero", "/dev/null",
)  # fmt: skip
NUMBERS = (
    "0",
    "-1",
    "1",
    "2",
    "0.5",
    "1e200",
    "1e-300",
    "nan",
    "inf",
    "-inf",
    "",
    "abc",
    "9" * 400,
    "x" * 9000,
)
OUTPUTS = (
    "out.glb", "out.obj", "out.stl", "out.ply", "out.3mf", "out.scad", "out.json", "out.mjcf.xml", "out.urdf",
    "out.build123d.py", "out.blender.py", "out.glsl", "out.step", "out.usda", "out.dwg", "out", "folder",
    "no/such/out.glb", "empty.stl/out.glb", "",
)  # fmt: skip

# Option -> values; None stands for an option without one.
FIT = {
    "--method": ("superfrusta", "solids", "capri", "magic", "x" * 9000),
    "--max-parts": ("1", "2", *NUMBERS),
    "--min-iou": NUMBERS,
    "--tolerance": ("0.5mm", "1%", "-1%", "1 parsec", *NUMBERS),
    "--contain": NUMBERS,
    "--inside": NUMBERS,
    "--curve": None,
    "--start": ASSEMBLIES,
    "--lock": ("block", "nobody", ",,,", "x" * 9000),
    "--per-node": None,
    "--no-symmetry": None,
    "--subtract": None,
    "--clean": None,
    "--clean-tolerance": NUMBERS,
    "--unit": ("mm", "parsec", "", "x" * 9000),
    "--density": NUMBERS,
    "--up": ("x", "-z", "w", ""),
    "--device": ("cpu", "abacus"),
    "--seed": NUMBERS,
    "--threads": NUMBERS,
}
EXPORT = {
    "--density": NUMBERS,
    "--tolerance": NUMBERS,
    "--free-joint": None,
    "--by-part": None,
    "--resolution": ("8", "16", "100000000", *NUMBERS),
    "--facets": NUMBERS,
    "--separate": None,
}
# A part of a model that is not here.
LEARNED = {
    "kind": "neural", "model": "sheds", "hash": "0" * 64, "part": "door", "latent": [0.0], "unit": 1.0,
    "half_lengths": [1.0, 1.0, 1.0],
}  # fmt: skip
EVERYWHERE = {"--help": None, "--no-such-option": None, "--": None}


def random_command(rng: random.Random) -> list[str]:
    """Arguments of one call of `partwright`, in a folder with `whole_files` and `odd_files`."""
    kind = rng.choice(
        ("fit", "fit", "export", "export", "evaluate", "describe", "clean", "segment", "parts", "?")
    )
    if kind == "fit":
        # A fit that is sound takes seconds, and a CSG tree of more than a box half a minute.
        options = ["--quality", "draft", "--max-parts", "2", *_options(FIT, rng, 3)]
        shape, output = rng.choice(SHAPES), rng.choice(("out", "folder", "empty.stl", ""))
        if "capri" in options and shape in SOUND:
            shape = "box.stl"
        return ["fit", shape, "-o", output, *options]
    if kind == "export":
        return ["export", rng.choice(ASSEMBLIES), "-o", rng.choice(OUTPUTS), *_options(EXPORT, rng, 2)]
    if kind == "evaluate":
        options = _options({"--json": None, "--cad": ("200", *NUMBERS)}, rng, 1)
        return ["evaluate", rng.choice(ASSEMBLIES), rng.choice(SHAPES), *options]
    if kind == "describe":
        return ["describe", rng.choice(ASSEMBLIES), *_options({"--digits": NUMBERS}, rng, 1)]
    if kind == "clean":
        options = _options({"--clean-tolerance": NUMBERS, "--shape": SHAPES}, rng, 1)
        return ["clean", rng.choice(ASSEMBLIES), "-o", rng.choice(OUTPUTS), *options]
    if kind == "segment":
        options = _options({"--within": ("nodes", *SHAPES), "--split": None}, rng, 1)
        return ["segment", rng.choice(SHAPES), rng.choice(ASSEMBLIES), "-o", rng.choice(OUTPUTS), *options]
    if kind == "parts":
        return ["parts", *_parts_command(rng)]
    words = ("", "fit", "magic", "--version", "--help", "\x1b[31m", "x" * 9000, "parts", "-o", *OUTPUTS)
    return [rng.choice(words) for _ in range(rng.randrange(4))]


def _parts_command(rng: random.Random) -> list[str]:
    """Only ones that end early: what a model computes takes long, and reads nothing of the user's."""
    sources = ("union.json", "cars:nobody", "nomodel:0", "cars", "", "empty.json", "pipe", "x" * 9000)
    edit = rng.choice(("--move", "--turn", "--scale", "--drop", "--resample", "--swap"))
    value = rng.choice(("block=1,2,3", "block=", "=", "block=nan,1,1", "x" * 9000, "nobody"))
    return rng.choice(
        (
            ["edit", rng.choice(sources), edit, value, "-o", rng.choice(OUTPUTS)],
            ["interpolate", rng.choice(sources), rng.choice(sources), "-o", "out.gif", "--steps", "1"],
            ["reconstruct", rng.choice(("nomodel", "mesh.stl", "folder", "pipe", "empty.stl")), "mesh.stl"],
            ["train", rng.choice((*SHAPES, *ASSEMBLIES)), "-o", "out"],
            ["prepare", rng.choice(("folder", "missing", "mesh.stl", "")), "-o", "out", "--workers", "1"],
            [
                "prepare",
                "mixers",
                "-o",
                "out",
                rng.choice(("--count", "--samples")),
                rng.choice(("0", "-1", "x")),
            ],
        )
    )


def _options(known: dict[str, tuple[str, ...] | None], rng: random.Random, most: int) -> list[str]:
    pool = {**known, **EVERYWHERE} if rng.random() < 0.1 else known
    result: list[str] = []
    for name in rng.sample(sorted(pool), min(len(pool), rng.randrange(most + 1))):
        values = pool[name]
        result += [name] if values is None else [name, rng.choice(values)]
    return result


def odd_files(folder: Path) -> None:
    """What commands stumble over beside broken files: a folder, a pipe, a link to itself, extremes."""
    (folder / "folder").mkdir()
    os.mkfifo(folder / "pipe")
    (folder / "loop.stl").symlink_to("loop.stl")
    for name in ("empty.stl", "empty.json"):
        (folder / name).touch()
    flat = pw.Assembly((pw.Part(pw.fields.SuperFrustum((0, 0, 0)), name="flat"),))
    flat.save(folder / "flat.json")
    planes = (pw.fields.Quadric.plane((1, 0, 0), -1.0), pw.fields.Quadric.plane((-1, 0, 0), -1.0))
    pw.Assembly(tuple(map(pw.Part, planes)), "intersection").save(folder / "apart.json")
    text = (folder / "union.json").read_text()
    (folder / "huge.json").write_text(text.replace("1.0", "1e200"))
    nested = pw.Assembly((pw.Part(pw.fields.Box((1, 1, 1))),))
    for operation in ("union", "difference", "intersection") * 20:
        nested = pw.Assembly((nested, pw.Part(pw.fields.Sphere(0.4), (0.5, 0.5, 0.5))), operation)
    nested.save(folder / "nested.json")
    (folder / "learned.json").write_text(
        json.dumps(json.loads(text) | {"children": [{"name": "door", "field": LEARNED}]})
    )
    trimesh.creation.box((2, 1, 1)).export(folder / "box.stl")
    (folder / "deep.json").write_text('{"children": [' * 5000)
