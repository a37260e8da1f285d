"""Checks of the built site, without a network: links, anchors, and requests to other hosts.

    python -m tools.docs_site.check site

Exit status 1 when a link of a page leads nowhere, or when a page would fetch a script, style,
font or picture from another host.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

#: Attributes by which a browser fetches something at once.
_FETCHED: Final = {
    *(("script", "src"), ("img", "src"), ("img", "srcset"), ("source", "src")),
    *(("source", "srcset"), ("video", "src"), ("video", "poster"), ("iframe", "src")),
    *(("audio", "src"), ("embed", "src"), ("object", "data"), ("link", "href")),
}
#: Kinds of <link> that are fetched; others, such as the canonical address, are not.
_FETCHED_LINKS: Final = frozenset(
    ("stylesheet", "icon", "preload", "preconnect", "dns-prefetch", "modulepreload")
)
_IN_STYLE: Final = re.compile(r"""(?:url\(|@import\s+)["']?((?:https?:)?//[^"')\s]+)""")


class _Page(HTMLParser):
    """The anchors and the references of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if given.get("class") == "mermaid":
            self.fetched.append("https://unpkg.com/mermaid")  # the theme's script would fetch it
        self.fetched += _IN_STYLE.findall(given.get("style", ""))
        for name in ("href", "src", "srcset", "data", "poster"):
            if name not in given:
                continue
            fetched = (tag, name) in _FETCHED
            if tag == "link":
                fetched = bool(_FETCHED_LINKS & set(given.get("rel", "").split()))
            (self.fetched if fetched else self.links).append(given[name])


def faults(site: Path) -> Iterator[str]:
    """Yield what is wrong with a built site."""
    pages = {
        path.resolve(): _Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")
    }
    for path, page in pages.items():
        name = path.relative_to(site.resolve())
        for target in page.fetched:
            if re.match(r"(https?:)?//", target):
                yield f"{name}: fetches {target}"
        for target in page.links + page.fetched:
            if problem := _problem(site, path, target, pages):
                yield f"{name}: {target}: {problem}"
    for path in site.rglob("*.css"):
        for target in _IN_STYLE.findall(path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(site)}: fetches {target}"


def _problem(site: Path, path: Path, target: str, pages: dict[Path, _Page]) -> str | None:
    """Return what is wrong with a link within the site; None for a good one."""
    parts = urlsplit(target)
    if parts.scheme or parts.netloc:
        return None
    folder = site if parts.path.startswith("/") else path.parent
    file = (folder / unquote(parts.path).lstrip("/")).resolve() if parts.path else path
    if file.is_dir():
        file /= "index.html"
    if not file.is_file():
        return "no such file"
    anchor = unquote(parts.fragment)
    if anchor and file in pages and anchor not in pages[file].anchors:
        return "no such anchor"
    return None


def main() -> int:
    """Print the faults of a site; return 1 if there are any."""
    if len(sys.argv) != 2 or not Path(sys.argv[1], "index.html").is_file():
        print("usage: python -m tools.docs_site.check SITE, a folder that holds index.html")
        return 2
    found = sorted(set(faults(Path(sys.argv[1]))))
    print("\n".join(found) or "no faults")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
