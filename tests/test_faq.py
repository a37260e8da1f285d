"""The error messages that the FAQ quotes are messages of the code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache

import pytest
from paths import ROOT

PACKAGES = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests")
TEXT = (ROOT / "docs" / "faq.md").read_text("utf-8")
#: Messages: bold code at the start of a paragraph.
QUOTED = re.findall(r"^\*\*`([^`]+(?:`{1}[^`*]+`{1}[^`]*)*)`\*\*", TEXT, re.MULTILINE)
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
