"""COLLADA files as shapes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.errors import PartwrightError, UnreadableFileError
from partwright.shapes import load_shape
from partwright.shapes.collada import read_collada

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
    assert shape.volume == pytest.approx(BALL, rel=1e-5)
    assert "left out 1 body that could not be read" in shape.repairs
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


def rigged(path: Path, controller: str, instance: str = "rig") -> Path:
    """Of `written`, with the box behind a controller: `{0}` in its text is the box's id, `{1}` the ball's."""
    text = written(path).read_text()
    box, ball = re.findall(r'<geometry id="([^"]+)"', text)
    text = text.replace(
        "<library_visual_scenes>", controller.format(box, ball) + "<library_visual_scenes>", 1
    )
    geometry = rf'<instance_geometry url="#{box}".*?</instance_geometry>'
    path.write_text(re.sub(geometry, f'<instance_controller url="#{instance}"/>', text, count=1, flags=re.S))
    return path


BALL = trimesh.creation.icosphere(3, 0.5).volume
MORPH = """<library_controllers><controller id="rig"><morph source="#{{0}}">
  <source id="t"><IDREF_array id="ta" count="1">{{1}}</IDREF_array>
    <technique_common><accessor source="#ta" count="1" stride="1">
      <param name="MORPH_TARGET" type="IDREF"/></accessor></technique_common>
  </source>
  <source id="w"><float_array id="wa" count="1">{0}</float_array>
    <technique_common><accessor source="#wa" count="1" stride="1">
      <param name="MORPH_WEIGHT" type="float"/></accessor></technique_common>
  </source>
  <targets><input semantic="MORPH_TARGET" source="#t"/><input semantic="MORPH_WEIGHT" source="#w"/></targets>
</morph></controller></library_controllers>"""


def test_a_body_with_a_skeleton_is_as_it_was_bound(tmp_path: Path) -> None:
    assert load_shape(rigged(tmp_path / "a.dae", SKIN)).volume == pytest.approx(8 * 6 + BALL, rel=1e-5)


@pytest.mark.parametrize(
    ("weight", "told"), [(0, ()), (0.5, ("took 1 body with morph targets without them",))]
)
def test_a_body_with_morph_targets_is_as_without_them(
    tmp_path: Path, weight: float, told: tuple[str, ...]
) -> None:
    shape = load_shape(rigged(tmp_path / "a.dae", MORPH.format(weight)))
    assert shape.volume == pytest.approx(6 + BALL, rel=1e-5)
    assert read_collada(tmp_path / "a.dae").repairs == told


def test_a_body_behind_a_lost_controller_is_told(tmp_path: Path) -> None:
    shape = load_shape(rigged(tmp_path / "a.dae", SKIN, instance="another"))
    assert shape.volume == pytest.approx(BALL, rel=1e-5)
    assert read_collada(tmp_path / "a.dae").repairs == ("left out 1 body that could not be read",)


def test_lights_and_comments_are_no_bodies(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    lamp = '<!-- a lamp --><instance_light url="#gone"/><instance_geometry'
    path.write_text(path.read_text().replace("<instance_geometry", lamp, 1))
    assert read_collada(path).repairs == ()


def test_a_transform_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    path.write_text(
        path.read_text().replace("<instance_geometry", "<skew>45 1 0 0 0 1 0</skew><instance_geometry")
    )
    (told,) = read_collada(path).repairs
    assert told.startswith("left out 2 transforms")


def test_indices_below_zero_do_not_count_from_the_end(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    text = path.read_text()
    first = re.search(r"<p>(\d+)", text)
    assert first is not None
    path.write_text(f"{text[: first.start(1)]}-1{text[first.end(1) :]}")
    shape = load_shape(path)
    assert shape.volume == pytest.approx(BALL, rel=1e-5)
    assert read_collada(tmp_path / "a.dae").repairs == ("left out 1 body that could not be read",)


def test_instances_that_double_are_counted_before_they_are_made(tmp_path: Path) -> None:
    path = written(tmp_path / "a.dae")
    text = path.read_text()
    box, _ = re.findall(r'<geometry id="([^"]+)"', text)
    nodes = [f'<node id="n0"><instance_geometry url="#{box}"/></node>']
    nodes += [f'<node id="n{i}">{2 * f"""<instance_node url="#n{i - 1}"/>"""}</node>' for i in range(1, 40)]
    library = f"<library_nodes>{''.join(nodes)}</library_nodes>"
    text = text.replace("<library_visual_scenes>", library + "<library_visual_scenes>", 1)

    def showing(last: int) -> Path:
        node = f'<node><instance_node url="#n{last}"/></node></visual_scene>'
        path.write_text(text.replace("</visual_scene>", node, 1))
        return path

    assert len(load_shape(showing(3)).nodes) == 10
    with pytest.raises(
        UnreadableFileError, match=r"a\.dae: builds 5\.49756e\+11 objects of 6\.597.*e\+12"
    ) as raised:
        load_shape(showing(39))
    assert "\n" not in str(raised.value)
