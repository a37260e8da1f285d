"""Packages whose names are imported on first use."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_page(package: str, file: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that imports its names on first use (PEP 562).

    Who needs a tracker then loads no networks, and help on the command line no simulator. The names
    and their modules are those of the imports that the page has under ``if TYPE_CHECKING``.

    Args:
        package: its ``__name__``.
        file: its ``__file__``.
    """
    module_of: dict[str, str] = {}

    def get(name: str) -> Any:
        if not module_of:
            module_of.update(_imports(Path(file)))
        if name == "__all__":  # of a page whose imports are all of its names
            return sorted(module_of)
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(module_of[name], package), name)
        setattr(sys.modules[package], name, value)
        return value

    return get


def _imports(page: Path) -> dict[str, str]:
    """Return the module of each name that a page imports for type checkers."""
    tree = ast.parse(page.read_text(encoding="utf-8"))
    return {
        alias.name: f"{'.' * statement.level}{statement.module}"
        for block in tree.body
        if isinstance(block, ast.If) and getattr(block.test, "id", "") == "TYPE_CHECKING"
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
