"""Links, paths, imports, command lines and quoted messages in the documentation exist."""

from __future__ import annotations

import ast
import contextlib
import importlib
import io
import re
from collections.abc import Iterator
from functools import cache

import pytest
from paths import ROOT

from awarenav.cli import main

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in (
        "*.md",
        "docs/*.md",
        "docs/tutorials/*.md",
        "benchmarks/*/*.md",
        "training/*/*.md",
    )
    for path in ROOT.glob(pattern)
)
#: The changelog names modules that are gone.
PRESENT = [page for page in PAGES if page != "CHANGELOG.md"]
PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
FOLDERS = (*PACKAGES, "benchmarks", "docs", "examples", "tests", "tools", "training")
#: Pages that the site generates (tools/docs_site/hooks.py), for links from docs/.
GENERATED = {ROOT / "docs" / name for name in ("gallery.md", "metrics.md")}
MAX_COLUMNS = 100


@cache
def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


@cache
def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text_of(page), re.MULTILINE | re.DOTALL)


def prose(page: str) -> str:
    """The page without fenced code."""
    return re.sub(r"^```.*?^```", "", text_of(page), flags=re.MULTILINE | re.DOTALL)


@cache
def anchors(page: str) -> set[str]:
    """The anchors that GitHub gives to the page's headings."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in headings}


def command_lines(page: str) -> Iterator[list[str]]:
    """The words after ``awarenav`` of every command line that the page shows."""
    code = text_of(page).replace("\\\n", " ")
    shown = re.findall(r"^(?: {4}|)(?:python -m )?awarenav (.*)$", code, re.MULTILINE)
    shown += re.findall(r"`awarenav ([^`]*)`", prose(page))
    for line in shown:
        words = re.sub(r"\s#.*", "", line).split()
        if words and re.fullmatch(r"[a-z]+", words[0]):
            yield words


@cache
def help_text(*command: str) -> str | None:
    """The help of a command; None where there is no such command."""
    assert all(re.fullmatch("[a-z]+(-[a-z]+)*", word) for word in command)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        status = main([*command, "--help"])
    return printed.getvalue() if status == 0 else None


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_to_a_file_and_a_heading(page: str) -> None:
    links = re.findall(r"\]\(([^)\s]+)\)|<img src=\"([^\"]+)\"", prose(page))
    for target in filter(None, (link or image for link, image in links)):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        file = ((ROOT / page).parent / path).resolve() if path else ROOT / page
        assert file.exists() or file in GENERATED, target
        if anchor and file.exists():
            there = file.resolve().relative_to(ROOT).as_posix()
            assert anchor in anchors(there), target


@pytest.mark.parametrize("page", PAGES)
def test_lines_are_short_enough_to_read_without_wrapping(page: str) -> None:
    """Tables, images and HTML cannot be wrapped."""
    lines = [line for line in text_of(page).splitlines() if not line.startswith(("|", "![", "<"))]
    assert [line for line in lines if len(line) > MAX_COLUMNS] == []


@pytest.mark.parametrize("page", PRESENT)
def test_every_path_and_module_named_exists(page: str) -> None:
    for name in re.findall(r"`((?:[\w-]+/)+[\w.-]*)`", prose(page)):
        if name.split("/")[0] in FOLDERS:
            assert list(ROOT.glob(name.replace("NAME", "*").rstrip("/"))), name
    for name in re.findall(rf"`((?:{'|'.join(PACKAGES)})(?:\.\w+)+)", prose(page)):
        assert resolves(name), name


@pytest.mark.parametrize("page", [page for page in PRESENT if blocks(page, "python")])
def test_python_shown_imports_names_that_exist(page: str) -> None:
    for block in blocks(page, "python"):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom):
                assert node.module is not None
                if f"`{node.module}.py`" in text_of(page):  # the reader saves it
                    continue
                package = node.module.partition(".")[0].replace("_", "-")
                if f"pip install {package}" in text_of(page):  # the reader installs it
                    continue
                for alias in node.names:
                    assert resolves(f"{node.module}.{alias.name}"), alias.name


def resolves(name: str) -> bool:
    """Say whether a dotted name is a module or an attribute of one."""
    if name.startswith("sim_tests."):
        pytest.importorskip("pybullet", reason="the page shows crossings (extra sim)")
    parts = name.split(".")
    for depth in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:depth]))
        except ModuleNotFoundError:
            continue
        for part in parts[depth:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


@pytest.mark.parametrize("page", [page for page in PRESENT if any(command_lines(page))])
def test_commands_shown_exist_with_their_options(page: str) -> None:
    for words in command_lines(page):
        line = " ".join(words)
        about = help_text(words[0])
        assert about is not None, line
        subcommands = re.findall(r"^  ([a-z-]+) ", about.partition("\nCommands:")[2], re.MULTILINE)
        if len(words) > 1 and words[1] in subcommands:
            about = help_text(*words[:2]) or ""
        for word in words:
            option = word.partition("=")[0]
            if option.startswith("--") and option != "--help":
                assert re.search(rf"{re.escape(option)}\b", about), line


def test_the_documentation_is_found() -> None:
    assert len(PAGES) >= 12
    assert sum(len(list(command_lines(page))) for page in PAGES) > 40


# --- the FAQ ------------------------------------------------------------------------------------

#: Messages: bold code at the start of a paragraph.
QUOTED = re.findall(
    r"^\*\*`([^`]+(?:`{1}[^`*]+`{1}[^`]*)*)`\*\*",
    (ROOT / "docs" / "faq.md").read_text("utf-8"),
    re.MULTILINE,
)
#: Those of other programs.
FOREIGN = {"externally-managed-environment", "No matching distribution found for awarenav"}
# A part of a message that says so much belongs to it alone.
ENOUGH = 15


def fixed_parts(node: ast.expr) -> Iterator[str]:
    """Yield the parts of a string in the code that do not depend on the case."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        for part in node.values:
            yield from fixed_parts(part)


@cache
def said_by_the_code() -> frozenset[str]:
    found = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, (ast.Constant, ast.JoinedStr)):
                    parts = [part.strip() for part in fixed_parts(node)]
                    found |= {part for part in parts if len(part) >= ENOUGH}
    return frozenset(found)


@pytest.mark.parametrize("message", [each for each in QUOTED if each not in FOREIGN])
def test_a_quoted_message_is_one_of_the_code(message: str) -> None:
    # Lines are wrapped, and a message may be cut off.
    plain = " ".join(message.split())
    pieces = [piece.strip() for piece in plain.split("…") if len(piece.strip()) >= ENOUGH]
    assert any(
        part in plain or any(piece in part for piece in pieces) for part in said_by_the_code()
    ), plain


def test_messages_are_found() -> None:
    assert len(QUOTED) > 12
    assert set(QUOTED) >= FOREIGN
