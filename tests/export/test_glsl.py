"""The shader is compiled by the reference compiler, and run: its values are ours."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import SettingError
from partwright.export import export
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Frustum,
    Quadric,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)
from tests.export.opengl import run_sdf

POINTS = np.random.default_rng(1).uniform(-1.5, 1.5, (10_000, 3)).astype(np.float32)
NASTY_NAMES = ["gl_ES", "half pi", "//\\", "3 legs", "Löwe", "", "if", "a__b"]


def random_parts(count: int, seed: int) -> list[Part]:
    """Parts of which every parameter is sometimes zero."""
    rng = np.random.default_rng(seed)

    def some(largest: float) -> float:
        return float(rng.random() * largest * (rng.random() > 0.2))

    return [
        Part(
            SuperFrustum(
                tuple(rng.random(3) * (rng.random(3) > 0.1)),
                some(1.0),
                0.001 + some(0.2),
                float(rng.random() * 2),
                some(1.0),
                some(1.0),
            ),
            tuple(rng.normal(size=3) * 0.4),
            tuple(rng.normal(size=4)),
            blend=some(0.1),
            name=NASTY_NAMES[i % len(NASTY_NAMES)],
        )
        for i in range(count)
    ]


def written(assembly: Assembly, folder: Path) -> str:
    path = folder / "assembly.glsl"
    export(assembly, path)
    return path.read_text("utf-8")


def tree() -> Assembly:
    parts = random_parts(12, 1)
    hole = Assembly(tuple(parts[5:9]), blend=0.1, name="hole \\")
    shared = Assembly((parts[9], parts[10]), "intersection")
    return Assembly((Assembly(tuple(parts[:5])), hole, shared, parts[11]), "difference", unit="mm")


@pytest.mark.parametrize(
    "assembly",
    [
        pytest.param(Assembly(tuple(random_parts(40, 0))), id="union"),
        pytest.param(tree(), id="tree"),
        *(pytest.param(Assembly((p,)), id=f"random-{i}") for i, p in enumerate(random_parts(12, 3))),
        *(
            pytest.param(Assembly((Part(field, (0.1, 0.2, 0.3)),)), id=field.kind)
            for field in (
                Box((1, 0.5, 0)),
                Cylinder(0.4, 1),
                Cone(0.3, 0.5),
                Frustum(0.3, 0.5, 0.7),
                Sphere(0.5),
                Capsule(0.2, 0.5),
                Tube(0.5, 0.1, 0.5),
                Torus(0.5, 0.1),
            )
        ),
    ],
)
def test_the_shader_gives_our_distances(tmp_path: Path, assembly: Assembly) -> None:
    values = run_sdf(written(assembly, tmp_path), POINTS)
    assert np.abs(values - assembly.distance(POINTS)).max() < 1e-5


def test_quadrics_give_our_distances(tmp_path: Path) -> None:
    turned = Similarity(1.0, (0.9, 0.1, -0.3, 0.2), (0.2, -0.1, 0.3))
    fields = (
        Quadric.plane((1, 2, 3), 0.2),
        Quadric.sphere(0.6, (0.3, 0.2, 0.1)).complement(),
        Quadric.cylinder(0.5),
        Quadric.cone(0.4, (0, 0, 1), (0.1, 0, 0.3)),
        Quadric((2, 2, 0.5, 0, 0.3, -1, 0.1, 0.2, -0.1, 0.4)),
    )
    parts = [Part(field, blend=0.1 * (i == 2)) for i, field in enumerate(fields)]
    for assembly in (*(Assembly((part,)) for part in parts), Assembly(tuple(parts), "intersection")):
        whole = Assembly((assembly.transformed(turned), Part(Sphere(0.3))))
        values = run_sdf(written(whole, tmp_path), POINTS)
        assert np.abs(values - whole.distance(POINTS)).max() < 1e-5


def test_slight_bends_pass_into_none(tmp_path: Path) -> None:
    for bulge in (1e-7, 1e-5, 1e-3):
        assembly = Assembly((Part(SuperFrustum((0.5, 0.4, 1.0), dilation=0.01, bulge=bulge)),))
        assert np.abs(run_sdf(written(assembly, tmp_path), POINTS) - assembly.distance(POINTS)).max() < 1e-5


@pytest.mark.parametrize("head", ["#version 330", "#version 450", "#version 300 es\nprecision highp float;"])
def test_the_reference_compiler_accepts_it(tmp_path: Path, head: str) -> None:
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("glslangValidator is missing (Debian: glslang-tools)")
    shader = tmp_path / "shader.frag"
    place = "layout(location = 0) " if "450" in head else ""
    source = written(tree(), tmp_path)
    main = "void main() { colour = vec4(sdf(gl_FragCoord.xyz)); }"
    shader.write_text(f"{head}\n{source}\n{place}out vec4 colour;\n{main}\n")
    done = subprocess.run([compiler, shader], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_every_part_is_a_constant_beside_its_name(tmp_path: Path) -> None:
    text = written(Assembly((Part(Sphere(0.5), name="Left wheel"), Part(Box((1, 2, 3))))), tmp_path)
    assert "const Part LEFT_WHEEL = Part(vec3(0.0, 0.0, 0.0), vec4(0.0, 0.0, 0.0, 1.0)" in text
    assert "// Left wheel\n" in text
    assert text.count("const Part ") == 2


def test_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="parsec"):
        export(Assembly((Part(Sphere(0.5)),), unit="parsec"), tmp_path / "a.glsl")
    assert not list(tmp_path.iterdir())
