"""Text for a terminal: its colours, and tables that fit its width."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from typing import Any, Final, TextIO

import click

_WIDTH: Final = 80
_GAP: Final = "  "


def styled(text: str, stream: TextIO | None = None, **style: Any) -> str:
    """Return a text in a style of :func:`click.style`, where a terminal shows it.

    Files and pipes get the plain text, as does everybody who has set ``NO_COLOR``
    (https://no-color.org).

    Args:
        text: the text.
        stream: where it is printed; standard output by default.
        style: such as ``bold=True`` or ``fg="red"``.
    """
    stream = sys.stdout if stream is None else stream
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    if plain or stream is None or not stream.isatty():
        return text
    return click.style(text, **style)


def table_text(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """Return aligned columns that fit the terminal, or 80 columns where there is none.

    Columns that do not fit follow below, beside the first ones again.

    Args:
        header: of each column.
        rows: cells of each row.
        left: number of the first columns, which are left-aligned; the others are right-aligned.
    """
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    room = max(shutil.get_terminal_size((_WIDTH, 24)).columns, _WIDTH)
    names = list(range(left))
    parts: list[list[int]] = [[*names]]
    for column in range(left, len(header)):
        wide = sum(widths[each] + len(_GAP) for each in [*parts[-1], column]) - len(_GAP) > room
        if wide and len(parts[-1]) > left:
            parts.append([*names])
        parts[-1].append(column)
    return "\n\n".join(_part(lines, widths, columns, left) for columns in parts)


def _part(lines: list[list[str]], widths: list[int], columns: list[int], left: int) -> str:
    """Return some columns of a table."""

    def line_text(cells: list[str]) -> str:
        aligned = [
            cells[column].ljust(widths[column])
            if column < left
            else cells[column].rjust(widths[column])
            for column in columns
        ]
        return _GAP.join(aligned).rstrip()

    rule = _GAP.join("-" * widths[column] for column in columns)
    return "\n".join([styled(line_text(lines[0]), bold=True), rule, *map(line_text, lines[1:])])
