"""Edit an assembly (every edit gives a new one) and hand it to other programs."""

import dataclasses
import tempfile
from pathlib import Path

import partwright as pw
from partwright.fields import Box, Cylinder, Sphere

post = pw.Part(Cylinder(radius=0.5, height=4), name="post")
foot = pw.Part(Box((3, 3, 0.5)), translation=(0, 0, -2), blend=0.3, name="foot")
lamp = pw.Assembly((post, foot), name="lamp", unit="cm", up="z")

lamp = lamp | pw.Part(Sphere(1.2), translation=(0, 0, 2.5), name="globe")
lamp = lamp.renamed("foot", "base")
lamp = lamp.replace_part("post", dataclasses.replace(lamp["post"], field=Cylinder(radius=0.3, height=4)))
large = lamp.scaled(2.0).translated((10, 0, 0))
print([part.name for part in large.parts], large.bounds().round(2).tolist())

with tempfile.TemporaryDirectory() as folder:
    for suffix in ("json", "glb", "ply", "stl", "obj"):
        path = Path(folder) / f"lamp.{suffix}"
        pw.export(large, path)
        print(f"{path.name}: {path.stat().st_size:,} bytes")
