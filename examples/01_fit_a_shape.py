"""Fit a shape, look at the parts, and write the result's five files."""

import tempfile
from pathlib import Path

import partwright as pw

shape = pw.load_shape(Path(__file__).parent / "shapes" / "watering_can.ply", unit="cm", up="z")
result = pw.fit(shape, quality="draft", seed=0)

for part in result.assembly.parts:
    print(f"{part.name:12} size {[round(s, 2) for s in part.field.size]}  taper {part.field.taper:.2f}")
print(f"{result.outcome}: {len(result.assembly)} parts, IoU {result.scores.iou:.3f}")

with tempfile.TemporaryDirectory() as folder:
    result.save(Path(folder) / "can")
    print(sorted(path.name for path in (Path(folder) / "can").iterdir()))
