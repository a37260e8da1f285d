"""CITATION.cff and CITATION.bib: valid, of this version, and with the same paper."""

from __future__ import annotations

import re
from datetime import date
from typing import Any

import yaml
from paths import ROOT

import awarenav
from tools.sbom import release_date

CFF: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
BIB = (ROOT / "CITATION.bib").read_text(encoding="utf-8")
#: Keys of the Citation File Format 1.2.0 that the file may have.
ALLOWED = {
    *("abstract", "authors", "cff-version", "commit", "contact", "date-released", "doi"),
    *("identifiers", "keywords", "license", "license-url", "message", "preferred-citation"),
    *("references", "repository", "repository-artifact", "repository-code", "title", "type"),
    *("url", "version"),
}


def entry(name: str) -> dict[str, str]:
    """The fields of a BibTeX entry, on one line each and without braces."""
    (body,) = re.findall(rf"^@\w+\{{{name},\n(.*?)^\}}", BIB, re.MULTILINE | re.DOTALL)
    fields = re.findall(r"^  (\w+)\s*= (\{.*?\}),$", body, re.MULTILINE | re.DOTALL)
    return {key: re.sub(r"\s+", " ", re.sub(r"[{}]", "", value)) for key, value in fields}


def test_the_file_has_what_the_format_requires() -> None:
    assert {"cff-version", "message", "title", "authors"} <= set(CFF) <= ALLOWED
    assert CFF["cff-version"] == "1.2.0"
    assert CFF["type"] == "software"
    assert CFF["license"] == "Apache-2.0"
    assert len(set(CFF["keywords"])) == len(CFF["keywords"])
    for author in CFF["authors"]:
        assert set(author) == {"name"}


def test_version_and_date_are_those_of_the_release() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = release_date(changelog, awarenav.__version__)
    assert CFF["version"] == awarenav.__version__
    assert CFF["date-released"] == date.fromisoformat(released)
    software = entry("awarenav")
    assert software["version"] == awarenav.__version__
    assert software["year"] == released[:4]


def test_both_files_name_the_same_paper() -> None:
    (paper,) = CFF["references"]
    bibtex = entry("haug2025awareness")
    assert paper["title"].strip() == bibtex["title"]
    assert str(paper["year"]) == bibtex["year"]
    assert paper["conference"]["name"] == bibtex["booktitle"]
    names = [f"{each['family-names']}, {each['given-names']}" for each in paper["authors"]]
    assert " and ".join(names) == bibtex["author"]
    assert "Haug" in names[0]


def test_no_identifier_is_made_up() -> None:
    """No DOI and no ORCID is known to the project."""
    assert not re.search(r"\b(doi|orcid)\b", BIB, re.IGNORECASE)
    assert "doi" not in CFF
    assert not any("doi" in each or "orcid" in each for each in CFF["references"])
