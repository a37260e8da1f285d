"""List of the rules of the limit on the page of the safety argument, from their docstrings."""

from __future__ import annotations

import inspect
import sys
import textwrap
from pathlib import Path

from nav_adapter.rules import RULES

PAGE = Path(__file__).parents[2] / "docs" / "safety.md"
_END = "<!-- rules end -->"


def rules_list() -> str:
    """Return the rules as a list in Markdown, each with the paragraphs before its attributes."""
    items = []
    for rule in RULES:
        text = inspect.cleandoc(rule.__doc__ or "").partition("\n\nAttributes:")[0]
        told = " ".join(text.replace("``", "`").split())
        items.append(
            textwrap.fill(
                f"- **`{rule.name}`** {told}", 100, subsequent_indent="  ", break_on_hyphens=False
            )
        )
    return "\n".join(items) + "\n"


def with_rules(page: str) -> str:
    """Return the text of the page with the list between its two marks."""
    before, start, rest = page.partition("<!-- rules: ")
    mark, line, _ = rest.partition("\n")
    return f"{before}{start}{mark}{line}\n{rules_list()}\n{_END}{page.partition(_END)[2]}"


def main() -> int:
    """Write the list into the page."""
    PAGE.write_text(with_rules(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
