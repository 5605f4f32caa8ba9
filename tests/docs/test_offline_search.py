"""The site's search works on pages that are opened from the disk, without a server or a network."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.browsers import PATIENCE

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A site of two pages, with the theme, the plugins and the script of the real one."""
    config = pytest.importorskip("mkdocs.config", reason="mkdocs is missing: pip install 'partwright[docs]'")
    build = pytest.importorskip("mkdocs.commands.build")
    pytest.importorskip("material")
    real = (ROOT / "mkdocs.yml").read_text()
    assert "- offline" in real
    assert "javascripts/iframe-worker.js" in real
    (tmp_path / "docs" / "javascripts").mkdir(parents=True)
    shutil.copy(ROOT / "docs" / "javascripts" / "iframe-worker.js", tmp_path / "docs" / "javascripts")
    (tmp_path / "docs" / "index.md").write_text("# Start\n\nNothing here.\n")
    (tmp_path / "docs" / "other.md").write_text("# Wheelbarrow\n\nA word of its own: wheelbarrow.\n")
    (tmp_path / "mkdocs.yml").write_text(
        "site_name: Site\nuse_directory_urls: false\ntheme: {name: material, font: false}\n"
        "extra: {polyfills: [javascripts/iframe-worker.js]}\nplugins: [search, offline]\n"
    )
    build.build(config.load_config(str(tmp_path / "mkdocs.yml")))
    return tmp_path / "site"


def test_search_finds_a_page_without_a_server(browser: Any, site: Path) -> None:
    context = browser.new_context(offline=True)
    page = context.new_page()
    page.set_default_timeout(1000 * PATIENCE)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri(), wait_until="load")
    page.wait_for_function("document.documentElement.classList.contains('js')")  # its script has run
    page.click("input.md-search__input")
    page.keyboard.type("wheelbarrow")  # it listens for keys
    found = page.locator(".md-search-result__link").first
    found.wait_for(state="attached", timeout=1000 * PATIENCE)
    assert found.get_attribute("href").split("?")[0].endswith("/other.html")
    assert all(url.startswith(("file:", "data:", "about:", "blob:")) for url in asked)
    context.close()
