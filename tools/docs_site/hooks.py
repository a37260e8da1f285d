"""Events of MkDocs while it builds the site: generated pages, and links out of ``docs/``."""

from __future__ import annotations

import io
import os
import posixpath
import re
import sys
from functools import partial
from pathlib import Path
from typing import Any, Final

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from PIL import Image

ROOT: Final = Path(__file__).resolve().parents[2]
# MkDocs loads this file by its path; the pages come from the checkout, not from an installation.
sys.path.insert(0, str(ROOT))

from awarenav import __version__  # noqa: E402
from tools.docs_site import gallery, notebook, reference  # noqa: E402

#: The film of the home page, without motion.
_STILL: Final = "images/crossing_still.png"
#: Pages whose films and code get the full width.
_WIDE: Final = ("index.md", "gallery.md")
_LINK: Final = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s#:]+)(#[^)\s]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Name the version; ask for the list of versions only where `mike` publishes it."""
    if config.repo_url:
        config.edit_uri = "edit/main/docs/"
    config.copyright = f"awarenav {__version__} · Apache-2.0"
    if "mkdocs-click" not in config.markdown_extensions:
        config.markdown_extensions.append("mkdocs-click")
    if os.environ.get("MIKE_DOCS_VERSION"):
        config.extra["version"] = {"provider": "mike"}
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are generated."""
    add = partial(_add, files, config)
    for name, text in (reference.pages() | {gallery.PAGE: gallery.gallery_page()}).items():
        add(name, content=text)
    stem = notebook.NOTEBOOK.stem
    text, pictures = notebook.page(notebook.read(), stem)
    add(f"{stem}.md", content=text)
    for name, png in pictures.items():
        add(name, content=png)
    add(_STILL, content=first_picture(ROOT / "docs" / "images" / "crossing.webp"))
    return files


def first_picture(film: Path) -> bytes:
    """Return the first picture of a film as PNG, for readers who do not want motion."""
    png = io.BytesIO()
    with Image.open(film) as pictures:
        pictures.convert("RGB").save(png, "PNG")
    return png.getvalue()


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, **_: Any) -> str:
    """Lead links out of ``docs/`` to the repository; give films and code their full width."""
    if page.file.src_uri in _WIDE:
        page.meta["hide"] = ["navigation"]
    return links_rewritten(page.file.src_uri, markdown, config.repo_url or "")


def links_rewritten(name: str, text: str, repo_url: str) -> str:
    """Return a page's Markdown with links that work on the site.

    A link to a file outside ``docs/`` leads to the repository; without an address of the
    repository its text stays. A notebook's link leads to the page that shows it.

    Args:
        name: path of the page in ``docs/``.
        text: its Markdown.
        repo_url: address of the repository, or empty.
    """

    def rewrite(link: re.Match[str]) -> str:
        shown, target, anchor = link.group(1), link.group(2), link.group(3) or ""
        path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(name), target))
        if path.startswith("docs/"):
            return f"[{shown}]({target.replace('.ipynb', '.md')}{anchor})"
        return f"[{shown}]({repo_url}/blob/main/{path}{anchor})" if repo_url else shown

    parts = notebook.FENCED.split(text)
    return "".join(
        part if notebook.FENCED.fullmatch(part) else _LINK.sub(rewrite, part) for part in parts
    )


def _add(files: Files, config: MkDocsConfig, name: str, **source: Any) -> None:
    files.append(File.generated(config, name, **source))
