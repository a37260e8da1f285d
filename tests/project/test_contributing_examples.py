"""Every example of CONTRIBUTING.md works: in a copy of the packages its tests and linters pass."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from paths import ROOT

from perception.named import Catalogue

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests", "examples")
#: Files that the tests of the page import.
HELPERS = (
    "tests/chromium_pipe.py",
    "tests/conftest.py",
    "tests/paths.py",
    "tests/nav_adapter/conftest.py",
    "tests/nav_adapter/nav_scenes.py",
)
#: Runs over every scenario, and so over the new one.
CATALOGUE_TEST = "tests/sim_tests/scenario/test_catalogue.py"
CATALOGUE = "perception/named/catalogue.yaml"


@dataclass(frozen=True)
class Block:
    """A fenced block whose first line is a comment with the path of a file."""

    language: str
    path: str
    text: str


def blocks() -> list[Block]:
    found = re.findall(r"^```(\w+)\n# (\S+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    return [Block(*each) for each in found]


def linked_copy(source: str | Path, target: str | Path) -> None:
    """Make a hard link, which takes no space; copy where that is not possible."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def register(page: Path, lines: str) -> None:
    """Insert the added lines of a diff: imports before ``__all__``, names at its beginning."""
    added = [line.removeprefix("+") for line in lines.splitlines()]
    text = page.read_text(encoding="utf-8")
    imports = [line for line in added if line.startswith("from ")]
    names = [line.strip() for line in added if not line.startswith("from ")]
    head, listed, rest = re.split(r"^__all__ = \[(.*?)\]\n", text, flags=re.MULTILINE | re.DOTALL)
    names += [each.strip() + "," for each in listed.split(",") if each.strip()]
    head = head.rstrip() + "\n" + "\n".join(imports) + "\n\n"
    inside = "".join(f"    {name}\n" for name in names)
    page.unlink()  # a link to the checkout's own file
    page.write_text(f"{head}__all__ = [\n{inside}]\n{rest}", encoding="utf-8")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packages with the files of the page, and what its tests need."""
    folder = tmp_path_factory.mktemp("checkout")
    unwanted = shutil.ignore_patterns("__pycache__", "*.part")
    for package in PACKAGES:
        shutil.copytree(
            ROOT / package, folder / package, ignore=unwanted, copy_function=linked_copy
        )
    shutil.copy2(ROOT / "pyproject.toml", folder)
    for helper in (*HELPERS, CATALOGUE_TEST):
        (folder / helper).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / helper, folder / helper)
    for block in blocks():
        target = folder / block.path
        if block.language == "diff":
            register(target, block.text)
        elif block.path != CATALOGUE:
            assert not target.exists(), f"{block.path} is a file of the project"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
    return folder


def run(folder: Path, *command: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *command],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=300,
        check=False,
        env=os.environ | {"PYTHONPATH": str(folder)},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_there_is_an_example_of_each_kind_with_its_test() -> None:
    paths = [block.path for block in blocks()]
    for folder in (
        "examples/planners/",
        "nav_adapter/policies/",
        "sim_tests/scenario/shipped/",
        "nav_adapter/exporters/_",
        CATALOGUE,
    ):
        assert any(path.startswith(folder) for path in paths), folder
    assert sum(path.startswith("tests/") for path in paths) == 4


@pytest.mark.slow
def test_the_tests_of_the_page_pass(copy: Path) -> None:
    """One run, since most of the time goes to imports: five of the page, one of the catalogue."""
    pytest.importorskip("pybullet", reason="two of the examples cross a hall (extra sim)")
    tests = [block.path for block in blocks() if block.path.startswith("tests/")]
    scenario = "test_shipped_scenarios_can_be_run_and_are_what_they_say[hurries_past]"
    tests.append(f"{CATALOGUE_TEST}::{scenario}")
    out = run(copy, "pytest", "-q", "-p", "no:cacheprovider", "--durations=5", *tests)
    assert re.search(r"\b6 passed", out), out


def test_the_code_of_the_page_passes_the_linters(copy: Path) -> None:
    pages = [block.path for block in blocks() if block.language == "diff"]
    run(copy, "ruff", "check", "--no-cache", "--fix", "--select", "I,RUF022", *pages)
    files = [*pages, *(block.path for block in blocks() if block.language == "py")]
    run(copy, "ruff", "check", "--no-cache", *files)
    run(copy, "ruff", "format", "--no-cache", "--check", *files)


def test_the_entry_of_a_network_is_valid_in_the_catalogue(tmp_path: Path) -> None:
    (entry,) = (block.text for block in blocks() if block.path == CATALOGUE)
    before, models, rest = (ROOT / CATALOGUE).read_text(encoding="utf-8").partition("models:\n")
    assert before
    path = tmp_path / "catalogue.yaml"
    path.write_text(models + entry + rest, encoding="utf-8")
    catalogue = Catalogue.from_yaml(path)
    assert catalogue.models[0].name == yaml.safe_load(entry)[0]["name"]
    assert len(catalogue.models) == len(Catalogue.shipped().models) + 1
