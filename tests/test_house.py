"""The picture of the house, and the pages that name the files to read first."""

from __future__ import annotations

import re

import pytest
from paths import ROOT

from tools.house import PACKAGES, PICTURE, imports, picture, storeys


def test_the_picture_is_that_of_the_imports_and_a_module_stands_above_those() -> None:
    """After another module or import: python -m tools.house."""
    graph = imports()
    assert PICTURE.read_text(encoding="utf-8") == picture(graph)
    for package in PACKAGES:
        rows = storeys(graph, package)
        floor = {f"{package}.{name}": -number for number, row in enumerate(rows) for name in row}
        for name, level in floor.items():
            for module in graph.find_modules_directly_imported_by(name):
                assert floor.get(module, -len(rows)) < level, (name, module)


@pytest.mark.parametrize("page", ["frame", "episode"])
def test_ten_files_are_named_to_be_read_in_order_and_are_there(page: str) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    listed = re.findall(r"^(\d+)\. `([\w/]+\.py)`: \w", text, re.MULTILINE)
    assert [number for number, _ in listed] == [str(number) for number in range(1, 11)]
    assert all((ROOT / file).is_file() for _, file in listed)
