"""A fit of what has threads: plain parts that say which thread they have."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.threads import Thread
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion
from partwright.meshing.manifolds import as_mesh
from partwright.methods import Fitted
from partwright.superfrusta.thread_standards import standard_thread
from partwright.superfrusta.threaded import with_threads
from tests.threaded import LENGTH, RADIUS, threaded

SCALE = 5.0 / RADIUS  # to M10, coarse
ACROSS = 17.0


def bolt() -> Manifold:
    head = Manifold.cylinder(6.4, ACROSS / math.sqrt(3), ACROSS / math.sqrt(3), 6)
    return threaded().scale((SCALE,) * 3) + head.translate((0, 0, SCALE * LENGTH / 2))


def test_a_bolt_is_a_shaft_that_says_its_thread_and_a_head(tmp_path) -> None:
    shape = pw.load_shape(as_mesh(bolt()), unit="mm")
    fitted = pw.fit(shape, "solids", quality="draft")
    shaft, head = sorted(fitted.assembly.parts, key=lambda part: not part.metadata)
    assert isinstance(shaft.field, Cylinder)
    assert shaft.field.radius == pytest.approx(5.0, abs=0.02)
    assert isinstance(head.field, Extrusion)
    assert len(head.field.profile.corners) == 6
    assert head.metadata == {}
    said = dict(shaft.metadata)
    assert said.pop("thread_diameter") == pytest.approx(10.0, rel=2e-3)
    assert said.pop("thread_pitch") == pytest.approx(1.5, rel=5e-3)
    assert said.pop("thread_length") == pytest.approx(15.0, abs=0.8)
    assert said == {"thread": "M10", "thread_kind": "external", "thread_hand": "right"}
    assert any("external thread M10" in line for line in fitted.warnings)
    assert "thread M10" in fitted.assembly.describe()
    out = tmp_path / "bolt.scad"
    pw.export(fitted.assembly, out)
    assert "thread M10" in out.read_text()


def test_holes_that_are_alike_are_one_line() -> None:
    hole = Part(
        Cylinder(2.4, 10), (22, 0, 0), instances=(Similarity(translation=(-44, 0, 0)),), name="bolt_hole"
    )
    plate = Assembly((Part(Box((60, 40, 8)), name="plate"), hole), "difference", unit="mm")
    up = np.array([0.0, 0.0, 1.0])
    threads = [Thread(np.array([x, 0.0, 0.0]), up, -1.0, 2.4, 3.0, 8.0, True) for x in (22, -22)]
    said = with_threads(Fitted(plate, "converged", {}), threads)
    (line,) = said.warnings
    assert line.startswith("bolt_hole: internal thread M6")
    assert line.endswith("(2 times)")
    assert said.assembly["bolt_hole"].metadata["thread_hand"] == "left"
    assert said.assembly["plate"].metadata == {}
    away = dataclasses.replace(threads[0], axis=np.array([0.0, 0.0, 0.0]))
    assert with_threads(Fitted(plate, "converged", {}), [away]).assembly == plate


def test_a_stud_says_the_threads_of_both_its_ends(tmp_path) -> None:
    """What was said of the last thread took the place of what was said of the others."""
    stud = Assembly((Part(Cylinder(4.0, 60), name="stud"),), unit="mm")
    up = np.array([0.0, 0.0, 1.0])
    coarse = Thread(np.array([0.0, 0.0, 20.0]), up, 1.25, 3.2, 4.0, 16.0, False)
    fine = dataclasses.replace(coarse, axis=-coarse.axis, pitch=1.0, length=20.0)
    like_it = dataclasses.replace(fine, pitch=1.01, length=20.2)
    part = with_threads(Fitted(stud, "converged", {}), [coarse, fine, like_it]).assembly["stud"]
    assert (part.metadata["thread"], part.metadata["thread_length"]) == ("M8", 16.0)
    assert (part.metadata["thread_2"], part.metadata["thread_2_length"]) == ("M8x1", 20.0)
    assert "thread_3" not in part.metadata
    by_hand = Assembly((dataclasses.replace(stud.parts[0], metadata={"thread": "as told"}),), unit="mm")
    kept = with_threads(Fitted(by_hand, "converged", {}), [fine]).assembly["stud"].metadata
    assert (kept["thread"], kept["thread_2"]) == ("as told", "M8x1")
    whole = Assembly((part,), unit="mm")
    assert ", thread M8, thread M8x1" in whole.describe()
    out = tmp_path / "stud.scad"
    pw.export(whole, out)
    assert ", thread M8, thread M8x1" in out.read_text()


def test_threads_by_their_standard_names() -> None:
    assert standard_thread(7.9, 1.25, "mm") == "M8"
    assert standard_thread(8.0, 1.0, "mm") == "M8x1"
    assert standard_thread(0.25, 1 / 20, "in") == "1/4-20 UNC"
    assert standard_thread(25.4 / 4, 25.4 / 28, "mm") == "1/4-28 UNF"
    assert standard_thread(8.0, 1.25, None) is None
    assert standard_thread(8.0, 3.0, "mm") is None
    assert standard_thread(9.3, 1.25, "mm") is None
