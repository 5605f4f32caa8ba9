"""The models that ship: small, of the made families, and close to the shapes that they were trained on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import partwright as pw
from partwright.cli.main import main
from partwright.datasets.families.recipes import FAMILIES, make_shape
from partwright.partsdf.encoder import load_encoder
from partwright.partsdf.generator import load_generator
from partwright.partsdf.image_encoder import load_image_encoder
from partwright.partsdf.model import SHIPPED, Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.photos import Photo, look_at
from partwright.render import Camera, render_mesh

# Mean IoU; walls of mixers are so thin that little of a cell more or less counts.
LEAST = {"mixers": 0.75, "chairs": 0.93, "cars": 0.96, "vehicles": 0.93}


@pytest.fixture(params=sorted(FAMILIES))
def shipped(request: pytest.FixtureRequest) -> Model:
    return load_model(request.param)


def test_they_are_small_and_know_their_family(shipped: Model) -> None:
    assert (SHIPPED / f"{shipped.name}.safetensors").stat().st_size < 4e6
    assert shipped.parts == FAMILIES[shipped.name].parts
    assert len(shipped.shapes) >= 100


def test_companions_are_small_and_belong_to_their_models() -> None:
    files = [path for path in SHIPPED.glob("*.safetensors") if "." in path.stem]
    assert files
    for path in files:
        assert path.stat().st_size < 5e6
        name, kind = path.stem.split(".")
        load = {
            "encoder": load_encoder,
            "image-encoder": load_image_encoder,
            "generator": load_generator,
        }[kind]
        assert load(load_model(name)) is not None


def test_new_mixers_hold_together() -> None:
    """Both attach points stand on the tube, and the helix is in it."""
    made = load_generator(load_model("mixers")).generate(12, 3)
    for one in made:
        assert one.names() == list(one.model.parts)
        tube, helix, left, right = (one.poses.map(lambda t, p=p: t[p]) for p in range(4))
        across, inner = (one.scale.sort().values[:2].max() for one in (helix, tube))
        assert across < 1.1 * inner
        for point in (left, right):
            assert (point.translation - tube.translation).norm() < 1.0
    sizes = torch.stack([one.poses.scale[0].amin() for one in made])
    assert sizes.std() > 0.01  # not one mixer twelve times


def test_training_shapes_are_those_that_were_made(shipped: Model) -> None:
    """Of points inside the made shape or the neural one, how many are inside both."""
    ious = []
    for name in shipped.shapes[:3]:
        made = make_shape(shipped.name, FAMILIES[shipped.name], 0, int(name.rpartition("_")[2]))
        assert made.name == name
        samples = pw.load_shape(made.whole).samples(0, 20_000, 0)
        inside = samples.distance < 0
        found = NeuralShape.trained(shipped, name).distances(samples.points) < 0
        ious.append(np.count_nonzero(inside & found) / np.count_nonzero(inside | found))
    assert np.mean(ious) > LEAST[shipped.name]


@pytest.mark.parametrize(
    ("name", "closer", "alike"),
    [("chairs", 1.5, 360), ("cars", 1.15, 360), ("vehicles", 1.15, 360), ("mixers", 1.3, 180)],
)
def test_a_shape_is_seen_in_one_picture(name: str, closer: float, alike: float) -> None:
    """Shapes that no training saw, each from another side: closer than the mean shape, and where from, but
    for turns (degrees) after which shapes of the family look alike."""
    encoder = load_image_encoder(load_model(name))
    assert encoder is not None
    mean = NeuralShape.mean(encoder.model)
    off, seen, usual = [], [], []
    for number, azimuth in ((500, 40.0), (501, 140.0), (502, 300.0), (503, 220.0)):
        made = make_shape(name, FAMILIES[name], 0, number)
        image = render_mesh(made.whole, Camera(azimuth, 20.0), (192, 192), (150, 90, 50))
        sight = look_at(encoder, Photo(image.astype(np.float32) / 255, None)).sight
        off.append(abs((sight.azimuth - azimuth + alike / 2) % alike - alike / 2))
        samples = pw.load_shape(made.whole).samples(0, 5_000, 0)
        inside = samples.distance < 0
        for shape, ious in ((sight.shape, seen), (mean, usual)):
            found = shape.distances(samples.points) < 0
            ious.append(np.count_nonzero(inside & found) / np.count_nonzero(inside | found))
    assert np.median(off) < 30
    assert np.mean(seen) > closer * np.mean(usual)


def test_they_are_edited_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PARTWRIGHT_MODELS", raising=False)
    assert main(["parts", "edit", "mixers:0", "-o", "wide.json", "--scale", "tube=1.2,1.2,1"]) == 0
    plain, wide = NeuralShape.trained(load_model("mixers"), "0"), pw.load_assembly("wide.json")
    half = [part.field.half_lengths for part in wide.parts if part.name == "tube"]
    np.testing.assert_allclose(half[0], plain.poses.scale[0].numpy() * [1.2, 1.2, 1.0], rtol=1e-6)
