"""The page as a file; what it does in a browser is tested in tests/studio."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.errors import UnsupportedFormatError
from partwright.export import export
from partwright.fields import Sphere


def test_the_assembly_stands_in_the_page_and_cannot_break_out_of_it(tmp_path: Path) -> None:
    assembly = Assembly(
        (Part(Sphere(1), name="</script><img src=x onerror=alert(1)>"),), name="a & <b>", unit="mm"
    )
    export(assembly, tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text("utf-8")
    found = re.findall(r'<script type="application/json" id="assembly">(.*?)</script>', text, re.DOTALL)
    assert len(found) == 1
    assert from_text(found[0]) == assembly
    assert json.loads(found[0])["name"] == "a & <b>"
    assert "<img" not in text
    assert "<title>a &amp; &lt;b&gt; · Partwright</title>" in text


def test_what_the_page_cannot_show_is_refused(tmp_path: Path) -> None:
    nested = Assembly((Part(Sphere(1)), Part(Sphere(2))))
    for _ in range(16):
        nested = Assembly((Part(Sphere(1)), nested))
    with pytest.raises(UnsupportedFormatError, match="15 deep"):
        export(nested, tmp_path / "a.html")
    assert not list(tmp_path.iterdir())
