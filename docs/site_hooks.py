"""What MkDocs cannot know by itself: links out of docs/, and formulas.

A page of docs/ may link to a benchmark's results or an example by its path in the repository, as a reader of
the repository expects. The site takes those files in, so that strict mode checks these links, too.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import TYPE_CHECKING

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

OUTWARDS = re.compile(r"\]\(\.\./([^)#]+)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    root = Path(config.docs_dir).parent
    linked = {
        name
        for page in files.documentation_pages()
        if "/" not in page.src_uri
        for name in OUTWARDS.findall(page.content_string)
    }
    for name in sorted(linked):
        if (root / name).is_file():
            files.append(File.generated(config, name, abs_src_path=str(root / name)))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    return markdown if "/" in page.file.src_uri else OUTWARDS.sub(r"](\1", markdown)


def on_page_content(content: str, **_: object) -> str:
    """Formulas as MathML, which browsers draw without a script."""
    return FORMULA.sub(
        lambda found: convert(html.unescape(found[3]), display="block" if found[2] == "[" else "inline"),
        content,
    )
