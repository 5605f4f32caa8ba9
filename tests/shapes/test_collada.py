"""COLLADA files as shapes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.errors import PartwrightError, UnreadableFileError
from partwright.shapes import load_shape

pytest.importorskip("collada")


def written(path: Path, unit: str = "1", up: str = "Y_UP") -> Path:
    """A box and a ball beside it, in two nodes."""
    ball = trimesh.creation.icosphere(3, 0.5).apply_translation((3, 0, 0))
    both = [trimesh.creation.box((1, 2, 3)), ball]
    text = trimesh.exchange.dae.export_collada(both).decode()
    asset = f'<unit meter="{unit}"/><up_axis>{up}</up_axis>'
    assert "<up_axis>Y_UP</up_axis>" in text
    path.write_text(text.replace("<up_axis>Y_UP</up_axis>", asset))
    return path


@pytest.mark.parametrize("up", ["Y_UP", "Z_UP", "X_UP"])
def test_a_file_is_in_metres_with_its_own_up_axis(tmp_path: Path, up: str) -> None:
    shape = load_shape(written(tmp_path / "a.dae", "0.01", up))
    assert (shape.unit, shape.up) == ("m", up[0].lower())
    ball = trimesh.creation.icosphere(3, 0.5).volume
    assert shape.volume == pytest.approx(1e-6 * (6 + ball), rel=1e-5)
    np.testing.assert_allclose(shape.bounds(), [[-0.005, -0.01, -0.015], [0.035, 0.01, 0.015]], atol=1e-7)
    assert len(shape.nodes) == 2
    assert len({node.name for node in shape.nodes}) == 2


@pytest.mark.parametrize("text", ["", "<COLLADA", "solid a", "<?xml version='1.0'?><svg/>"])
def test_what_is_no_collada_is_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.dae"
    path.write_text(text)
    with pytest.raises(PartwrightError, match=r"a\.dae: ") as raised:
        load_shape(path)
    assert "\n" not in str(raised.value)


def test_what_is_damaged_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    whole = path.read_text()
    arrays = [at.start() for at in re.finditer("<float_array[^>]*>", whole)]
    path.write_text(whole[: arrays[0]] + whole[arrays[0] :].replace(">", ">x", 1))
    shape = load_shape(path)
    assert shape.volume == pytest.approx(trimesh.creation.icosphere(3, 0.5).volume, rel=1e-5)
    assert "left out 1 damaged or missing geometry" in shape.repairs
    path.write_text(re.sub(r"(<float_array[^>]*>)", r"\1x", whole))
    with pytest.raises(UnreadableFileError, match=r"a\.dae: it cannot be read as COLLADA: .*float"):
        load_shape(path)


SKIN = """<library_controllers><controller id="rig"><skin source="#{0}">
  <bind_shape_matrix>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1</bind_shape_matrix>
  <source id="j"><Name_array id="ja" count="1">bone</Name_array>
    <technique_common><accessor source="#ja" count="1" stride="1">
      <param name="JOINT" type="name"/></accessor></technique_common>
  </source>
  <source id="m"><float_array id="ma" count="16">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</float_array>
    <technique_common><accessor source="#ma" count="1" stride="16">
      <param name="T" type="float4x4"/></accessor></technique_common>
  </source>
  <source id="w"><float_array id="wa" count="1">1</float_array>
    <technique_common><accessor source="#wa" count="1" stride="1">
      <param name="WEIGHT" type="float"/></accessor></technique_common>
  </source>
  <joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#m"/></joints>
  <vertex_weights count="1"><input semantic="JOINT" source="#j" offset="0"/>
    <input semantic="WEIGHT" source="#w" offset="1"/><vcount>1</vcount><v>0 0</v></vertex_weights>
</skin></controller></library_controllers>"""


def test_a_body_with_a_skeleton_is_as_it_was_bound(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    text = path.read_text()
    box = re.search(r'<geometry id="([^"]+)"', text)[1]  # type: ignore[index]
    text = text.replace("<library_visual_scenes>", SKIN.format(box) + "<library_visual_scenes>", 1)
    geometry = rf'<instance_geometry url="#{box}".*?</instance_geometry>'
    path.write_text(re.sub(geometry, '<instance_controller url="#rig"/>', text, count=1, flags=re.S))
    ball = trimesh.creation.icosphere(3, 0.5).volume
    assert load_shape(path).volume == pytest.approx(8 * 6 + ball, rel=1e-5)
