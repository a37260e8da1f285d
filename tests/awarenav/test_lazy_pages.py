"""Pages whose names are imported on first use: their three lists of names agree."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest
from paths import ROOT

from awarenav.errors import MissingExtraError

PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
PAGES = sorted(
    path
    for package in PACKAGES
    for path in (ROOT / package).rglob("__init__.py")
    if "lazy_names(" in path.read_text("utf-8")
)


def module_of(path: Path) -> str:
    return ".".join(path.parent.relative_to(ROOT).parts)


def imports(body: list[ast.stmt]) -> dict[str, str]:
    """Return the names that statements import, each with its module as written."""
    return {
        alias.asname or alias.name: "." * node.level + (node.module or "")
        for node in body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def for_type_checkers(tree: ast.Module) -> dict[str, str]:
    (block,) = (
        node.body
        for node in tree.body
        if isinstance(node, ast.If)
        and isinstance(node.test, ast.Name)
        and node.test.id == "TYPE_CHECKING"
    )
    return imports(block)


def table(tree: ast.Module) -> dict[str, str]:
    """Return the table that ``lazy_names`` gets, by name."""
    (call,) = (
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "lazy_names"
    )
    homes = ast.literal_eval(call.args[1])
    names = [name for each in homes.values() for name in each]
    assert len(names) == len(set(names))
    return {name: home for home, each in homes.items() for name in each}


def test_there_are_lazy_pages():
    assert len(PAGES) >= 10


@pytest.mark.parametrize("path", PAGES, ids=module_of)
def test_the_lists_of_a_lazy_page_agree(path):
    tree = ast.parse(path.read_text("utf-8"))
    lazy = table(tree)
    assert for_type_checkers(tree) == lazy
    page = importlib.import_module(module_of(path))
    eager = set(imports(tree.body)) & set(page.__all__)
    assert set(page.__all__) == set(lazy) | eager
    assert not eager & set(lazy)
    assert len(page.__all__) == len(set(page.__all__))


@pytest.mark.parametrize("path", PAGES, ids=module_of)
def test_every_name_of_a_lazy_page_is_the_one_of_its_module(path):
    page = importlib.import_module(module_of(path))
    for name, home in table(ast.parse(path.read_text("utf-8"))).items():
        try:
            module = importlib.import_module(home, page.__name__)
        except MissingExtraError:
            with pytest.raises(MissingExtraError):
                getattr(page, name)
            continue
        assert getattr(page, name) is getattr(module, name)


@pytest.mark.parametrize("path", PAGES, ids=module_of)
def test_a_name_that_is_not_on_a_lazy_page_is_refused(path):
    page = importlib.import_module(module_of(path))
    with pytest.raises(AttributeError, match=rf"module '{page.__name__}' has no attribute 'Nope'"):
        _ = page.Nope
