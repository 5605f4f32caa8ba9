"""What may be asked: lengths, units, and bounds that no assembly can keep."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.errors import BoundsError
from partwright.tolerances import DistanceBounds
from partwright.tolerances.noise import roughness
from tests.tolerances.shapes import boss


@pytest.fixture(scope="module")
def shape() -> pw.Shape:
    return pw.load_shape(boss()[0].apply_scale(50), unit="mm")  # 100 mm long


@pytest.mark.parametrize(
    ("given", "own"),
    [("0.5mm", 0.5), (0.5, 0.5), ("0.5", 0.5), ("1%", 1.0), ("0.02 in", 0.508), ("1e-3m", 1.0)],
)
def test_lengths_are_read_in_any_unit(shape: pw.Shape, given: str | float, own: float) -> None:
    assert DistanceBounds.of(shape, tolerance=given).tolerance == pytest.approx(own * 1.8 / 100)
    assert DistanceBounds.of(shape, contain=True, inside=given) == DistanceBounds(
        contain=0.0, inside=pytest.approx(0.018 * own)
    )


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"tolerance": "link.stl"}, "expected a length"),
        ({"tolerance": "5 parsecs"}, "unknown length unit"),
        ({"tolerance": True}, "expected a length"),
        ({"contain": -1}, "expected a length"),
        ({"inside": "nan"}, "expected a length"),
        ({"tolerance": 0}, "finer than"),
        ({"tolerance": "0.05mm"}, "the least for this shape is 0.1 mm"),
        ({"contain": True, "inside": True}, "give one of them at least 0.1 mm"),
    ],
)
def test_what_cannot_be_kept_is_one_line(shape: pw.Shape, asked: dict, message: str) -> None:
    with pytest.raises(BoundsError, match=message) as error:
        DistanceBounds.of(shape, **asked)
    assert "\n" not in str(error.value)


def test_a_unit_needs_a_shape_that_has_one() -> None:
    with pytest.raises(BoundsError, match="--unit"):
        DistanceBounds.of(pw.load_shape(boss()[0]), tolerance="1mm")


def test_the_other_side_of_a_thin_wall_is_no_noise() -> None:
    """Walls as thick as a patch is wide: 2 % of the length."""
    tube = trimesh.creation.annulus(0.48, 0.5, 1.0, sections=96)
    assert roughness(pw.load_shape(tube)) < 3e-4


@pytest.mark.parametrize("sigma", [0.0, 0.002, 0.005])
def test_roughness_is_the_noise_of_the_surface(sigma: float) -> None:
    ball = trimesh.creation.icosphere(5, 0.9)
    noise = np.random.default_rng(0).normal(0, sigma, len(ball.vertices))
    rough = trimesh.Trimesh(ball.vertices * (1 + noise[:, None]), ball.faces, process=False)
    # a triangle's inside averages its three corners: two thirds of their noise, or so
    assert roughness(pw.load_shape(rough)) == pytest.approx(0.6 * sigma, rel=0.35, abs=1e-4)


def test_a_tolerance_below_the_noise_is_refused() -> None:
    ball = trimesh.creation.icosphere(5, 0.9)
    noise = np.random.default_rng(0).normal(0, 0.005, len(ball.vertices))
    rough = pw.load_shape(trimesh.Trimesh(ball.vertices * (1 + noise[:, None]), ball.faces, process=False))
    with pytest.raises(BoundsError, match="noise"):
        DistanceBounds.of(rough, tolerance="0.2%")
    assert DistanceBounds.of(rough, tolerance="3%").tolerance


@pytest.mark.parametrize("other", [{"curve": True}, {"min_iou": 0.9}])
def test_options_that_contradict_a_tolerance(shape: pw.Shape, other: dict) -> None:
    with pytest.raises(BoundsError):
        pw.fit(shape, tolerance="1%", **other)
    with pytest.raises(BoundsError):
        pw.fit_nodes(shape, tolerance=pw.Tolerance("1%"))
