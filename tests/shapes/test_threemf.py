"""3MF packages: objects of objects, several models, and what comes to too much."""

from __future__ import annotations

import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.errors import EmptyShapeError, UnreadableFileError
from partwright.shapes import load_shape

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
_RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="a" Target="/3D/first.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>"
)


def mesh(number: int, size: float = 1.0, name: str = "") -> str:
    cube = trimesh.creation.box((size,) * 3)
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*v) for v in cube.vertices)
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*f) for f in cube.faces)
    return (
        f'<object id="{number}" name="{name}"><mesh><vertices>{vertices}</vertices>'
        f"<triangles>{faces}</triangles></mesh></object>"
    )


def parts(number: int, *components: str) -> str:
    inside = "".join(f"<component {about}/>" for about in components)
    return f'<object id="{number}"><components>{inside}</components></object>'


def write(path: Path, resources: str, build: str, **models: str) -> Path:
    def model(inside: str, then: str) -> str:
        about = f'unit="inch" xmlns="{_CORE}" xmlns:p="{_PRODUCTION}"'
        return f"<model {about}><resources>{inside}</resources><build>{then}</build></model>"

    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("_rels/.rels", _RELATIONS)
        archive.writestr("3D/first.model", model(resources, build))
        for name, inside in models.items():
            archive.writestr(f"3D/{name}.model", model(inside, ""))
    return path


def test_objects_of_objects_stand_where_all_their_transforms_say(tmp_path: Path) -> None:
    path = write(
        tmp_path / "pair.3mf",
        mesh(1, name="cube")
        + parts(2, 'objectid="1"', 'objectid="1" transform="-1 0 0 0 1 0 0 0 1 3 0 0"')
        + parts(3, 'objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 5 0"'),
        '<item objectid="3" transform="2 0 0 0 2 0 0 0 2 0 0 100"/>',
    )
    shape = load_shape(path)
    assert [node.name for node in shape.nodes] == ["cube", "cube_2"]
    assert shape.unit == "in"
    assert shape.volume == pytest.approx(16)
    # The second cube, 3 along x, is turned onto y, moved by 5, made twice as large and moved up by 100.
    np.testing.assert_allclose(shape.vertices.min(axis=0), (-1, 9, 99), atol=1e-9)
    np.testing.assert_allclose(shape.vertices.max(axis=0), (1, 17, 101), atol=1e-9)


def test_objects_may_lie_in_other_models_of_the_package(tmp_path: Path) -> None:
    resources = parts(1, 'objectid="7" p:path="/3D/second.model"')
    path = write(tmp_path / "two.3mf", resources, '<item objectid="1"/>', second=mesh(7, 2.0, "far"))
    shape = load_shape(path)
    assert [node.name for node in shape.nodes] == ["far"]
    assert shape.volume == pytest.approx(8)
    with pytest.raises(UnreadableFileError, match=r"names the model '3d/third.model'"):
        load_shape(write(path, resources.replace("second", "third"), '<item objectid="1"/>'))


def test_what_is_not_built_is_left_out(tmp_path: Path) -> None:
    with pytest.raises(EmptyShapeError, match="builds no triangles"):
        load_shape(write(tmp_path / "none.3mf", mesh(1), ""))


@pytest.mark.parametrize(
    ("resources", "says"),
    [
        (mesh(1) + parts(2, 'objectid="2"', 'objectid="1"'), "contains itself"),
        (mesh(1) + parts(2, 'objectid="3"') + parts(3, 'objectid="1"', 'objectid="2"'), "contains itself"),
        (parts(2, 'objectid="9"'), "names object '9'"),
        (parts(2, 'objectid="2" transform="1 0 0"'), "cannot be read as 3MF"),
        (mesh(2).replace('v1="0"', 'v1="80"'), "names vertex 80 of 8"),
        ("".join(parts(i, *[f'objectid="{i + 1}"'] * 2) for i in range(2, 60)) + mesh(60), "builds 2.88"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>', "cannot be read as 3MF"),
    ],
    ids=["itself", "circle", "unknown", "transform", "index", "doubled", "entity"],
)  # fmt: skip
def test_packages_without_end_or_sense_are_refused_at_once(tmp_path: Path, resources: str, says: str) -> None:
    path = write(tmp_path / "odd.3mf", resources, '<item objectid="2"/>')
    started = time.perf_counter()
    with pytest.raises(UnreadableFileError, match=says):
        load_shape(path)
    assert time.perf_counter() - started < 5


def test_long_chains_and_many_places_are_read(tmp_path: Path) -> None:
    chain = "".join(parts(i, f'objectid="{i + 1}"') for i in range(2, 3000)) + mesh(3000)
    assert load_shape(write(tmp_path / "chain.3mf", chain, '<item objectid="2"/>')).volume == pytest.approx(1)
    doubled = "".join(
        parts(i, f'objectid="{i + 1}"', f'objectid="{i + 1}" transform="1 0 0 0 1 0 0 0 1 {2 << i} 0 0"')
        for i in range(1, 8)
    )
    shape = load_shape(write(tmp_path / "many.3mf", doubled + mesh(8), '<item objectid="1"/>'))
    assert len(shape.nodes) == 128
    assert shape.volume == pytest.approx(128)
