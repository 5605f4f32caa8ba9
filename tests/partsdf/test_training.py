"""Training: what it learns, that it repeats and goes on to the bit, and what it refuses."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from partwright.datasets.prepared import PreparedFamily, write_family
from partwright.errors import FamilyError, ModelError, SettingError
from partwright.partsdf import model as models
from partwright.partsdf.autodecoder import AutoDecoder
from partwright.partsdf.config import config_from
from partwright.partsdf.data import load_samples
from partwright.partsdf.logs import read_log
from partwright.partsdf.model import Model, find_model, load_model, model_from_bytes
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.training import CHECKPOINT, MODEL, EpochReport, _fabric, train
from tests.partsdf.lamps import PARTS, lamp, small_config


def test_it_learns_the_shapes_and_their_parts(model: Model, lamps: PreparedFamily) -> None:
    errors, right = [], []
    for i, name in enumerate(model.shapes):
        shape, known = NeuralShape.trained(model, name), lamps.load(i)
        near = np.abs(known.sdf) < 0.1
        each = shape.part_distances(known.points)
        errors.append(np.abs(shape.whole(each) - known.sdf)[near].mean())
        numbers = np.flatnonzero(known.present)
        assert shape.names() == [PARTS[n] for n in numbers]
        inside = known.sdf < -0.02
        right.append((numbers[each.argmin(axis=0)] == known.part)[inside].mean())
    assert np.mean(errors) < 0.02
    assert np.mean(right) > 0.9


def test_a_training_begins_with_a_model(model: Model, lamps: PreparedFamily, tmp_path: Path) -> None:
    """One step from it is as good as it was; by name, so that new shapes begin with nothing."""
    file = tmp_path / "before.safetensors"
    model.save(file)
    config = small_config(lamps, epochs=1, batch=26)
    begun = replace(config, training=replace(config.training, start=str(file), rate=1e-9, latent_rate=1e-9))
    again = train(begun, tmp_path / "again").model
    for name in again.shapes:
        one, two = NeuralShape.trained(model, name), NeuralShape.trained(again, name)
        torch.testing.assert_close(one.latents, two.latents, atol=1e-6, rtol=0)
        points = np.random.default_rng(0).uniform(-1, 1, (200, 3))
        np.testing.assert_allclose(one.distances(points), two.distances(points), atol=1e-5)
    wide = replace(begun, decoder=replace(begun.decoder, width=2 * begun.decoder.width))
    with pytest.raises(SettingError, match="lamps has other settings of its decoder"):
        train(wide, tmp_path / "wide")
    with pytest.raises(SettingError, match="lamps has other parts"):
        train(replace(begun, one_part=True), tmp_path / "one")
    strangers = AutoDecoder(2, len(model.parts), model.config.decoder)
    with pytest.raises(SettingError, match="knows none of the 2 shapes"):
        strangers.begin_with(model, model.parts, ("stool", "desk"))
    strangers.begin_with(model, model.parts, ("stool", model.shapes[3]))
    assert strangers.latents[1].equal(model.latents[3])
    assert not strangers.latents[0].equal(model.latents[0])
    with pytest.raises(ModelError):
        train(replace(begun, training=replace(begun.training, start="nobody")), tmp_path / "nobody")


def test_the_last_epochs_have_less_of_l_inter(lamps: PreparedFamily, tmp_path: Path) -> None:
    """Eased all along is a tenth of its weight; eased for the last half is neither that nor all of it."""
    plain = small_config(lamps, epochs=2, batch=26)
    plain = replace(plain, losses=replace(plain.losses, inter=5.0))

    def latents(name: str, ease: float, inter: float) -> torch.Tensor:
        config = replace(
            plain,
            losses=replace(plain.losses, inter=inter),
            training=replace(plain.training, ease=ease),
        )
        return train(config, tmp_path / name).model.latents

    none, half, all_along = latents("none", 0.0, 5.0), latents("half", 0.5, 5.0), latents("all", 1.0, 5.0)
    assert all_along.equal(latents("tenth", 0.0, 0.5))
    assert not half.equal(none)
    assert not half.equal(all_along)


def test_a_stopped_training_goes_on_to_the_same_bytes(lamps: PreparedFamily, tmp_path: Path) -> None:
    """Stopped by Ctrl-C in the middle of an epoch, twice; the log is the same, too, but for the seconds."""
    config = small_config(lamps, epochs=4, batch=12)
    train(config, tmp_path / "whole")

    def stop(report: EpochReport) -> None:
        if report.epoch < 3:
            signal.raise_signal(signal.SIGINT)

    outcomes = [train(config, tmp_path / "stopped", progress=stop).outcome for _ in range(3)]
    assert outcomes == ["interrupted", "interrupted", "converged"]
    for file in (MODEL,):
        assert (tmp_path / "whole" / file).read_bytes() == (tmp_path / "stopped" / file).read_bytes()
    logs = [read_log(tmp_path / folder / "log.csv") for folder in ("whole", "stopped")]
    for log in logs:
        for row in log:
            row.pop("seconds")
    assert logs[0] == logs[1]
    assert [row["epoch"] for row in logs[0]] == ["1", "2", "3", "4"]


def test_a_stop_within_an_epoch_is_no_loss(lamps: PreparedFamily, tmp_path: Path) -> None:
    """The last checkpoint may be of any step: an epoch has two here, and each is one."""
    config = small_config(lamps, epochs=2, batch=12, checkpoint=0.0)
    train(config, tmp_path / "whole")
    part = tmp_path / "part"
    copies: list[bytes] = []
    from partwright.partsdf import training

    def keep(path: Path, *arguments: object) -> None:
        original(path, *arguments)  # type: ignore[arg-type]
        copies.append(path.read_bytes())

    original = training.save_checkpoint
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "save_checkpoint", keep)
        train(config, tmp_path / "copied")
    part.mkdir()
    (part / CHECKPOINT).write_bytes(copies[0])  # after the first of two steps of the first epoch
    train(config, part)
    assert (part / MODEL).read_bytes() == (tmp_path / "whole" / MODEL).read_bytes()
    assert len(read_log(part / "log.csv")) == 2


def test_validation_scores_and_pictures(lamps: PreparedFamily, tmp_path: Path) -> None:
    train(small_config(lamps, epochs=2, validate=2, validate_shapes=1), tmp_path)
    rows = read_log(tmp_path / "log.csv")
    assert rows[0]["val_iou"] == ""
    assert 0 <= float(rows[1]["val_part_iou"]) <= float(rows[1]["val_iou"]) + 1 <= 2
    assert (tmp_path / "validation_00002.png").stat().st_size > 500


def test_draws_are_half_inside_and_labels_go_along(lamps: PreparedFamily) -> None:
    samples = load_samples(lamps, [0, 1, 2], small_config(lamps))
    generator = torch.Generator().manual_seed(3)
    points, sdf, part = samples.draw(torch.tensor([2, 0]), 1000, generator)
    assert ((sdf < 0).sum(dim=1) == 500).all()
    shape = lamps.load(2)
    for point, distance, label in zip(points[0, :20], sdf[0, :20], part[0, :20], strict=True):
        row = np.flatnonzero((shape.points == point.numpy()).all(axis=1))[0]
        assert (shape.sdf[row], shape.part[row]) == (distance, label)


@pytest.mark.parametrize(
    "options",
    [
        {"one_part": True},
        {"poses": False},
        {"decoder": {"modulation": False}},
        {"decoder": {"cross_part": False}},
        {"decoder": {"aggregation": "softmin"}},
        {"decoder": {"architecture": "transformer", "heads": 2}},
        {"decoder": {"architecture": "local", "token": 16}},
        {"losses": {"inter": 0.0}},
        {"training": {"precision": "bf16-mixed"}},
    ],
)
def test_every_ablation_trains_and_comes_back(
    lamps: PreparedFamily, tmp_path: Path, options: dict[str, object]
) -> None:
    from dataclasses import asdict

    data = asdict(small_config(lamps, epochs=1))
    for key, value in options.items():
        data[key] = data[key] | value if isinstance(value, dict) else value
    trained = train(config_from(data), tmp_path).model
    assert load_model(tmp_path / MODEL).hash == trained.hash
    assert len(trained.parts) == (1 if options.get("one_part") else 3)
    shape = NeuralShape.trained(trained, "lamp1")
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3)).astype(np.float32)
    assert np.isfinite(shape.distances(points)).all()


def test_a_checkpoint_of_another_family_or_setting_is_refused(lamps: PreparedFamily, tmp_path: Path) -> None:
    config = small_config(lamps, epochs=1)
    train(config, tmp_path / "out")
    other = write_family(
        tmp_path / "other", "other", PARTS,
        [(lamp("a", 1), "train"), (lamp("b", 2), "train")], lamps.average_pose,
    )  # fmt: skip
    with pytest.raises(
        ModelError, match=r"checkpoint of another family: it was trained on 24 shapes from 'lam"
    ):
        train(replace(config, family=str(other.folder)), tmp_path / "out")
    with pytest.raises(SettingError, match=r"other settings \(decoder.width\)"):
        train(replace(config, decoder=replace(config.decoder, width=16)), tmp_path / "out")
    (tmp_path / "out" / CHECKPOINT).write_bytes(b"cut short")
    with pytest.raises(ModelError, match="cannot be read as a checkpoint"):
        train(config, tmp_path / "out")


def test_families_that_teach_nothing_are_refused_by_name(lamps: PreparedFamily, tmp_path: Path) -> None:
    def trained(name: str, shapes: list[tuple[object, str]]) -> None:
        family = write_family(tmp_path / name, name, PARTS, shapes, lamps.average_pose)  # type: ignore[arg-type]
        train(small_config(family), tmp_path / f"{name}-out")

    with pytest.raises(FamilyError, match="1 shape to train on"):
        trained("single", [(lamp("a", 1), "train"), (lamp("b", 2), "test")])
    with pytest.raises(FamilyError, match=r"none of the 2 training shapes has the part 'knob'"):
        trained("bare", [(lamp("a", 1, knob=False), "train"), (lamp("b", 2, knob=False), "train")])
    hollow = replace(lamp("hollow", 3), sdf=np.abs(lamp("hollow", 3).sdf))
    with pytest.raises(FamilyError, match="hollow: no sample lies inside"):
        trained("hollow", [(lamp("a", 1), "train"), (hollow, "train")])


@pytest.mark.parametrize(
    ("claim", "value"), [("layers", 1 << 20), ("width", 1 << 30), ("latent", 1 << 30), ("octaves", 1 << 26)]
)
def test_a_model_that_claims_to_be_huge_is_refused_before_there_is_room_for_it(
    model: Model, claim: str, value: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = model.to_bytes()
    size = int.from_bytes(data[:8], "little")
    header = json.loads(data[8 : 8 + size])
    about = json.loads(header["__metadata__"]["partwright"])
    about["config"]["decoder"][claim] = value
    header["__metadata__"]["partwright"] = json.dumps(about)
    text = json.dumps(header).encode()
    made = []
    make = models.make_decoder
    monkeypatch.setattr(models, "make_decoder", lambda *given: made.append(make(*given)) or made[-1])
    with pytest.raises(ModelError, match=r"the model's settings say|layers are said"):
        model_from_bytes(len(text).to_bytes(8, "little") + text + data[8 + size :], "x")
    assert all(tensor.is_meta for decoder in made for tensor in decoder.state_dict().values())


def test_models_are_found_by_name_and_hash(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    half = model.save(tmp_path / "lamps.safetensors", half=True)
    assert half.hash != model.hash
    assert (tmp_path / "lamps.safetensors").stat().st_size < 0.7 * len(model.to_bytes())
    monkeypatch.setattr("partwright.partsdf.model._loaded", {})
    with pytest.raises(ModelError, match=f"the model 'lamps' with hash {half.hash[:12]}"):
        find_model("lamps", half.hash)
    monkeypatch.setenv("PARTWRIGHT_MODELS", str(tmp_path))
    assert find_model("lamps", half.hash).latents.equal(half.latents)
    assert load_model("lamps").hash == half.hash
    with pytest.raises(ModelError, match="no model is named 'lumps'"):
        load_model("lumps")
    data = model.to_bytes()
    for broken in (b"", data[: len(data) // 2], b"\x08" + bytes(20)):
        with pytest.raises(ModelError, match=r"x: damaged, or no PartSDF model"):
            model_from_bytes(broken, "x")


def test_half_precision_leaves_places_as_they_are(lamps: PreparedFamily) -> None:
    """Points and poses enter the network to the bit; only its hidden products are in half precision."""
    config = small_config(lamps, precision="bf16-mixed")
    samples = load_samples(lamps, [0, 1], config)
    seen: list[torch.Tensor] = []
    fabric = _fabric(config)
    plain = AutoDecoder(2, 3, config.decoder)
    plain.register_forward_pre_hook(lambda _, inputs: seen.append(inputs[1]))
    fabric.setup(plain)(torch.tensor([0, 1]), samples.points[:, :9], samples.poses)
    assert torch.equal(seen[0], samples.points[:, :9])
