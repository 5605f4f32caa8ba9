"""PartSDF measured: speed against a plain implementation, reconstruction of held-out shapes, ablations.

    python benchmarks/partsdf.py speed [--model MODEL]
    python benchmarks/partsdf.py reconstruct --family FOLDER --model MODEL [--config CONFIG] [--shapes N]
    python benchmarks/partsdf.py encode --family FOLDER --model MODEL [--shapes N]
    python benchmarks/partsdf.py images --family FOLDER --model MODEL [--shapes N] [--views N]
    python benchmarks/partsdf.py likeness [--names A,B]
    python benchmarks/partsdf.py nothing --shapes-from FOLDER [--names A,B]
    python benchmarks/partsdf.py scans --family FOLDER --model MODEL [--shapes N] [--surface]
    python benchmarks/partsdf.py unseen [--models A:N,B:N]
    python benchmarks/partsdf.py familiarity --shapes-from FOLDER [--names A,B] [--shapes N] [--others N]
    python benchmarks/partsdf.py shortlist --families FOLDER [--names A,B] [--shapes N]
    python benchmarks/partsdf.py real --shapes-from FOLDER
    python benchmarks/partsdf.py generate --family FOLDER --model MODEL [--held N] [--fresh N]
    python benchmarks/partsdf.py layouts [--names A,B] [--count N]
    python benchmarks/partsdf.py soundness [--names A,B] [--count N]
    python benchmarks/partsdf.py ablations --family FOLDER [--epochs N] [--width N] [--shapes N]
    python benchmarks/partsdf.py decoders --family FOLDER [--seconds S]
    python benchmarks/partsdf.py training --models FOLDER
    python benchmarks/partsdf.py robots --parts FOLDER --held A,B [--epochs N]

`reconstruct` with CONFIG also trains the same on all parts as one ("1P"), in --work, for a row of its own.
`encode` has held-out shapes from points by the model's encoder, `images` from one render each by its image
encoder, `scans` from few points, noise and missing halves, `generate` new ones against held-out ones.
`nothing` says of which pictures it is told that they show no shape of the family; `likeness` makes the image
encoders that ship learn anew what tells them. `unseen` says which parts come back that half a scan does
not show. All three take minutes, and need no family.
`layouts` says what these are told by, `soundness` how many of them come apart, and what it costs to make
them anew.
`real` finds real chairs and vehicles by models of made ones. `familiarity` shows every model that ships
new shapes of its own family and of the others, and real ones: who is warned of. `shortlist` says
what it costs to judge
most exchanged parts at few samples. `decoders` trains the paper's and the local one for the same
seconds. `ablations` trains every variant in --work, one after another. `training` tables
trainings in FOLDER/NAME, and keeps their logs. Trainings go on where they were stopped, and every shape's
scores are kept in benchmarks/results/partsdf-*.csv and not measured again, so that each command can be
stopped and go on.
Tables go to benchmarks/results/partsdf-*.md. One file a table: partsdf_*.py.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import torch
from partsdf_ablations import ablations
from partsdf_decoders import decoders
from partsdf_encoder import encoding
from partsdf_familiarity import strangers
from partsdf_generation import generation
from partsdf_images import imaging
from partsdf_layouts import layouts_or_forms
from partsdf_likeness import learn, pictures_of_nothing
from partsdf_real import reality
from partsdf_reconstruct import reconstruction, robots
from partsdf_scans import halving, scanning
from partsdf_shortlist import shortlisting
from partsdf_soundness import sounding
from partsdf_speed import speed
from partsdf_trainings import trainings

from partwright.partsdf.settings import ReconstructionSettings


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)

    def command(name: str, run: Callable[[argparse.Namespace], None]) -> argparse.ArgumentParser:
        one = commands.add_parser(name)
        one.set_defaults(run=run)
        one.add_argument("--threads", type=int, default=0, help="of PyTorch; 0 leaves its default")
        return one

    def measuring(name: str, run: Callable[[argparse.Namespace], None]) -> argparse.ArgumentParser:
        one = command(name, run)
        one.add_argument("--shapes", type=int, default=10_000, help="at most so many test shapes")
        default = ReconstructionSettings().iterations
        one.add_argument("--iterations", type=int, default=default, help="of a reconstruction")
        one.add_argument("--points", type=int, default=2048, help="of an iteration")
        one.add_argument("--resolution", type=int, default=256, help="of the mesh that is measured")
        one.add_argument("--epochs", type=int, default=60, help="of a training")
        one.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "partsdf-benchmark")
        return one

    command("speed", speed).add_argument("--model")
    one = command("training", trainings)
    one.add_argument("--models", type=Path, required=True, help="folder of trainings")
    one = measuring("reconstruct", reconstruction)
    one.add_argument("--family", required=True)
    one.add_argument("--model", required=True)
    one.add_argument("--config", help="of the model's training: also train and measure all parts as one")
    one = measuring("decoders", decoders)
    one.add_argument("--family", required=True)
    one.add_argument("--seconds", type=float, default=180, help="of the processor, for each training")
    one = measuring("ablations", ablations)
    one.add_argument("--family", required=True)
    one.add_argument("--width", type=int, default=128, help="of the decoders")
    one.add_argument("--config", help="of a training with the local decoder: what its pieces are worth")
    one.add_argument("--only", help="variants, separated by commas")
    one = measuring("encode", encoding)
    one.add_argument("--family", required=True)
    one.add_argument("--model", required=True)
    one = measuring("images", imaging)
    one.add_argument("--family", required=True, help="beside those whose pictures are of something else")
    one.add_argument("--model", required=True)
    one.add_argument("--views", type=int, default=3, help="pictures of each shape")
    command("likeness", learn).add_argument("--names", default="cars,chairs,mixers,vehicles")
    one = command("nothing", pictures_of_nothing)
    one.add_argument("--names", default="cars,chairs,mixers,vehicles")
    one.add_argument("--shapes-from", type=Path, required=True, help="folder of toys/ and parts/")
    one = command("unseen", halving)
    one.add_argument("--models", default="chairs:40,vehicles:12", help="and how many shapes of each")
    one = measuring("scans", scanning)
    one.add_argument("--family", required=True)
    one.add_argument("--model", required=True)
    one.add_argument("--surface", action="store_true", help="come close to the surface laid through points")
    one = command("real", reality)
    one.add_argument("--shapes-from", type=Path, required=True, help="folder of toys/ and parts/")
    one = measuring("familiarity", strangers)
    one.add_argument("--shapes-from", type=Path, required=True, help="folder of toys/ and parts/")
    one.add_argument("--names", default="cars,chairs,mixers,vehicles")
    one.add_argument("--others", type=int, default=2, help="shapes of each other family")
    one = command("layouts", layouts_or_forms)
    one.add_argument("--names", default="vehicles,chairs")
    one.add_argument("--count", type=int, default=60, help="shapes of each kind")
    one.add_argument("--seed", type=int, default=0)
    one = command("generate", generation)
    one.add_argument("--family", required=True)
    one.add_argument("--model", required=True)
    one.add_argument("--held", type=int, default=10_000, help="at most so many test shapes")
    one.add_argument("--resolution", type=int, default=96, help="of the meshes")
    one.add_argument("--fresh", type=int, default=0, help="more held-out shapes, of another seed")
    one.add_argument("--seed", type=int, default=0)
    one = command("soundness", sounding)
    one.add_argument("--names", default="cars,chairs,mixers,vehicles")
    one.add_argument("--count", type=int, default=48, help="shapes of each kind")
    one.add_argument("--seed", type=int, default=0)
    one = command("shortlist", shortlisting)
    one.add_argument("--families", type=Path, required=True, help="folder of prepared families")
    one.add_argument("--names", default="cars,chairs,mixers,vehicles")
    one.add_argument("--shapes", type=int, default=5, help="test shapes of each")
    one = measuring("robots", robots)
    one.add_argument("--parts", required=True, help="folder of arms, a folder of link meshes each")
    one.add_argument("--held", required=True, help="arms that are held out in turn, separated by commas")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    arguments.run(arguments)


if __name__ == "__main__":
    main()
