"""Command ``python -m tools.release TAG``: check that all is ready for a tag, and print its notes.

The notes are the section of the version in CHANGELOG.md, for the page of the release.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]


def version_of(root: Path) -> str:
    """Return ``__version__`` of the checkout."""
    text = (root / "awarenav/__init__.py").read_text(encoding="utf-8")
    (version,) = re.findall(r'^__version__ = "(.+)"$', text, re.MULTILINE)
    return str(version)


def release_date(changelog: str, version: str) -> str:
    """Return the date that the changelog gives to a version, as YYYY-MM-DD.

    Raises:
        ValueError: for a version without a dated section.
    """
    found = re.search(
        rf"^## \[{re.escape(version)}\] - (\d{{4}}-\d\d-\d\d)$", changelog, re.MULTILINE
    )
    if found is None:
        raise ValueError(
            f"CHANGELOG.md must have a section '## [{version}] - YYYY-MM-DD' for the version of "
            "awarenav/__init__.py"
        )
    return found[1]


def problems(root: Path, tag: str) -> tuple[str, ...]:
    """Return what does not agree with the tag, one sentence each; empty if all is ready."""
    version = version_of(root)
    found = []
    if tag != f"v{version}":
        found.append(f"the tag must be v{version}, as awarenav/__init__.py says, got {tag}")
    try:
        date = release_date((root / "CHANGELOG.md").read_text(encoding="utf-8"), version)
    except ValueError as error:
        return (*found, str(error))
    cff = (root / "CITATION.cff").read_text(encoding="utf-8")
    bib = (root / "CITATION.bib").read_text(encoding="utf-8")
    for file, text, line in (
        ("CITATION.cff", cff, f"version: {version}"),
        ("CITATION.cff", cff, f"date-released: {date}"),
        ("CITATION.bib", bib, f"version = {{{version}}}"),
    ):
        if line not in text:
            found.append(f"{file} must have '{line}'")
    return tuple(found)


def notes(changelog: str, version: str) -> str:
    """Return the section of a version, without its heading.

    Raises:
        ValueError: for a version without a section.
    """
    _, heading, rest = changelog.partition(f"\n## [{version}]")
    if not heading:
        raise ValueError(f"CHANGELOG.md has no section for {version}")
    body = rest.partition("\n")[2]
    return re.split(r"^## ", body, maxsplit=1, flags=re.MULTILINE)[0].strip() + "\n"


def main() -> int:
    """Check and print; return 0, or 1 if something does not agree."""
    parser = argparse.ArgumentParser(prog="python -m tools.release", description=__doc__)
    parser.add_argument("tag", help="tag to release, as v0.4.0")
    tag = parser.parse_args().tag
    found = problems(ROOT, tag)
    for problem in found:
        print(f"release: {problem}", file=sys.stderr)
    if found:
        return 1
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    print(notes(changelog, version_of(ROOT)), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
