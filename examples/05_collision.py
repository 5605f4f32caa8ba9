"""A robot link made of parts, exported to MJCF as MuJoCo's own geoms, dropped and collided.

Needs MuJoCo: pip install mujoco
"""

import json
import sys
import tempfile
from pathlib import Path

import partwright as pw

try:
    import mujoco
except ImportError:
    print("skipped: this example needs MuJoCo; install it with: pip install mujoco")
    sys.exit(0)

# A forearm, 40 cm long: a tapered tube between two joints. Any shape would do: its parts are what is fitted.
upright = pw.fields.SuperFrustum((0.09, 0.09, 0.30), roundness=1.0, taper=0.75)
across = (0.5**0.5, 0.5**0.5, 0.0, 0.0)  # the joints' axes lie along y
link = pw.Assembly(
    [
        pw.Part(upright, (0, 0, 0.2), name="tube"),
        pw.Part(pw.fields.Cylinder(0.06, 0.12), (0, 0, 0.03), across, blend=0.02, name="elbow"),
        pw.Part(pw.fields.Cylinder(0.045, 0.1), (0, 0, 0.36), across, blend=0.02, name="wrist"),
    ],
    name="forearm",
    unit="m",
    up="z",
)

with tempfile.TemporaryDirectory() as folder:
    mesh = Path(folder) / "forearm.ply"
    pw.export(link, mesh, resolution=64)
    shape = pw.load_shape(mesh, unit="m", up="z")
    fitted = pw.fit(shape, quality="draft", max_parts=4, seed=0)
    path = Path(folder) / "forearm.mjcf.xml"
    pw.export(fitted.assembly, path, density=2700.0, free_joint=True)
    report = path.with_name("forearm.mjcf.xml.report.json")
    for change in json.loads(report.read_text())["approximated"] if report.exists() else []:
        off = 1000 * change["max_deviation"]
        print(f"{', '.join(change['parts'])}: a {change['to']}, off by {off:.1f} mm at most")

    scene = mujoco.MjSpec()
    scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    for i in range(3):  # three links, falling onto one another
        frame = scene.worldbody.add_frame(pos=[0.02 * i, 0.01 * i, 0.1 + 0.5 * i])
        scene.attach(mujoco.MjSpec.from_file(str(path)), prefix=f"{i}/", frame=frame)
    model = scene.compile()

data = mujoco.MjData(model)
contacts = 0
for _ in range(round(2.0 / model.opt.timestep)):
    mujoco.mj_step(model, data)
    contacts = max(contacts, data.ncon)
bodies = data.xipos[1:]
print(f"{model.nbody - 1} links of {model.body_mass[1]:.2f} kg, {model.ngeom - 1} geoms, {contacts} contacts")
print(f"after 2 s their centres are {', '.join(f'{z:.2f}' for z in bodies[:, 2])} m above the floor")
assert (bodies[:, 2] > 0.0).all()
