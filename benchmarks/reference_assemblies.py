"""Deviation of the reference and the kernel from published assemblies of SuperFrusta.

    python benchmarks/reference_assemblies.py --reference superfrustum_reference.npz

The file holds, for each assembly NAME: NAME/translation (M, 3), axis_angle (M, 3), size (M, 3), roundness,
dilation, taper, bulge, onion, smooth_k (M,), points (N, 3) and the published distance (N,). Its axis-angle
vectors map world to local, so a part's rotation is the quaternion of minus the vector.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from partwright.fields import kernel, reference

TOLERANCE = 1e-5
SCALARS = ("roundness", "dilation", "taper", "bulge", "onion", "smooth_k")


def read_rows(data: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    """The kernel's parameter rows (M, 16), in float64, of one assembly."""
    rotation = Rotation.from_rotvec(-data[f"{name}/axis_angle"]).as_quat(scalar_first=True)
    columns = [data[f"{name}/translation"], rotation, data[f"{name}/size"]]
    return np.hstack(columns + [data[f"{name}/{key}"][:, None] for key in SCALARS])


def deviations(data: Mapping[str, np.ndarray], name: str) -> dict[str, float]:
    """Largest absolute deviation of each implementation over the points of one assembly."""
    rows, points, expected = read_rows(data, name), data[f"{name}/points"], data[f"{name}/distance"]
    computed = {
        f"reference {dtype}".replace("torch.", ""): reference.evaluate(
            torch.tensor(rows, dtype=dtype), torch.tensor(points, dtype=dtype)
        ).numpy()
        for dtype in (torch.float64, torch.float32)
    }
    computed["kernel"] = kernel.evaluate(rows.astype(np.float32), points.astype(np.float32))
    return {key: float(np.abs(value - expected).max()) for key, value in computed.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--reference", type=Path, required=True, help="the .npz file of assemblies")
    path = parser.parse_args().reference
    worst = 0.0
    with np.load(path) as data:
        for name in sorted({key.split("/")[0] for key in data.files}):
            found = deviations(data, name)
            worst = max(worst, *found.values())
            print(f"{name}: " + ", ".join(f"{key} {value:.2e}" for key, value in found.items()))
    print(f"largest deviation {worst:.2e}, allowed {TOLERANCE:.0e}")
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())
