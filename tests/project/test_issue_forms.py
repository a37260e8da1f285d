"""Templates of issues and pull requests: valid forms, and files that they name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import ROOT

FOLDER = ROOT / ".github" / "ISSUE_TEMPLATE"
FORMS = sorted(path for path in FOLDER.glob("*.yml") if path.name != "config.yml")
KINDS = {"markdown", "textarea", "input", "dropdown", "checkboxes"}


def form(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def test_there_is_a_form_for_a_fault_a_proposal_and_a_robot() -> None:
    assert [path.stem for path in FORMS] == ["bug", "proposal", "robot_report"]
    assert form(FOLDER / "config.yml") == {"blank_issues_enabled": False}


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_a_form_is_valid(path: Path) -> None:
    content = form(path)
    assert set(content) == {"name", "description", "labels", "body"}
    fields = [each for each in content["body"] if each["type"] != "markdown"]
    identifiers = [each["id"] for each in fields]
    assert len(set(identifiers)) == len(identifiers)
    assert all(re.fullmatch(r"[a-z_]+", each) for each in identifiers)
    for each in content["body"]:
        assert each["type"] in KINDS
        attributes = each["attributes"]
        if each["type"] == "markdown":
            assert attributes["value"]
            continue
        assert attributes["label"]
        if each["type"] == "dropdown":
            assert len(set(attributes["options"])) == len(attributes["options"]) > 1
    assert any(each.get("validations", {}).get("required") for each in fields)


def test_a_report_from_a_robot_asks_for_what_doctor_prints() -> None:
    for name in ("bug", "robot_report"):
        labels = [
            each["attributes"].get("label", "") for each in form(FOLDER / f"{name}.yml")["body"]
        ]
        assert any("`awarenav doctor`" in label for label in labels)


def test_files_that_the_templates_name_exist() -> None:
    texts = [path.read_text(encoding="utf-8") for path in FOLDER.parent.rglob("*TEMPLATE*/*.yml")]
    texts.append((ROOT / ".github/PULL_REQUEST_TEMPLATE.md").read_text(encoding="utf-8"))
    names = set(
        re.findall(r"\b((?:docs/|tests/)?[\w/]+\.(?:md|lock|spdx\.json))\b", " ".join(texts))
    )
    assert {"CONTRIBUTING.md", "SECURITY.md", "docs/safety.md"} <= names
    assert all((ROOT / name).is_file() for name in names)
