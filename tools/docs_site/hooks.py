"""Events of MkDocs while it builds the site: generated pages, and links out of ``docs/``."""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path
from typing import Any, Final

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT: Final = Path(__file__).resolve().parents[2]
# MkDocs loads this file by its path; the pages come from the checkout, not from an installation.
sys.path.insert(0, str(ROOT))

from awarenav import __version__  # noqa: E402
from tools.docs_site import notebook, reference  # noqa: E402
from tools.docs_site.outside_files import FOLDER, OutsideFiles  # noqa: E402

#: Pages whose films and code get the full width.
_WIDE: Final = ("index.md", "gallery.md")
_outside: OutsideFiles | None = None


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Name the version; ask for the list of versions only where `mike` publishes it."""
    if config.repo_url:
        config.edit_uri = "edit/main/docs/"
    config.copyright = f"awarenav {__version__} · Apache-2.0"
    if os.environ.get("MIKE_DOCS_VERSION"):
        config.extra["version"] = {"provider": "mike"}
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are generated."""
    global _outside  # noqa: PLW0603  (MkDocs calls functions, and gives them nothing to share)
    add = partial(_add, files, config)
    _outside = OutsideFiles(
        ROOT, {page.src_uri: page.content_string for page in files.documentation_pages()}
    )
    for name, text in _outside.pages.items():
        add(name, content=text)
    for name, path in _outside.pictures.items():
        add(name, abs_src_path=str(ROOT / path))
    for name, text in reference.pages().items():
        add(name, content=text)
    stem = notebook.NOTEBOOK.stem
    text, pictures = notebook.page(notebook.read(), stem)
    add(f"{stem}.md", content=text)
    for name, png in pictures.items():
        add(name, content=png)
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Lead links out of ``docs/`` to pages of the site; give films and code their full width."""
    if page.file.src_uri in _WIDE:
        page.meta["hide"] = ["navigation"]
    elif page.file.src_uri.startswith(f"{FOLDER}/"):
        page.meta["hide"] = ["navigation", "toc"]
    return markdown if _outside is None else _outside.links_rewritten(page.file.src_uri, markdown)


def _add(files: Files, config: MkDocsConfig, name: str, **source: Any) -> None:
    files.append(File.generated(config, name, **source))
