"""Other programs that turn a shape into parts, run as they come: what each makes of a mesh, as a mesh.

A peer that is not here raises `Missing`, and says what would bring it. Those that bring dependencies of their
own run in an environment of their own.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from partwright.shapes import Shape

MPS_GRID = 100  # along a side: the authors' default
SIDES = 40  # of a cube's face, in the mesh of a superquadric
LIMIT = 1200  # seconds


class Missing(Exception):
    """The peer cannot be run here; the message says what it needs."""


@dataclass(frozen=True)
class Made:
    """What a peer made of a shape: a mesh in the shape's own units, or None of one that gives no solid."""

    parts: int
    cpu_seconds: float
    mesh: trimesh.Trimesh | None
    note: str = ""


@dataclass(frozen=True)
class Peer:
    """A program: how it is run, and the method of ours that does what it does."""

    about: str
    beside: str
    run: Callable[[Shape, Path | None], Made]


def coacd(shape: Shape, where: Path | None) -> Made:
    """CoACD, default settings: convex hulls."""
    try:
        import coacd as package
    except ImportError:
        raise Missing('pip install "partwright[bench]"') from None
    package.set_log_level("error")
    start = time.process_time()
    pieces = package.run_coacd(package.Mesh(shape.vertices, shape.faces))
    spent = time.process_time() - start
    hulls = [trimesh.Trimesh(vertices, faces).convex_hull for vertices, faces in pieces]
    return Made(len(hulls), spent, trimesh.util.concatenate(hulls))


def detected(shape: Shape, where: Path | None) -> Made:
    """build123d's detect_primitives: analytic faces and what is left of the mesh, no solid."""
    try:
        import build123d
        from build123d import detect_primitives
    except ImportError:
        raise Missing("pip install 'build123d>=0.13'") from None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shape.stl"
        trimesh.Trimesh(shape.vertices, shape.faces).export(path)
        mesh = build123d.Mesher().read(path)
    start = time.process_time()
    faces, left, _ = detect_primitives(mesh[0])
    spent = time.process_time() - start
    covered = 1 - sum(face.area for face in left) / shape.area
    return Made(len(faces), spent, None, f"{100 * covered:.0f} % of the surface, as faces of no solid")


_MPS = """
import json, sys, time
import numpy as np
from marching_primitives.mps import MPS
from marching_primitives.utils import load_sdf_csv
sdf, grid = load_sdf_csv(sys.argv[1])
start = time.process_time()
rows = MPS(sdf, grid, verbose=False)
print(json.dumps({"rows": np.asarray(rows).tolist(), "seconds": time.process_time() - start}))
"""


def marching_primitives(shape: Shape, where: Path | None) -> Made:
    """Marching Primitives, its authors' Python port, default settings, of a grid of our signed distances."""
    if where is None:
        raise Missing("--marching-primitives PYTHON, of an environment with `pip install CLONE` of the port")
    axis = np.linspace(-1, 1, MPS_GRID)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")  # x runs fastest
    distance = shape.unit_distance(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sdf.csv"
        np.savetxt(path, np.concatenate([[MPS_GRID, -1, 1, -1, 1, -1, 1], distance]))
        told = subprocess.run(
            [where, "-c", _MPS, path], capture_output=True, text=True, check=True, timeout=LIMIT
        ).stdout
    found = json.loads(told.splitlines()[-1])
    pieces = [superquadric_mesh(np.array(row)) for row in found["rows"]]
    for piece in pieces:
        piece.vertices = shape.frame.from_unit(piece.vertices)
    return Made(len(pieces), found["seconds"], trimesh.util.concatenate(pieces))


def superquadric_mesh(row: np.ndarray) -> trimesh.Trimesh:
    """A closed mesh of (e1, e2, a, b, c, three Euler angles about z, y, x, centre), as their `MPS` returns.

    The surface is star-shaped: points of a cube, stretched to the half extents, are moved along their ray
    onto it, so that edges of nearly a box stay edges.
    """
    cube = trimesh.creation.box((2, 2, 2))
    for _ in range(5):
        cube = cube.subdivide()
    e1, e2 = np.clip(row[:2], 0.02, None)
    x, y, z = np.clip(np.abs(cube.vertices), 1e-9, None).T
    across = np.maximum(x, y) * (1 + (np.minimum(x, y) / np.maximum(x, y)) ** (2 / e2)) ** (e2 / 2)
    scale = np.maximum(across, z) * (1 + (np.minimum(across, z) / np.maximum(across, z)) ** (2 / e1)) ** (
        e1 / 2
    )
    points = cube.vertices / scale[:, None] * row[2:5]
    points = Rotation.from_euler("ZYX", row[5:8]).apply(points) + row[8:11]
    return trimesh.Trimesh(points, cube.faces)


PEERS = {
    "marching_primitives": Peer("Marching Primitives (superquadrics)", "superfrusta", marching_primitives),
    "coacd": Peer("CoACD (convex hulls)", "superfrusta", coacd),
    "detect_primitives": Peer("build123d detect_primitives (faces)", "capri", detected),
}
