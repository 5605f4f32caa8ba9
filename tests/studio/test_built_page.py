"""The page in the package is built from the sources beside it. No Node is needed to find out."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import pytest

from partwright.export.html import page

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "studio"


def source_hash() -> str:
    """As `studio/vite.config.ts` computes it."""
    names = ["index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"]
    names += [
        f"../partwright/export/{formula}.glsl"
        for formula in ("distance", "superfrustum", "quadric", "profile", "pipe")
    ]
    names += [path.relative_to(SOURCES).as_posix() for path in (SOURCES / "src").rglob("*") if path.is_file()]
    result = hashlib.sha256()
    for name in sorted(names):
        result.update(name.encode() + b"\0" + (SOURCES / name).read_bytes() + b"\0")
    return result.hexdigest()


def test_the_built_page_is_current() -> None:
    if not SOURCES.is_dir():
        pytest.skip("the page's sources are not here, only the package")
    recorded = re.search(r'<meta name="sources" content="([0-9a-f]{64})"', page())
    assert recorded is not None
    assert recorded[1] == source_hash(), "build the page: cd studio && npm ci && npm run build"


def test_the_page_asks_for_nothing_from_elsewhere() -> None:
    text = page()
    assert "default-src 'none'" in text
    assert not re.search(r'(?:src|href)="(?!data:)', text)
    assert len(text) < 1_000_000
