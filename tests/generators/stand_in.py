"""A generator for tests: does with the picture what its first argument says."""

from __future__ import annotations

import json
import struct
import sys
import time
from itertools import product
from pathlib import Path

SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def glb_of(picture: bytes) -> bytes:
    """A box as wide and high as a PNG, a tenth of its width deep, in pixels."""
    width, height = struct.unpack(">II", picture[16:24])
    return box_glb(width, height, 0.1 * width)


def box_glb(*size: float) -> bytes:
    """Written by hand: nothing that takes long to import."""
    corners = [[s * c for s, c in zip(size, corner, strict=True)] for corner in product((0, 1), repeat=3)]
    triangles = [t for a, b, c, d in SIDES for t in (a, b, c, a, c, d)]
    data = struct.pack("<24f36H", *(x for corner in corners for x in corner), *triangles)
    views = [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}]
    accessors = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": 8,
            "type": "VEC3",
            "min": [0, 0, 0],
            "max": list(size),
        },
        {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
    ]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def main(way: str, picture: str, place: str) -> None:
    out = Path(place)
    taken = Path(picture).read_bytes() if way != "sleeps" else b""
    match way:
        case "writes":
            out.write_bytes(glb_of(taken))
        case "leaves":  # as TripoSR does: in a folder of its own, beside the picture that it took
            (out / "0").mkdir()
            (out / "0" / "input.png").write_bytes(taken)
            (out / "0" / "mesh.glb").write_bytes(glb_of(taken))
        case "names it itself":  # beside the path that it was given
            out.with_name("shape_00.GLB").write_bytes(glb_of(taken))
        case "makes a folder of it":
            out.mkdir()
            (out / "mesh.glb").write_bytes(glb_of(taken))
        case "leaves an OBJ":
            out.with_name("mesh.obj").write_text("v 0 0 0")
        case "leaves two":
            for name in ("a.glb", "b.glb"):
                (out / name).write_bytes(glb_of(taken))
        case "page":
            out.write_text("<!DOCTYPE html><html><head><title>Sign in</title></head></html>")
        case "text":
            out.write_text("out of credits")
        case "empty":
            out.write_bytes(b"")
        case "cut":
            out.write_bytes(glb_of(taken)[:200])
        case "old":
            out.write_bytes(struct.pack("<4sII", b"glTF", 1, 12))
        case "flat":
            out.write_bytes(box_glb(3, 2, 0))
        case "fails":
            print("loading the model")
            sys.exit("CUDA out of memory")
        case "sleeps":
            time.sleep(60)
        case "nothing":
            print("all is well")


if __name__ == "__main__":
    main(*sys.argv[1:])
