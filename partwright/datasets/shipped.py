"""The shapes that ship in examples/shapes, which the documentation's commands use.

`python -m partwright.datasets.shipped FOLDER` writes them: the same bytes every time.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.atomic_io import write_bytes
from partwright.datasets import demo
from partwright.datasets.making import bar, plate, ring, rod, to_mesh, write_ply
from partwright.datasets.objects import bracket, mug

if TYPE_CHECKING:
    import trimesh

_METRES_Y_UP = ((0.01, 0, 0, 0), (0, 0, 0.01, 0), (0, -0.01, 0, 0), (0, 0, 0, 1))  # from centimetres, Z up


def truck() -> trimesh.Scene:
    """A toy truck 28 cm long as a scene of named nodes: chassis, cab, bed, and four wheels; metres, Y up."""
    import trimesh

    wheel = (rod(2.4, 2.6) + rod(2.8, 1.3)).rotate((90, 0, 0)) - rod(4, 0.5).rotate((90, 0, 0))
    nodes = {
        "chassis": bar(26, 6, 1.6).translate((0, 0, 3.6)),
        "cab": plate(3.4, 4.6, 7.5, 1.0).translate((-9, 0, 4.4)),
        "bed": (bar(16, 10, 5) - bar(15, 9, 5).translate((0, 0, 0.8))).translate((5, 0, 6.9)),
        "hook": ring(0.9, 0.3).translate((13.8, 0, 3.6)),
    }
    for front, x in (("front", -8.5), ("rear", 8.5)):
        nodes[f"wheel_{front}_left"] = wheel.rotate((0, 0, 180)).translate((x, 3.2, 2.6))
        nodes[f"wheel_{front}_right"] = wheel.translate((x, -3.2, 2.6))
    scene = trimesh.Scene(base_frame="world")
    for name, solid in nodes.items():
        mesh = to_mesh(solid).apply_transform(_METRES_Y_UP)
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    return scene


def write(folder: str | Path) -> None:
    """Write watering_can.ply, mug.ply, bracket.stl and truck.glb."""
    from trimesh.exchange.gltf import export_glb
    from trimesh.exchange.stl import export_stl

    folder = Path(folder)
    demo.write(folder / "watering_can.ply")
    write_ply(mug(), folder / "mug.ply")
    write_bytes(folder / "bracket.stl", export_stl(bracket()))
    write_bytes(folder / "truck.glb", export_glb(truck(), include_normals=False))


if __name__ == "__main__":
    write(sys.argv[1])
