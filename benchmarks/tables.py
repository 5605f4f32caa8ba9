"""All tables of the documentation: which script makes which, with which arguments, in how many minutes.

    make benchmarks                                 # quick: shapes of our own, into build/benchmarks
    make benchmarks FULL=1 DATA=FOLDER              # as committed, into benchmarks/results: days
    python benchmarks/tables.py [--full --data FOLDER] [--only A,B] [--list]

Quick says whether everything runs and roughly agrees; its numbers are of few small shapes, and go to a copy
of benchmarks/ in build/. Full needs the shapes that the committed tables name: a folder with an index.json (a
list of {"name", "set", "file"}). Minutes are of two idle cores, and estimated. A script that fails does not
stop the rest.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
QUICK = ROOT / "build" / "benchmarks"


@dataclass(frozen=True)
class Table:
    """A file of benchmarks/results. quick, full: arguments, or why there are none; minutes of both."""

    output: str
    script: str
    quick: str | None
    quick_minutes: float
    full: str | None
    full_minutes: float
    needs: str = ""
    """What must be there besides, for the full mode."""


TABLES = (
    Table("guard.json", "guard.py", "", 0.5, "--record", 0.5),
    Table("fit.md", "fit.py", "--quality draft", 2, "--shapes {data} --sets toys,cad --seeds 0,1,2", 45),
    Table("fit-draft.md", "fit.py", "--quality draft --tag draft", 2,
          "--shapes {data} --sets toys,cad --quality draft --tag draft", 8),
    Table("fit-high.md", "fit.py", None, 0,
          "--shapes {data} --sets toys,cad --every 5 --quality normal,high --tag high", 15),
    Table("fit-assets.md", "fit.py", None, 0,
          "--shapes kits --sets kenney,kaykit,generated,common --tag assets --untimed", 25,
          "kits/kenney/ with GLBs of KenneyNL's four starter kits, kits/kaykit/ with glTFs of "
          "KayKit-Game-Assets' Restaurant Bits, Space Base Bits and Character Pack Adventures, "
          "kits/generated/ with the meshes of AsimAslah/TripoSR-Image-to-3D and Bingeljell/image-to-3dlab, "
          "kits/common/ with OBJs of alecjacobson/common-3d-test-models"),
    Table("last_polish.md", "last_polish.py", "--names mug", 1,
          "--shapes {data} --sets toys,cad --seed 1", 12),
    Table("ablations.md", "ablations.py", "--names mug --rows default,cuboid", 2, "--shapes {data}", 240),
    Table("ablations-carving.md", "ablations.py", "--names mug --rows default,mended --tag carving", 1,
          '--shapes {data} --rows "default,subtracted,mended" --tag carving --jobs 2', 8),
    Table("solids.md", "solids.py", "--shapes examples/shapes --sets shapes --names bracket", 2,
          "--shapes {data} --sets cad", 90),
    Table("solids-unseen.md", "solids.py", None, 0,
          "--shapes unseen --sets voron,prusa,others,robot,reprap,arms,bots --variants solids --tag unseen "
          "--untimed", 30,
          "unseen/ with an index.json and the files of the public repositories that the table names"),
    Table("capri.md", "capri.py", "--names bracket --rows mesh,planes", 2,
          "--shapes {data} --sets cad --rows mesh,voxels,points,solids,superfrusta,planes,weights,auto,union,"
          "flat,aligned,seven,first,cheap,double,dear,paper,tenth,whole", 600),
    Table("partsdf-reconstruct-cars.md", "partsdf.py", None, 0,
          "reconstruct --family families/cars --model cars --shapes 8 --threads 1", 5,
          "families/, made by partwright parts prepare"),
    Table("partsdf-reconstruct-chairs.md", "partsdf.py", None, 0,
          "reconstruct --family families/chairs --model chairs --shapes 8 --threads 1", 5,
          "families/"),
    Table("partsdf-reconstruct-vehicles.md", "partsdf.py", None, 0,
          "reconstruct --family families/vehicles --model vehicles --shapes 5 --resolution 256 "
          "--threads 1", 8, "families/"),
    Table("partsdf-reconstruct-mixers.md", "partsdf.py", None, 0,
          "reconstruct --family families/mixers --model mixers --shapes 8 --threads 1", 8,
          "families/"),
    Table("partsdf-real.md", "partsdf.py", None, 0, "real --shapes-from {data} --threads 1", 8),
    Table("partsdf-familiarity.md", "partsdf.py", None, 0,
          "familiarity --shapes-from {data} --shapes 4 --others 3 --iterations 200 --threads 1", 12),
    Table("partsdf-encode-mixers.md", "partsdf.py", None, 0,
          "encode --family families/mixers --model mixers --shapes 5 --iterations 200 --threads 1", 2,
          "families/"),
    Table("partsdf-images-chairs.md", "partsdf.py", None, 0,
          "images --family families/chairs --model chairs --shapes 6 --views 2 --resolution 96 "
          "--threads 1", 5, "families/"),
    Table("partsdf-images-of-nothing.md", "partsdf.py", None, 0,
          "nothing --shapes-from {data} --threads 1", 3),
    Table("partsdf-unseen.md", "partsdf.py", None, 0, "unseen --threads 1", 2),
    Table("partsdf-scans-mixers.md", "partsdf.py", None, 0,
          "scans --family families/mixers --model mixers --shapes 3 --iterations 200 --threads 1", 3,
          "families/"),
    Table("partsdf-scans-mixers-surface.md", "partsdf.py", None, 0,
          "scans --family families/mixers --model mixers --shapes 3 --iterations 200 --threads 1 --surface",
          3, "families/"),
    Table("partsdf-generation-mixers.md", "partsdf.py", None, 0,
          "generate --family families/mixers --model mixers --fresh 110 --threads 1", 6, "families/"),
    Table("partsdf-generation-chairs.md", "partsdf.py", None, 0,
          "generate --family families/chairs --model chairs --fresh 140 --threads 1", 8, "families/"),
    Table("partsdf-generation-cars.md", "partsdf.py", None, 0,
          "generate --family families/cars --model cars --fresh 170 --threads 1", 5, "families/"),
    Table("partsdf-generation-vehicles.md", "partsdf.py", None, 0,
          "generate --family families/vehicles --model vehicles --fresh 170 --threads 1", 8, "families/"),
    Table("partsdf-layouts-or-forms.md", "partsdf.py", None, 0, "layouts --threads 1", 8),
    Table("partsdf-soundness.md", "partsdf.py", None, 0,
          "soundness --names chairs,mixers,vehicles,cars --count 48 --threads 1", 14),
    Table("partsdf-ablations-cars.md", "partsdf.py", None, 0,
          "ablations --family families/cars-small --epochs 84 --width 96 --shapes 4 --iterations 150 "
          "--points 1024 --resolution 128 --threads 1", 900, "families/"),
    Table("partsdf-ablations-cars-local.md", "partsdf.py", None, 0,
          "ablations --family families/cars --config configs/cars-first.toml --epochs 40 --shapes 3 "
          "--iterations 200 --resolution 96 --threads 1", 25, "families/"),
    Table("partsdf-robots.md", "partsdf.py", None, 0,
          "robots --parts {data}/parts/robot_arm --held ur5,ur10e --epochs 400 --iterations 200 "
          "--resolution 128 --threads 1", 120),
    Table("partsdf-speed.md", "partsdf.py", None, 0, "speed --model chairs", 60),
    Table("unlabelled.md", "unlabelled.py", "--made chairs:4", 1,
          "--parts {data}/parts/robot_arm {data}/parts/truck", 5),
    Table("named_convexes.md", "named_convexes.py", None, 0,
          "--shapes {data}/cad --trees build/trees --quality draft", 60),
    Table("cleaning.md", "cleaning.py", None, 0,
          "--shapes {data} --fits build/fits/solids build/fits/superfrusta", 60, "build/fits, fitted before"),
    Table("formats.md", "formats.py", None, 0,
          "build/fits/solids build/fits/superfrusta --rows build/formats.jsonl", 60, "build/fits"),
    Table("scenes.md", "formats.py", None, 0,
          "build/fits/capri build/fits/solids build/fits/superfrusta --formats .glb,.usdc,.mjcf.xml,.urdf "
          "--rows build/scenes.jsonl --target benchmarks/results/scenes.md", 20, "build/fits"),
    Table("conformance.md", "conformance.py", None, 0, "build/fits/solids build/fits/superfrusta "
          "--node build/node/node_modules", 10, "build/fits, npm's gltf-validator"),
    Table("collision.md", "collision.py", "--names mug --rows collision.jsonl --target collision.md", 2,
          "--shapes {data} --names parts/robot_arm/ur5e/forearm,cad/ttt_angle_bracket,toys/mug,toys/hammer,"
          "cad/bd_rod_end,parts/robot_arm/ur3/forearm,parts/robot_arm/ur5e/upper_arm,"
          "parts/robot_arm/ur3/upper_arm,parts/robot_arm/ur10/shoulder,parts/robot_arm/ur10/base,"
          "toys/armchair,toys/chair_kk --rows build/collision.jsonl", 30),
    Table("collision-cad.md", "collision.py", None, 0,
          "--shapes {data} --names cad/bdw_weld_neck_flange,cad/ttt_corner_tie,cad/prusa_y_rod_holder,"
          "cad/f360_clamp_block --unit mm --method solids --clean --rows build/collision-cad.jsonl "
          "--target benchmarks/results/collision-cad.md", 10),
    Table("ring_bound.md", "ring_bound.py", None, 0, "--shape {data}/toys/mug.ply", 1),
    Table("robots.md", "robots.py", "hinge=examples/shapes/hinge.urdf --rows robots.jsonl --ways nearest", 1,
          None, 0, "robots of packages on PyPI, which the script names"),
    Table("optimise.md", "optimise.py", None, 0,
          "--shapes {data} --output benchmarks/results/optimise.md", 30),
    Table("drag.md", "drag.py", None, 0,
          "--flows flows --family families/cars --one-part cars-one-part/model.safetensors --convergence "
          "--output benchmarks/results/drag.md", 60,
          "OpenFOAM, families/, flows/ by partwright parts simulate cars -o flows --count 57 --seed 20 "
          "--air y,ground,iterations=100, and a training of configs/cars-one-part.toml"),
    Table("adjoint.md", "adjoint.py", None, 0, "--rows build/adjoint.jsonl", 10, "OpenFOAM"),
    Table("anchors.md", "anchors.py", "--names bracket --peers coacd", 2, "", 20, "the peers"),
    Table("batch.md", "batch.py", "--shapes 8 --kills 4", 3,
          "--shapes 200 --kills 20 --output benchmarks/results/batch.md", 30),
    Table("batch-ray.md", "batch_ray.py", None, 0,
          "--shapes 12 --losses 3 --output benchmarks/results/batch-ray.md", 5, "the extra ray"),
    Table("throughput.md", "throughput.py", "--names mug,bracket", 2, "--shapes {data}", 20),
    Table("scaling.md", "scaling.py", None, 0, "--shapes {data} --name bunny", 15),
    Table("stability.md", "stability.py", "--names mug --turns 1 --seeds 2 --quality draft", 2,
          "--shapes {data} --names mug,bunny --turns 2 --seeds 3 --quality normal", 30),
    Table("inputs.md", "inputs.py", "--quality draft mug", 2,
          "--shapes {data} --seeds 0,1,2 bunny chair_kk f360_crank_web ttt_angle_bracket", 60),
    Table("semantics.md", "semantics.py", None, 0, "--shapes {data}", 60),
    Table("enrichment.md", "enrichment.py", None, 0, "--shapes {data} --rows build/enrichment.csv", 60),
    Table("textures.md", "textures.py", None, 0,
          "--shapes {data} --output benchmarks/results/textures.md", 30),
    Table("threads.md", "threads.py", "", 1, "--shapes {data}", 1),
    Table("wheels.md", "wheels.py", "--counts 12 --quality draft", 1, "", 4),
    Table("perforations.md", "perforations.py", "--names drilled --quality draft", 0.5, "", 3),
    Table("known_features.md", "known_features.py", "--count 4", 1, "--count 40", 8),
    Table("convexes_by_hand.md", "convexes_by_hand.py", "", 0.1, "", 0.1, "solids.csv and capri.csv"),
    Table("pretraining_cost.md", "pretraining_cost.py", "--steps 2", 1, "", 2),
    Table("rivals.md", "rivals.py", "--count 1", 1, "--count 8", 3),
    Table("round_trips.md", "round_trips.py", "", 3, "", 3, "the extra cad"),
    Table("fuzz.md", "fuzz.py", "--files 100 --commands 60", 2, "--files 500 --commands 500 --seed 0", 15),
    Table("kernel.md", "kernel.py", "--turns 3", 1, "", 3),
    Table("startup.md", "startup.py", "now={root} --runs 5", 0.5,
          "now={root} --output benchmarks/results/startup.md", 2),
)  # fmt: skip


def run(table: Table, full: bool, data: str) -> tuple[str, float]:
    """How it ended, and the minutes it took; says its last lines where it did not end well.

    A table may be made and say that not all of its checks pass: its script then exits with 1, too.
    """
    arguments = (table.full if full else table.quick) or ""
    place = ROOT if full else QUICK
    words = arguments.format(data=data, root=ROOT).split()
    target = place / "benchmarks" / "results" / table.output
    before = target.stat().st_mtime_ns if target.exists() else None
    started = time.monotonic()
    done = subprocess.run(
        [sys.executable, f"benchmarks/{table.script}", *words],
        cwd=place, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode:
        print("\n".join((done.stdout + done.stderr).splitlines()[-5:]), file=sys.stderr)
    anew = target.exists() and target.stat().st_mtime_ns != before
    how = "made" if not done.returncode else "made, checks fail" if anew else "failed"
    return how, (time.monotonic() - started) / 60


def listing() -> str:
    """The tables in Markdown."""
    lines = ["| table | script | quick, minutes | full, minutes |", "|---|---|---|---|"]
    for table in TABLES:
        quick = "-" if table.quick is None else f"`{table.quick}` {table.quick_minutes:g}"
        needs = f" (needs {table.needs})" if table.needs else ""
        full = "-" if table.full is None else f"`{table.full}` {table.full_minutes:g}"
        lines.append(f"| {table.output} | {table.script} | {quick} | {full}{needs} |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = parser.add_argument
    option("--full", action="store_true", help="as committed, into benchmarks/results")
    option("--data", default="", metavar="FOLDER", help="the shapes of the full mode")
    option("--only", default="", metavar="A,B", help="only these tables, by their script's name")
    option("--list", action="store_true", help="say what there is, and run nothing")
    given = parser.parse_args()
    if given.list:
        print(listing())
        return 0
    if given.full and not Path(given.data, "index.json").is_file():
        parser.error("--full: --data FOLDER has to hold an index.json")
    if not given.full:
        shutil.rmtree(QUICK, ignore_errors=True)
        shutil.copytree(ROOT / "benchmarks", QUICK / "benchmarks", ignore=shutil.ignore_patterns("*.csv"))
        shutil.copytree(ROOT / "examples", QUICK / "examples")
    only = set(filter(None, given.only.split(",")))
    failed = 0
    for table in TABLES:
        if only and table.script.removesuffix(".py") not in only:
            continue
        if (table.full if given.full else table.quick) is None:
            print(f"{table.output}: only in the full mode")
            continue
        how, minutes = run(table, given.full, given.data)
        failed += how == "failed"
        print(f"{table.output}: {how} in {minutes:.1f} minutes", flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
