"""A row a scenario, the arms side by side under each measure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..measures import Comparison, EpisodeRecord, SummaryRow
from ._arm import Arm, judged
from ._figures import Figures, estimate
from ._measure import MARGIN, TIME_LOST, VIOLATION, Measure
from ._text import NOTHING, count, number, percent


@dataclass(frozen=True, slots=True)
class TableCell:
    """A number: what it is sorted by (None last), how it is written, and its style's classes."""

    sort: float | None
    text: str
    classes: str = ""


@dataclass(frozen=True, slots=True)
class ColumnGroup:
    """A measure over several columns.

    Attributes:
        title: of the group.
        meaning: what the numbers are.
        columns: look and name of the arm of each column.
    """

    title: str
    meaning: str
    columns: tuple[tuple[int, str], ...]


@dataclass(frozen=True, slots=True)
class ScenarioRow:
    """One scenario.

    Attributes:
        name: and version.
        attention: what its people look at.
        episodes: of all arms.
        contacts: caused by the robot, of all arms.
        cells: the columns of the groups.
    """

    name: str
    attention: str
    episodes: int
    contacts: TableCell
    cells: tuple[TableCell, ...]


@dataclass(frozen=True, slots=True)
class ScenarioTable:
    """The table; cells of a row run through the columns of all groups."""

    groups: tuple[ColumnGroup, ...]
    rows: tuple[ScenarioRow, ...]


def tabulate(figures: Figures) -> ScenarioTable:
    """Draw up the table."""
    arms = figures.shown
    winners = [arm for arm in judged(arms) if figures.against(arm) is not None]
    groups = [
        _group("Time lost, s", "mean over the empty hall", arms),
        *([_group("Won back", "of what the reference loses", winners)] if winners else []),
        _group("Margin violated, s", "mean an episode", arms),
        _group("Smallest margin, m", "the worst episode", arms),
    ]
    attention = {
        scenario_part(each.record): each.record.attention for arm in arms for each in arm.episodes
    }
    rows = []
    for part in sorted(attention):
        found = [figures.by_scenario(arm, part) for arm in arms]
        cells = [
            *(_mean(row, TIME_LOST, 1) for row in found),
            *(_won_back(figures.against(arm, part, scenario=True)) for arm in winners),
            *(_mean(row, VIOLATION, 2) for row in found),
            *(_number(None if row is None else row.worst.get(MARGIN.key), 2) for row in found),
        ]
        episodes = sum(row.episodes for row in found if row is not None)
        contacts = _contacts([(arm.name, row) for arm, row in zip(arms, found, strict=True)])
        rows.append(ScenarioRow(part, attention[part], episodes, contacts, _ruled(cells, groups)))
    return ScenarioTable(tuple(groups), tuple(rows))


def scenario_part(record: EpisodeRecord) -> str:
    """A scenario as the summary names it."""
    version = "" if record.scenario_version == 1 else f" v{record.scenario_version}"
    return record.scenario + version


def _group(title: str, meaning: str, arms: Sequence[Arm]) -> ColumnGroup:
    return ColumnGroup(title, meaning, tuple((arm.look, arm.name) for arm in arms))


def _contacts(rows: Sequence[tuple[str, SummaryRow | None]]) -> TableCell:
    """How many episodes of which arms had a contact that the robot caused."""
    hits = {
        name: round(row.robot_contact.value * row.robot_contact.n)
        for name, row in rows
        if row is not None and row.robot_contact.n
    }
    total = sum(hits.values())
    if not total:
        return TableCell(0, "0")
    return TableCell(total, ", ".join(f"{name} {count(n)}" for name, n in hits.items() if n), "bad")


def _mean(row: SummaryRow | None, measure: Measure, decimals: int) -> TableCell:
    mean = estimate(row, measure)
    return _number(mean.value if mean.known else None, decimals)


def _won_back(against: Comparison | None) -> TableCell:
    if against is None or not against.won_back.known:
        return TableCell(None, NOTHING)
    return TableCell(round(against.won_back.value, 6), percent(against.won_back.value, 0))


def _number(value: float | None, decimals: int) -> TableCell:
    return TableCell(None if value is None else round(value, 6), number(value, decimals))


def _ruled(cells: Sequence[TableCell], groups: Sequence[ColumnGroup]) -> tuple[TableCell, ...]:
    """The cells with a rule before each group."""
    firsts = {sum(len(group.columns) for group in groups[:i]) for i in range(len(groups))}
    return tuple(
        replace(cell, classes=f"{cell.classes} first".strip()) if place in firsts else cell
        for place, cell in enumerate(cells)
    )
