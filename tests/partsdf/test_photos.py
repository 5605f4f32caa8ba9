"""Pictures and companions that are odd or damaged, without a trained network."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from partwright.cli.main import main, parser
from partwright.errors import EmptyShapeError, ModelError, SettingError, UnreadableFileError
from partwright.partsdf.companions import load_companion, save_companion
from partwright.partsdf.encoder import EncoderSettings
from partwright.partsdf.generator import GeneratorSettings
from partwright.partsdf.image_encoder import ImageSettings
from partwright.partsdf.photos import _cut_out, look_at, read_photo
from partwright.partsdf.settings import Settings
from partwright.partsdf.standpoint import _HIGHEST, boxed, find_standpoint, outline
from partwright.partsdf.strangers import COVERED, MIRRORED, warnings_of
from partwright.partsdf.views import SIDE
from partwright.render import Camera
from partwright.render.raycast import Scene


class Seeing:
    """In place of an encoder: sees the shape in the first rows of whatever it is shown."""

    def see(self, pictures: torch.Tensor) -> list[Any]:
        silhouette = torch.zeros(SIDE // 2, SIDE // 2)
        silhouette[:2, 4:28] = 1
        return [SimpleNamespace(silhouette=silhouette) for _ in pictures]


GREEN, GREY = (10, 200, 10), (90, 90, 90)


def two_colours(path: Path, width: int, height: int) -> Path:
    """A picture, green on the left and grey on the right: one of a single colour is refused."""
    picture = Image.new("RGB", (width, height), GREEN)
    picture.paste(GREY, (width // 2, 0, width, height))
    picture.save(path)
    return path


def test_pictures_of_one_colour_are_refused(tmp_path: Path) -> None:
    Image.new("RGB", (64, 64), GREY).save(tmp_path / "grey.png")
    with pytest.raises(EmptyShapeError, match="one colour all over"):
        look_at(Seeing(), read_photo(tmp_path / "grey.png"))  # type: ignore[arg-type]


def test_thin_shapes_have_a_silhouette(tmp_path: Path) -> None:
    rgba = np.zeros((512, 512, 4), np.uint8)
    rgba[256:258] = 255
    Image.fromarray(rgba).save(tmp_path / "thin.png")
    looked = look_at(Seeing(), read_photo(tmp_path / "thin.png"))  # type: ignore[arg-type]
    assert looked.silhouette.any(axis=0).sum() == pytest.approx(0.9 * SIDE / 2, abs=2)
    assert looked.silhouette.any(axis=1).sum() <= 2
    assert boxed(looked.silhouette).any()


def test_what_is_looked_at_may_be_outside_the_picture(tmp_path: Path) -> None:
    looked = look_at(Seeing(), read_photo(two_colours(tmp_path / "long.png", 2048, 22)))  # type: ignore[arg-type]
    np.testing.assert_allclose(
        looked.closely, np.broadcast_to(looked.closely[:1], (SIDE, SIDE, 3)), atol=1e-6
    )
    np.testing.assert_allclose(looked.closely[0, 0], np.array(GREEN) / 255, rtol=1e-6)
    np.testing.assert_allclose(looked.closely[0, -1], np.array(GREY) / 255, rtol=1e-6)
    rows = np.repeat(np.linspace(0, 1, 100, dtype=np.float32)[:, None, None], 100, axis=1).repeat(3, axis=2)
    assert (_cut_out(rows, np.array([-20.0, 0, -5, 15])) == 0).all()  # its first row goes on
    assert (_cut_out(rows, np.array([110.0, 0, 125, 15])) == 1).all()
    half = _cut_out(np.ones((40, 40, 3), np.float32), np.array([-20.0, 0, 20, 40]), outside=0.0)
    assert half[: SIDE // 2].max() == 0
    assert half[SIDE // 2 :].min() == 1


def test_what_is_not_seen_in_the_mirror_image_is_told(tmp_path: Path) -> None:
    """An encoder that always sees something on the left sees no thing that is there."""

    class Left(Seeing):
        def see(self, pictures: torch.Tensor) -> list[Any]:
            (sight,) = super().see(pictures)
            sight.silhouette[:, 12:] = 0
            return [sight]

    photo = read_photo(two_colours(tmp_path / "photo.png", 64, 64))
    assert look_at(Seeing(), photo).mirrored == 1  # type: ignore[arg-type]
    assert look_at(Left(), photo).mirrored == 0  # type: ignore[arg-type]
    assert told(mirrored=0.0) == "something else is seen in its mirror image"


USUAL = 0.3


def told(likeness: float = USUAL, mirrored: float = MIRRORED, covered: float = COVERED) -> str:
    """What is said of a picture whose signs are these, if anything: by default all are at their limits."""
    encoder: Any = SimpleNamespace(usual=USUAL, model=SimpleNamespace(name="lamps"))
    seen: Any = SimpleNamespace(sight=SimpleNamespace(likeness=likeness), mirrored=mirrored)
    lines = warnings_of(encoder, seen, covered)
    if not lines:
        return ""
    (line,) = lines
    start = "this may be no picture of a shape of the family that lamps knows: "
    assert line.startswith(start)
    return line[len(start) :].split("; ")[0]


def test_what_looks_unlike_the_family_s_pictures_is_told() -> None:
    assert told() == ""
    assert told(covered=0.4) == ("however parts are moved, their outline agrees with the silhouette to 40 %")
    assert told(likeness=0.2) == "it looks unlike nearly all pictures of these"
    assert told(likeness=-1.0, mirrored=0.5) == (
        "it looks unlike nearly all pictures of these, and something else is seen in its mirror image"
    )


def test_damaged_pictures(tmp_path: Path) -> None:
    Image.new("RGB", (40, 20), "red").save(tmp_path / "exif.png", exif=b"Exif\0\0garbage!!")
    assert read_photo(tmp_path / "exif.png").pixels.shape == (20, 40, 3)  # as it stands
    levels = np.ones((20, 20), np.float32)
    for bad in (np.nan, np.inf):
        levels[3, 3] = bad
        Image.fromarray(levels).save(tmp_path / "levels.tif")
        with pytest.raises(UnreadableFileError, match=r"levels\.tif: has NaN or infinite levels"):
            read_photo(tmp_path / "levels.tif")


def test_a_standpoint_is_not_looked_for_past_the_pole(monkeypatch: pytest.MonkeyPatch) -> None:
    box = trimesh.creation.box((1, 0.6, 0.3))
    tried = []
    monkeypatch.setattr(
        "partwright.partsdf.standpoint.outline", lambda s, camera: tried.append(camera) or outline(s, camera)
    )
    seen = outline(Scene(box.vertices, box.faces), Camera(20.0, 96.0, 25.0, "z", 0.0))
    found = find_standpoint(box.vertices, box.faces, seen, 20.0, 85.0, "z")
    assert max(camera.elevation for camera in tried) == _HIGHEST
    assert found.camera.elevation <= _HIGHEST


@pytest.mark.parametrize(
    ("settings", "weight", "message"),
    [
        ({"heads": 3}, 1.0, "expected a multiple of the 3 heads"),
        ({"heads": 4.0}, 1.0, "heads: expected a whole number"),
        ({"width": 0}, 1.0, "width: expected a whole number of at least 1"),
        ({}, float("nan"), "weights are not all finite"),
    ],
)
def test_damaged_companions(tmp_path: Path, settings: dict[str, Any], weight: float, message: str) -> None:
    model: Any = SimpleNamespace(hash="0", name="lamps")
    path = tmp_path / "lamps.encoder.safetensors"
    save_companion(path, "encoder", model, settings, {"a": torch.full((2,), weight)})
    with pytest.raises(ModelError, match=f"damaged, or no encoder .*{message}"):
        load_companion(path, "encoder", model, lambda known, _: EncoderSettings(**known))
    if settings:
        with pytest.raises(SettingError, match=message):
            GeneratorSettings(**settings)


def test_assertions_of_a_companion_are_told(tmp_path: Path) -> None:
    model: Any = SimpleNamespace(hash="0", name="lamps")
    path = tmp_path / "lamps.encoder.safetensors"
    save_companion(path, "encoder", model, {}, {"a": torch.ones(2)})

    def made(*_: Any) -> None:
        raise AssertionError("of a library")

    with pytest.raises(ModelError, match=r"damaged, or no encoder .*of a library"):
        load_companion(path, "encoder", model, made)
    with pytest.raises(SettingError, match="channels: expected a whole number"):
        ImageSettings((16, 16, 32.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "words",
    ["chairs x.obj -o out", "chairs -o out x.obj", "-o out chairs x.obj", "--model chairs -o out x.obj",
     "x.obj -o out --model chairs"],
)  # fmt: skip
def test_the_model_is_named_before_the_shape_or_as_an_option(words: str) -> None:
    found = parser().parse_args(["parts", "reconstruct", *words.split()])
    assert (found.model, found.shape, found.output) == ("chairs", Path("x.obj"), Path("out"))


def test_names_of_reconstruct_that_are_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["parts", "reconstruct"]
    for words in ("chairs x.obj --model cars", "--model cars chairs x.obj", "chairs --model cars x.obj"):
        with pytest.raises(SystemExit, match="2"):
            main([*command, *words.split()])
        assert "name the model once: before the shape, or as --model" in capsys.readouterr().err
    for words, message in (("", "required: [MODEL] SHAPE"), ("a b c.obj", "unrecognized arguments: c.obj")):
        with pytest.raises(SystemExit, match="2"):
            main([*command, *words.split()])
        assert message in capsys.readouterr().err
    for option in ("--seed 0", "--iterations 400", "--start auto"):  # said, though as by default
        picture = [str(tmp_path / "photo.png"), "-o", str(tmp_path / "out"), "--model", "chairs"]
        assert main([*command, *picture, *option.split()]) == 2
        assert f"{option.split()[0]} is for meshes and points" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--help"])
    said = " ".join(capsys.readouterr().out.split())
    plain = Settings("chairs")
    assert f"the start as it is (default: {plain.iterations})" in said
    assert f"samples a step (default: {plain.points})" in said
    assert f"(default: {plain.start})" in said
