"""Build an assembly by hand: a mug with a hollow body and a bent handle. Measure, save and read it back."""

import math
import tempfile
from pathlib import Path

import numpy as np

import partwright as pw
from partwright.fields import Cylinder, SuperFrustum
from partwright.meshing import mesh_assembly

body = pw.Part(Cylinder(radius=40, height=95), translation=(0, 0, 47.5), name="body")
cavity = pw.Part(Cylinder(radius=36, height=95), translation=(0, 0, 52.5), name="cavity")
rod = SuperFrustum(size=(9, 9, 55), roundness=1.0, bulge=0.9)
handle = pw.Part(rod, translation=(-38, 0, 47.5), blend=4.0, name="handle")
mug = pw.Assembly(((body | handle) - cavity,), name="mug", unit="mm", up="z")

print("distance from the middle of the cavity:", mug.distance(np.array([[0.0, 0.0, 50.0]])))
surface = mesh_assembly(mug)
print(f"watertight: {surface.is_watertight}, {surface.volume / 1000:.1f} cubic centimetres of clay")
assert surface.is_watertight
assert surface.volume > math.pi * (40**2 * 95 - 36**2 * 90)  # the body alone; the handle adds to it

with tempfile.TemporaryDirectory() as folder:
    mug.save(Path(folder) / "mug.json")
    assert pw.load_assembly(Path(folder) / "mug.json") == mug
