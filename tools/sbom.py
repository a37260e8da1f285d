"""Command ``python -m tools.sbom``: write awarenav.spdx.json, the packages of requirements.lock.

The file is SPDX 2.3 in JSON. The same lock, changelog and metadata give the same bytes. Licences
are those that the installed packages state. A package of another Python or system is not installed
here: the licence that the file already has for the same version is kept. ``--also DIR`` reads more
metadata, from what ``pip install --target DIR`` has installed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OUT = "awarenav.spdx.json"
_UNKNOWN = "NOASSERTION"
_AWARENAV = "SPDXRef-awarenav"
#: What packages write under "License", by their SPDX identifier.
_TEXTS = {
    "MIT": ("MIT", "MIT License"),
    "Apache-2.0": ("Apache 2.0", "Apache-2.0"),
    "BSD-2-Clause": ("BSD 2-Clause License", "BSD-2-Clause"),
    "BSD-3-Clause": ("3-Clause BSD License", "BSD 3-Clause License", "BSD-3-Clause"),
    "EPL-2.0 AND BSD-3-Clause": ("EPL-2.0, BSD-3-Clause",),
    "LGPL-3.0-or-later": ("GNU Lesser General Public License v3 or later (LGPLv3+)",),
    "LGPL-3.0-only": ("GNU Lesser General Public License version 3",),
    "MPL-2.0 AND MIT": ("MPL-2.0 AND MIT",),
    "Zlib": ("zlib",),
}
#: Classifiers that name one licence. "BSD License" and the like name a family.
_CLASSIFIERS = {
    "MIT License": "MIT",
    "Apache Software License": "Apache-2.0",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "zlib/libpng License": "Zlib",
}


@dataclass(frozen=True)
class Pin:
    """A line of the lock: one version of a package, and where it is installed.

    Attributes:
        name, version: of the package.
        marker: condition of PEP 508; empty for everywhere.
        via: names of the packages that need it.
    """

    name: str
    version: str
    marker: str
    via: tuple[str, ...]

    @property
    def spdx_id(self) -> str:
        """Identifier within the document."""
        return re.sub(r"[^A-Za-z0-9.-]", "-", f"SPDXRef-{self.name}-{self.version}")


def read_lock(text: str) -> tuple[Pin, ...]:
    """Return the pins of a lock that uv wrote.

    Raises:
        ValueError: for a line that is neither a comment nor an exact version.
    """
    pins: list[Pin] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if found := re.fullmatch(r"([a-z0-9-]+)==([\w.+!]+)(?: ; (.+))?", line):
            pins.append(Pin(found[1], found[2], found[3] or "", ()))
        elif found := re.fullmatch(r"    # (?:via|  )\s*([\w-]+)?(?: \(pyproject\.toml\))?", line):
            last = pins[-1]
            via = (*last.via, *filter(None, [found[1]]))
            pins[-1] = Pin(last.name, last.version, last.marker, via)
        elif line and not line.startswith("#"):
            raise ValueError(f"line {number} of the lock must be NAME==VERSION, got {line!r}")
    return tuple(pins)


def licence_of(found: metadata.Distribution) -> tuple[str, str]:
    """Return the SPDX expression that a package states, and what it says where that is unclear."""
    stated = {key: found.metadata.get(key) for key in ("License-Expression", "License")}
    if stated["License-Expression"]:
        return stated["License-Expression"], ""
    # Some packages give the whole text, which begins with its name.
    text = (stated["License"] or "").strip().partition("\n")[0].strip()
    for identifier, texts in _TEXTS.items():
        if text in texts:
            return identifier, ""
    classifiers = [
        line.rpartition(" :: ")[2]
        for line in found.metadata.get_all("Classifier", [])
        if line.startswith("License :: ") and not line.endswith("OSI Approved")
    ]
    if len(classifiers) == 1 and classifiers[0] in _CLASSIFIERS:
        return _CLASSIFIERS[classifiers[0]], ""
    unclear = "; ".join(classifiers) or text or "nothing"
    return _UNKNOWN, f"The package states: {unclear}"


def installed_licences(folders: Iterable[Path] = ()) -> dict[tuple[str, str], tuple[str, str]]:
    """Return the licences of all installed packages, and of those in ``folders``, by version."""
    found = list(metadata.distributions())
    for folder in folders:
        found += metadata.distributions(path=[str(folder)])
    return {
        (re.sub(r"[-_.]+", "-", each.metadata["Name"]).lower(), each.version): licence_of(each)
        for each in found
    }


def licences_in(document: Mapping[str, Any]) -> dict[tuple[str, str], tuple[str, str]]:
    """Return the licences that a document already has, by name and version."""
    return {
        (each["name"], each["versionInfo"]): (
            each["licenseDeclared"],
            each.get("licenseComments", ""),
        )
        for each in document.get("packages", [])
    }


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


def document_of(
    lock: str,
    version: str,
    date: str,
    licences: Mapping[tuple[str, str], tuple[str, str]],
) -> dict[str, Any]:
    """Return the SPDX document for a lock."""
    pins = read_lock(lock)
    by_name: dict[str, list[Pin]] = {}
    for pin in pins:
        by_name.setdefault(pin.name, []).append(pin)
    packages = [_package("awarenav", version, _AWARENAV, ("Apache-2.0", ""))]
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", _AWARENAV)]
    for pin in pins:
        licence = licences.get((pin.name, pin.version), (_UNKNOWN, "Not installed anywhere yet"))
        packages.append(_package(pin.name, pin.version, pin.spdx_id, licence, pin.marker))
        for need in pin.via:
            users = [user.spdx_id for user in by_name.get(need, [])]
            for user in [_AWARENAV] if need == "awarenav" else users:
                relations.append((user, "DEPENDS_ON", pin.spdx_id))
    digest = hashlib.sha256(lock.encode()).hexdigest()[:16]
    return {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"awarenav-{version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/awarenav-{version}-{digest}",
        "creationInfo": {
            "created": f"{date}T00:00:00Z",
            "creators": ["Organization: The awarenav maintainers", "Tool: tools.sbom"],
        },
        "comment": "The packages of requirements.lock: those of the extra dev, with which this "
        "version is developed and tested, on every supported Python and system.",
        "packages": packages,
        "relationships": [
            {"spdxElementId": start, "relationshipType": kind, "relatedSpdxElement": end}
            for start, kind, end in relations
        ],
    }


def _package(
    name: str, version: str, spdx_id: str, licence: tuple[str, str], marker: str = ""
) -> dict[str, Any]:
    declared, comment = licence
    package: dict[str, Any] = {
        "SPDXID": spdx_id,
        "name": name,
        "versionInfo": version,
        "downloadLocation": _UNKNOWN,
        "filesAnalyzed": False,
        "licenseConcluded": _UNKNOWN,
        "licenseDeclared": declared,
        "copyrightText": _UNKNOWN,
        "externalRefs": [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": f"pkg:pypi/{name}@{version}",
            }
        ],
    }
    if comment:
        package["licenseComments"] = comment
    if marker:
        package["comment"] = f"Installed where: {marker}"
    return package


def sbom_of(root: Path, folders: Iterable[Path] = ()) -> str:
    """Return the content of awarenav.spdx.json for the lock and version of a checkout.

    Raises:
        ValueError: as :func:`read_lock` and :func:`release_date`.
    """
    version = re.findall(
        r'^__version__ = "(.+)"$',
        (root / "awarenav/__init__.py").read_text(encoding="utf-8"),
        re.MULTILINE,
    )[0]
    present = root / OUT
    known = {}
    if present.exists():
        known = licences_in(json.loads(present.read_text(encoding="utf-8")))
    document = document_of(
        (root / "requirements.lock").read_text(encoding="utf-8"),
        version,
        release_date((root / "CHANGELOG.md").read_text(encoding="utf-8"), version),
        known | installed_licences(folders),
    )
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def main() -> int:
    """Write or compare the file; return 0, 1 if it is out of date, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m tools.sbom", description=__doc__)
    parser.add_argument("--check", action="store_true", help="only say whether the file is current")
    parser.add_argument(
        "--also",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="read licences of packages in this folder, too; may be given more than once",
    )
    options = parser.parse_args()
    path = ROOT / OUT
    try:
        text = sbom_of(ROOT, options.also)
    except ValueError as error:
        print(f"sbom: {error}", file=sys.stderr)
        return 2
    if options.check:
        current = path.exists() and path.read_text(encoding="utf-8") == text
        if not current:
            print(f"sbom: {OUT} is out of date: run python -m tools.sbom", file=sys.stderr)
        return 0 if current else 1
    path.write_text(text, encoding="utf-8")
    unknown = text.count(f'"licenseDeclared": "{_UNKNOWN}"')
    print(f"{OUT}: {text.count('pkg:pypi/')} packages, {unknown} without a clear licence")
    return 0


if __name__ == "__main__":
    sys.exit(main())
