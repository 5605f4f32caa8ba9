"""Configurations of trainings check themselves, and those that are committed are valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from partwright.errors import SettingError, UnreadableFileError
from partwright.partsdf.config import read_config


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("family = ", UnreadableFileError, "is no TOML file"),
        ('family = "a"', SettingError, "name is missing"),
        ('family = "a"\nname = "b"\nsize = 3', SettingError, "unknown key size"),
        ('family = "a"\nname = "b"\n[decoder]\nwidht = 3', SettingError, "unknown key decoder.widht"),
        ('family = "a"\nname = "b"\n[decoder]\nwidth = 0', SettingError, "decoder.width is 0"),
        ('family = "a"\nname = "b"\n[decoder]\nwidth = "big"', SettingError, "decoder.width is 'big'"),
        ('family = "a"\nname = "b"\ndecoder = 3', SettingError, "decoder is 3; expected a table"),
        ('family = "a"\nname = "b/c"', SettingError, "name is 'b/c'"),
        ('family = "a"\nname = "b"\n[training]\nprecision = "8"', SettingError, "training.precision is '8'"),
        ('family = "a"\nname = "b"\n[training]\nbatch = 3\ndevices = 2', SettingError, "cannot share"),
        ('family = "a"\nname = "b"\n[losses]\nhard = 1.5', SettingError, "losses.hard is 1.5"),
    ],
)
def test_configurations_check_themselves(
    tmp_path: Path, text: str, error: type[Exception], message: str
) -> None:
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(error, match=message):
        read_config(tmp_path / "c.toml")


@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "configs").glob("*.toml")))
def test_committed_configurations_are_valid(path: Path) -> None:
    assert read_config(path).name
