"""The site builds strictly, its links lead somewhere, it fetches nothing, and search finds."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

pytest.importorskip("griffe", reason="the site is made with the extra docs")
sys.path.insert(0, str(ROOT))

from tools.docs_site.check import faults
from tools.docs_site.outside_files import OutsideFiles


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as CI builds it; warnings are errors (``strict`` in mkdocs.yml)."""
    for package in ("mkdocs", "material", "mkdocstrings", "mike", "pybullet"):
        pytest.importorskip(package, reason="the site is made with the extra docs")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_links_lead_somewhere_and_nothing_is_fetched_from_other_hosts(site: Path) -> None:
    assert len(list(site.rglob("*.html"))) > 40
    assert list(faults(site)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("awareness_lower", "reference/nav_adapter.html"),
        ("stop", "nav2.html"),
        ("LaserScan", "reference/perception.laser.html"),
    ],
)
def test_the_search_finds_a_word_as_a_whole(site: Path, words: str, page: str) -> None:
    index = json.loads((site / "search" / "search_index.json").read_text("utf-8"))
    separator = re.compile(index["config"]["separator"])
    assert separator.split(words) == [words]
    found = {
        entry["location"].partition("#")[0]
        for entry in index["docs"]
        if words.lower() in separator.split(f"{entry['title']} {entry['text']}".lower())
    }
    assert page in found


@pytest.mark.slow
def test_pages_show_docstrings_without_marks_of_another_language(site: Path) -> None:
    for path in (site / "reference").glob("*.html"):
        text = path.read_text("utf-8")
        assert not re.search(r":(?:class|func|meth|mod|data|attr|exc):", text), path.name
    adapter = (site / "reference" / "nav_adapter.html").read_text("utf-8")
    assert 'id="nav_adapter.NavAdapter.update"' in adapter


def test_the_check_reports_each_kind_of_fault(tmp_path: Path) -> None:
    (tmp_path / "other.html").write_text('<p id="there">text</p>')
    (tmp_path / "site.css").write_text("@import url(//fonts.example/a.css); b {}")
    (tmp_path / "index.html").write_text(
        '<link rel="stylesheet" href="site.css"><link rel="canonical" href="https://example.org">'
        '<a href="other.html#there">good</a><a href="https://example.org">good</a>'
        '<a href="/other.html">good</a><a href="#">good</a>'
        '<a href="gone.html">bad</a><a href="other.html#gone">bad</a>'
        '<script src="https://cdn.example/a.js"></script><img src="//cdn.example/a.png">'
        '<p style="background: url(https://cdn.example/b.png)"></p><pre class="mermaid"></pre>'
    )
    assert set(faults(tmp_path)) == {
        "index.html: gone.html: no such file",
        "index.html: other.html#gone: no such anchor",
        "index.html: fetches https://cdn.example/a.js",
        "index.html: fetches //cdn.example/a.png",
        "index.html: fetches https://cdn.example/b.png",
        "index.html: fetches https://unpkg.com/mermaid",
        "site.css: fetches //fonts.example/a.css",
    }


def test_links_out_of_docs_lead_to_pages_of_the_site(tmp_path: Path) -> None:
    for name, text in {
        "README.md": "[a guide](docs/guide.md#part) ![film](docs/film.webp) [x](examples/x.py)",
        "examples/x.py": "print(1)\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    guide = (
        "[x](../examples/x.py) [top](../README.md#try) [web](https://example.org)\n\n"
        "```md\n[x](../examples/x.py)\n```\n"
    )
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "guide.md").write_text(guide)
    (tmp_path / "docs" / "film.webp").write_bytes(b"")
    outside = OutsideFiles(tmp_path, {"guide.md": guide})
    assert outside.links_rewritten("guide.md", guide) == (
        "[x](files/examples/x.py.md) [top](files/README.md#try) [web](https://example.org)\n\n"
        "```md\n[x](../examples/x.py)\n```\n"
    )
    assert outside.pages.keys() == {"files/examples/x.py.md", "files/README.md"}
    assert "````python\nprint(1)\n````" in outside.pages["files/examples/x.py.md"]
    readme = outside.links_rewritten("files/README.md", outside.pages["files/README.md"])
    assert readme == "[a guide](../guide.md#part) ![film](../film.webp) [x](examples/x.py.md)"
