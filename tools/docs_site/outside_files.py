"""Links of pages to files of the repository outside ``docs/``: the site has a page for each.

A link such as ``../examples/plug_into_planner.py`` works in the repository as it is. On the site
it leads to ``files/examples/plug_into_planner.py``, a page that shows the file.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from .notebook import FENCED

FOLDER: Final = "files"
_LINK: Final = re.compile(r"""(\]\(|(?:src|srcset|href|poster)=")([^)\s"#]+)((?:#[^)\s"]*)?[)"])""")
_LANGUAGES: Final = {
    ".py": "python",
    ".yaml": "yaml",
    ".toml": "toml",
    ".sh": "sh",
    ".cff": "yaml",
    ".json": "json",
}
PICTURES: Final = (".png", ".webp", ".svg", ".jpg", ".gif", ".mp4")


class OutsideFiles:
    """The pages of files outside ``docs/``, found by following links.

    Args:
        root: the repository.
        pages: Markdown of every page of ``docs/`` by its path there.

    Attributes:
        pages: Markdown of each further page, by its path on the site.
        pictures: path in the repository of each picture that is needed, by its path on the site.
    """

    def __init__(self, root: Path, pages: Mapping[str, str]) -> None:
        self._root = root
        self._home = {name: f"docs/{name}" for name in pages}
        self.pages: dict[str, str] = {}
        self.pictures: dict[str, str] = {}
        waiting = list(pages.items())
        while waiting:
            name, text = waiting.pop()
            for target in self._outside(name, text):
                page = page_of(self._root, target)
                if page in self.pages or page in self.pictures:
                    continue
                if target.endswith(PICTURES):
                    self.pictures[page] = target
                    continue
                self._home[page] = target
                self.pages[page] = _shown(self._root, target)
                waiting.append((page, self.pages[page]))

    def links_rewritten(self, name: str, text: str) -> str:
        """Return a page's Markdown with links that lead to pages of the site."""
        if name not in self._home:
            return text
        folder = posixpath.dirname(name)

        def rewrite(link: re.Match[str]) -> str:
            target = self._resolved(name, link.group(2))
            if target is None or not (self._root / target).exists():
                return link.group(0)
            page = page_of(self._root, target)
            return link.group(1) + posixpath.relpath(page, folder or ".") + link.group(3)

        return outside_code(text, lambda part: _LINK.sub(rewrite, part))

    def _outside(self, name: str, text: str) -> Iterator[str]:
        """Yield the files outside ``docs/`` that a page links to."""
        prose = "".join(part for part in FENCED.split(text) if not FENCED.fullmatch(part))
        for link in _LINK.finditer(prose):
            target = self._resolved(name, link.group(2))
            if target and not target.startswith("docs/") and (self._root / target).exists():
                yield target

    def _resolved(self, name: str, link: str) -> str | None:
        """Return the path in the repository that a link leads to; None for another host."""
        if re.match(r"[a-z]+:|//|/", link):
            return None
        home = self._home[name]
        folder = home if (self._root / home).is_dir() else posixpath.dirname(home)
        path = posixpath.normpath(posixpath.join(folder, link))
        return None if path.startswith("..") else path


def page_of(root: Path, target: str) -> str:
    """Return the path on the site of a file or folder of the repository."""
    if target.startswith("docs/"):
        # A notebook has a page that shows it.
        return target.removeprefix("docs/").replace(".ipynb", ".md")
    if (root / target).is_dir():
        return f"{FOLDER}/{target}/index.md"
    shown_as_it_is = target.endswith((".md", *PICTURES))
    return f"{FOLDER}/{target}" + ("" if shown_as_it_is else ".md")


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """Return text in which everything but fenced code was changed by a function."""
    parts = FENCED.split(text)
    return "".join(part if FENCED.fullmatch(part) else change(part) for part in parts)


def _shown(root: Path, target: str) -> str:
    """Return the Markdown that shows a file or folder."""
    path = root / target
    if path.is_dir():
        names = sorted(each.name for each in path.iterdir() if each.suffix in (".py", ".md"))
        return f"# {target}\n\n" + "\n".join(f"- [`{name}`]({name})" for name in names) + "\n"
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return text
    language = _LANGUAGES.get(path.suffix, "text")
    return f"# {target}\n\n````{language}\n{text}````\n"
