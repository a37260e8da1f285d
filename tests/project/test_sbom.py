"""awarenav.spdx.json: current with the lock, valid SPDX 2.3, licences as packages state them."""

from __future__ import annotations

import json
import re
import shutil
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from packaging.licenses import canonicalize_license_expression
from paths import ROOT

from tools import sbom

LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return json.loads((ROOT / sbom.OUT).read_text(encoding="utf-8"))


def checkout(folder: Path, **changes: str) -> Path:
    """The files that the command reads, some of them changed."""
    (folder / "awarenav").mkdir()
    for name in ("awarenav/__init__.py", "CHANGELOG.md", "requirements.lock", sbom.OUT):
        shutil.copy2(ROOT / name, folder / name)
    for name, text in changes.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_the_file_is_that_of_the_lock() -> None:
    """After `make lock`: python -m tools.sbom."""
    assert (ROOT / sbom.OUT).read_text(encoding="utf-8") == sbom.sbom_of(ROOT)


def test_every_pin_is_a_package_with_its_address(document: dict[str, Any]) -> None:
    pinned = re.findall(r"^(\S+)==(\S+)", LOCK, re.MULTILINE)
    assert len(pinned) > 100
    packages = document["packages"][1:]
    assert [(each["name"], each["versionInfo"]) for each in packages] == pinned
    for each in packages:
        (reference,) = each["externalRefs"]
        assert reference["referenceLocator"] == f"pkg:pypi/{each['name']}@{each['versionInfo']}"


def test_it_is_valid_spdx(document: dict[str, Any]) -> None:
    """Clauses 6, 7 and 11 of SPDX 2.3: required fields, identifiers, references, expressions."""
    assert document["spdxVersion"] == "SPDX-2.3"
    assert document["dataLicense"] == "CC0-1.0"
    assert document["SPDXID"] == "SPDXRef-DOCUMENT"
    assert re.fullmatch(r"https://[^\s#]+", document["documentNamespace"])
    created = document["creationInfo"]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", created["created"])
    assert all(re.match(r"(Organization|Tool|Person): \S", each) for each in created["creators"])
    identifiers = [each["SPDXID"] for each in document["packages"]]
    assert len(set(identifiers)) == len(identifiers)
    for each in document["packages"]:
        assert re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", each["SPDXID"])
        assert {"name", "downloadLocation", "filesAnalyzed"} <= set(each)
        declared = each["licenseDeclared"]
        if declared == "NOASSERTION":
            assert each["licenseComments"]
        else:
            assert canonicalize_license_expression(declared) == declared
    known = {"SPDXRef-DOCUMENT", *identifiers}
    for each in document["relationships"]:
        assert {each["spdxElementId"], each["relatedSpdxElement"]} <= known
    described = [
        each["relatedSpdxElement"]
        for each in document["relationships"]
        if each["relationshipType"] == "DESCRIBES"
    ]
    assert described == ["SPDXRef-awarenav"]


def test_every_package_is_needed_by_another(document: dict[str, Any]) -> None:
    needed = {
        each["relatedSpdxElement"]
        for each in document["relationships"]
        if each["relationshipType"] == "DEPENDS_ON"
    }
    assert needed == {each["SPDXID"] for each in document["packages"][1:]}
    direct = {
        each["relatedSpdxElement"]
        for each in document["relationships"]
        if each["spdxElementId"] == "SPDXRef-awarenav"
    }
    assert any(each.startswith("SPDXRef-numpy-") for each in direct)
    assert not any(each.startswith("SPDXRef-alembic-") for each in direct)


def test_licences_are_those_that_installed_packages_state(document: dict[str, Any]) -> None:
    by_name = {each["name"]: each["licenseDeclared"] for each in document["packages"]}
    assert by_name["awarenav"] == "Apache-2.0"
    assert by_name["pydantic"] == metadata.metadata("pydantic")["License-Expression"]
    assert by_name["casadi"] == "LGPL-3.0-or-later"
    # A family of licences is not one.
    assert by_name["jinja2"] == "NOASSERTION"


def test_a_changed_lock_makes_another_document(tmp_path: Path) -> None:
    changed = re.sub(r"^click==\S+", "click==99.0", LOCK, flags=re.MULTILINE)
    text = sbom.sbom_of(checkout(tmp_path, **{"requirements.lock": changed}))
    assert text != (ROOT / sbom.OUT).read_text(encoding="utf-8")
    document = json.loads(text)
    (click,) = (each for each in document["packages"] if each["name"] == "click")
    assert click["versionInfo"] == "99.0"
    assert click["licenseDeclared"] == "NOASSERTION"
    before = json.loads((ROOT / sbom.OUT).read_text(encoding="utf-8"))
    assert document["documentNamespace"] != before["documentNamespace"]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("requirements.lock", "numpy>=1.0\n", "line 1 of the lock must be NAME==VERSION"),
        ("CHANGELOG.md", "## [Unreleased]\n", "CHANGELOG.md must have a section"),
    ],
)
def test_bad_input_is_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        sbom.sbom_of(checkout(tmp_path, **{name: text}))
