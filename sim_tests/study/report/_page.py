"""One HTML page of sections with tables and charts, which needs no other file and no network."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from awarenav.files import markdown_table, write_text

from ...world.errors import SimError, needs
from ..measures import Interval, number_text


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table.

    Attributes:
        text: what it shows.
        sort: its sort key; None sorts last. Cells of text sort by their text.
        bad: whether it is bad news.
        href: address that it links to; empty for none.
        is_command: whether it is a command to copy.
    """

    text: str
    sort: float | None = None
    bad: bool = False
    href: str = ""
    is_command: bool = False


#: A row of a table: cells, or texts.
Row = Sequence[Cell | str]


@dataclass(frozen=True, slots=True)
class Table:
    """A table whose columns sort, by heading and meaning; the first ``text_columns`` hold text."""

    columns: Mapping[str, str]
    rows: Sequence[Row]
    text_columns: int = 1
    caption: str = ""

    @property
    def cells(self) -> list[list[Cell]]:
        """The rows as cells."""
        return [
            [Cell(each) if isinstance(each, str) else each for each in row] for row in self.rows
        ]

    def values(self) -> list[dict[str, float | str]]:
        """Return the rows as values by column: numbers where cells have one, else texts."""
        return [
            {
                name: cell.text if cell.sort is None else cell.sort
                for name, cell in zip(self.columns, row, strict=True)
            }
            for row in self.cells
        ]

    def markdown(self) -> str:
        """Return the table as Markdown."""
        return markdown_table(list(self.columns), [[c.text for c in row] for row in self.cells])


@dataclass(frozen=True, slots=True)
class Still:
    """An episode with its pictures."""

    title: str
    text: str
    command: str
    pictures: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a page; its parts are shown in the order of the attributes."""

    anchor: str
    title: str
    lead: str = ""
    charts: Sequence[tuple[str, str]] = ()
    stills: Sequence[Still] = ()
    commands: Sequence[str] = ()
    tables: Sequence[Table] = ()
    texts: Sequence[tuple[str, str]] = ()
    folded: bool = False


def write_page(
    path: Path,
    title: str,
    sections: Sequence[Section],
    *,
    lead: str = "",
    verdicts: Sequence[tuple[str, str]] = (),
    notices: Sequence[str] = (),
) -> None:
    """Write a page; it appears whole or not at all, and equal content gives equal bytes.

    Raises:
        SimError: the page cannot be written, or the extra ``bench`` is missing.
    """
    with needs("a report", "jinja2"):
        from jinja2 import Environment, StrictUndefined  # noqa: PLC0415 - an optional dependency
        from markupsafe import Markup  # noqa: PLC0415
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = resources.files("sim_tests.study.report") / "page.html"
    page = environment.from_string(template.read_text("utf-8")).render(
        title=title, sections=sections, lead=lead, verdicts=verdicts, notices=notices, svg=Markup
    )
    write_text(path, page, SimError)


def number_cell(value: float | None, decimals: int = 2, *, bad: bool = False) -> Cell:
    """Return the cell of a number; a dash for None, NaN and infinity."""
    known = value is not None and math.isfinite(value)
    return Cell(number_text(value, decimals), value if known else None, bad and known)


def interval_cell(interval: Interval, decimals: int = 2, scale: float = 1.0) -> Cell:
    """Return the cell of an estimate with its 95 % interval; ``scale`` 100 is per cent."""
    return Cell(interval.text(decimals, scale), interval.value if interval.known else None)


def share_cell(share: Interval, *, bad_from: float = math.inf) -> Cell:
    """Return the cell of a share of episodes; at least ``bad_from`` is bad news."""
    value = share.value if share.n else None
    return Cell(share.share_text(), value, value is not None and value >= bad_from)
