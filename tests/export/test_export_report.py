"""FILE.report.json lies beside an export that changed something, and beside no other."""

from __future__ import annotations

import json
from pathlib import Path

from partwright.approximation.change import Change
from partwright.assembly import Assembly, Part, Similarity
from partwright.atomic_io import report_path
from partwright.export import export
from partwright.export.export_report import approximated_parts, write_report
from partwright.fields import Box, HollowBox, Sphere


def test_the_report_lists_changes(tmp_path: Path) -> None:
    assembly = Assembly((Part(Box((1, 1, 1)), name="a"),), unit="mm")
    path = tmp_path / "a.mjcf"
    write_report(assembly, path, [Change(("a",), "box", 0.1, 0.2, 0.3)], ["said"], format="MJCF")
    report = json.loads(report_path(path).read_text())
    assert report_path(path).name == "a.mjcf.report.json"
    assert report["approximated"] == [
        {"parts": ["a"], "to": "box", "volume_error_ratio": 0.1, "max_deviation": 0.2, "blend_dropped": 0.3}
    ]
    assert (report["notes"], report["unit"], report["format"]) == (["said"], "mm", "MJCF")


def test_the_parts_of_the_assembly_are_counted_and_not_their_copies(tmp_path: Path) -> None:
    legs = Part(Box((1, 1, 1)), name="leg", instances=(Similarity(translation=(3, 0, 0)),))
    pipe = Part(HollowBox((1, 1, 1), 0.2), (0, 5, 0), name="pipe")
    rest = Part(Box((1, 1, 1)), (0, 9, 0), name="bolt_hole")
    whole = Assembly((legs, pipe, Part(Box((2, 2, 2)), (9, 9, 9), name="bolt"), rest), unit="mm")
    path = tmp_path / "a.step"
    write_report(whole, path, [Change(("leg_02", "leg"), "box"), Change(("pipe_hole", "bolt_hole"), "box")])
    assert approximated_parts(path) == ["leg", "pipe", "bolt_hole"]


def test_a_report_goes_when_there_is_nothing_to_tell(tmp_path: Path) -> None:
    ball, box = Part(Sphere(1), name="ball"), Part(Box((1, 1, 1)), (1, 0, 0), blend=0.1, name="box")
    path = tmp_path / "a.scad"
    export(Assembly((ball, box)), path)
    assert approximated_parts(path) == ["box"]
    export(Assembly((ball,)), path)
    assert approximated_parts(path) == []
    assert list(tmp_path.iterdir()) == [path]
