"""Parts that a scan of a piece does not show, but the family has; and none beside where nothing is hidden."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

import partwright as pw
from partwright.assembly.metadata import GUESSED
from partwright.methods import FitRequest
from partwright.partsdf import method
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.starts import Start
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import Frame
from partwright.partsdf.unseen import with_unseen
from partwright.render import Camera, preview
from partwright.shapes.sampling import sample_triangles

LEGS = ["leg_front_left", "leg_front_right", "leg_back_left", "leg_back_right"]
FRONT = LEGS[:2]


@pytest.fixture(scope="module")
def chairs() -> Model:
    return load_model("chairs")


def the_first(model: Model, parts: list[str]) -> NeuralShape:
    """The first training shape that has just these."""
    wanted = torch.tensor([part in parts for part in model.parts])
    return NeuralShape.trained(model, str(int((model.present == wanted).all(dim=1).nonzero()[0])))


def points_of(shape: NeuralShape) -> np.ndarray:
    whole = mesh_shape(shape, 64).whole
    return np.asarray(sample_triangles(whole.vertices, whole.faces, 3000, 0)[0])


def front_missing(points: np.ndarray) -> np.ndarray:
    """What lies above a plane through the seat: the front legs do not."""
    along = points @ [0.0, 1.0, 0.5]
    return points[along > np.quantile(along, 0.35)]


def lacking(shape: NeuralShape, parts: list[str]) -> NeuralShape:
    """As what was found without these: of them nothing is known."""
    gone = torch.tensor([part in parts for part in shape.model.parts])
    latents, place = shape.latents.clone(), shape.poses.translation.clone()
    latents[gone], place[gone] = 5.0, 5.0
    poses = shape.poses._replace(translation=place)
    return replace(shape, latents=latents, poses=poses, present=shape.present & ~gone)


def test_legs_that_were_not_scanned_are_where_the_others_tell(chairs: Model) -> None:
    """Of a chair whose front is missing below: closer than to where they are on average."""
    chair = the_first(chairs, ["seat", "back", *LEGS])
    target = Target.of_points(front_missing(points_of(chair)), 8000)
    found = with_unseen(lacking(chair, FRONT), target)
    assert found.present.equal(chair.present)  # and no arms, which half of the family have
    gone = torch.tensor([part in FRONT for part in chairs.parts])
    off, usual = (
        (poses.translation - chair.poses.translation)[gone].norm(dim=1).max()
        for poses in (found.poses, chairs.average_pose)
    )
    assert off < 0.4 * usual
    for mine, was in zip((found.latents, *found.poses), (chair.latents, *chair.poses), strict=True):
        assert mine[~gone].equal(was[~gone])


@pytest.mark.parametrize("gone", [["back"], FRONT[:1], LEGS])
def test_what_a_whole_scan_does_not_show_is_not_there(chairs: Model, gone: list[str]) -> None:
    """A stool, a chair that lost a leg, one on the floor: all around them there are points."""
    seen = lacking(the_first(chairs, ["seat", "back", *LEGS]), gone)
    points = points_of(seen)
    assert with_unseen(seen, Target.of_points(points, 8000)) is seen
    assert with_unseen(seen, Target(torch.zeros(4, 3), torch.zeros(4))) is seen


def test_what_half_a_scan_would_show_is_not_there(chairs: Model) -> None:
    """The left half of a couch on the floor has no leg, so neither has the right one."""
    couch = the_first(chairs, ["seat", "back", "arm_left", "arm_right"])
    points = points_of(couch)
    cut = points[points[:, 0] > -0.1]
    assert with_unseen(couch, Target.of_points(cut, 8000)).present.equal(couch.present)


def test_all_legs_beyond_where_a_scan_ends_are_put_back(chairs: Model) -> None:
    """They are nearest to what was scanned of the seat, but no point would be where they are."""
    chair = the_first(chairs, ["seat", "back", *LEGS, "arm_left", "arm_right"])
    points = points_of(chair)
    along = points @ [-0.5, 1.0, 1.0]
    target = Target.of_points(points[along > np.quantile(along, 0.7)], 8000)
    assert with_unseen(lacking(chair, LEGS), target).present.equal(chair.present)


def test_they_are_told_of(chairs: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    chair = the_first(chairs, ["seat", "back", *LEGS])
    cut = pw.load_shape(front_missing(points_of(chair)))
    corner = cut.frame.to_unit(np.zeros((1, 3)))[0]
    place = Frame(torch.from_numpy(corner).float(), torch.tensor(cut.frame.scale).log())
    start = replace(chair, poses=place.from_family(chair.poses))
    monkeypatch.setattr(method, "find_starts", lambda _, target, turns, *__: [Start(start, turns[0], target)])
    settings = pw.LearnedParts("chairs", iterations=0, resolution=32)
    fitted = FitRequest(cut, settings).fitted()
    learned = fitted.details["learned"]
    assert learned["unseen"] == FRONT
    assert learned["absent"] == ["arm_left", "arm_right"]
    assert [part.name for part in fitted.assembly.parts] == ["seat", "back", *LEGS]
    assert fitted.warnings[-1].endswith("usual in the family: leg_front_left, leg_front_right")
    assert [part.name for part in fitted.assembly.parts if GUESSED in part.metadata] == FRONT
    guesses = [line for line in fitted.assembly.describe().splitlines() if line.endswith(", a guess")]
    assert [line.split(":")[0].split()[-1] for line in guesses] == FRONT


def test_the_preview_shows_guesses_pale() -> None:
    """Two boxes side by side, one of which is a guess: its half of the parts' panel has no strong colour."""
    field = pw.fields.Box(size=(1, 1, 1))
    seen = pw.Part(field, translation=(-0.5, 0, 0), name="a")
    guess = pw.Part(field, translation=(0.5, 0, 0), name="b", metadata={GUESSED: "as is usual"})
    shape = pw.load_shape(trimesh.creation.box((2, 1, 1)))

    def strongest(assembly: pw.Assembly) -> list[float]:
        page = preview(shape, assembly, camera=Camera(0, 0, margin=0.1), panel=(200, 200))
        panel = page[-200:, 200:400].astype(float)
        strong = panel.max(axis=2) - panel.min(axis=2)
        return [strong[:, :100].max(), strong[:, 100:].max()]

    plain = strongest(pw.Assembly([seen, dataclasses.replace(guess, metadata={})]))
    pale = strongest(pw.Assembly([seen, guess]))
    assert pale[0] == plain[0]
    assert pale[1] < 0.4 * plain[1]
