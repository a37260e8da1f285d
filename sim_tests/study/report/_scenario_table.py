"""Section of a report: a table with one row per scenario and the arms as columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from perception.documents import parse_yaml

from ...world.errors import SimError
from ..measures import Comparison, EpisodeRecord, Metric, SummaryRow, measured_part
from ..runs import Job
from ._arm import Arm, judged_arms
from ._statistics import MARGIN, TIME_LOST, VIOLATION, RunStatistics, estimate
from ._text import NOTHING, count, number, percent


@dataclass(frozen=True, slots=True)
class TableCell:
    """A cell: its sort key (None last), its text and its CSS classes."""

    sort: float | None
    text: str
    classes: str = ""


@dataclass(frozen=True, slots=True)
class ColumnGroup:
    """The columns of one metric.

    Attributes:
        title: heading of the group.
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
        name: name, with the version from 2 on.
        attention: the scenario's ``attention``, and in how many episodes its people were not so.
        episodes: number of episodes of all arms.
        contacts: contacts with the moving robot, by arm.
        cells: cells in the columns of all groups.
    """

    name: str
    attention: str
    episodes: int
    contacts: TableCell
    cells: tuple[TableCell, ...]


@dataclass(frozen=True, slots=True)
class ScenarioTable:
    """The table: its groups of columns and its rows."""

    groups: tuple[ColumnGroup, ...]
    rows: tuple[ScenarioRow, ...]


def scenario_table(statistics: RunStatistics) -> ScenarioTable:
    """Return the table of scenarios."""
    arms = statistics.shown
    compared = [arm for arm in judged_arms(arms) if statistics.against(arm) is not None]
    groups = [
        _group("Time lost, s", "mean over the empty hall", arms),
        *([_group("Won back", "of what the reference loses", compared)] if compared else []),
        _group("Margin violated, s", "mean an episode", arms),
        _group("Smallest margin, m", "the worst episode", arms),
    ]
    attention = _attentions(each.record for arm in arms for each in arm.episodes)
    rows = []
    for scenario in sorted(attention):
        found = [statistics.by_scenario(arm, scenario) for arm in arms]
        cells = [
            *(_mean_cell(row, TIME_LOST, 1) for row in found),
            *(_won_back_cell(statistics.against(arm, scenario, scenario=True)) for arm in compared),
            *(_mean_cell(row, VIOLATION, 2) for row in found),
            *(_worst_cell(row, MARGIN, 2) for row in found),
        ]
        episodes = sum(row.episodes for row in found if row is not None)
        contacts = _contacts_cell([(arm.name, row) for arm, row in zip(arms, found, strict=True)])
        rows.append(
            ScenarioRow(
                scenario, attention[scenario], episodes, contacts, _with_rules(cells, groups)
            )
        )
    return ScenarioTable(tuple(groups), tuple(rows))


def recorded_people(jobs: Iterable[Job]) -> tuple[str, ...]:
    """Return a sentence about each scenario of recorded people: whether they react to the robot."""
    notes: dict[str, str] = {}
    for text in dict.fromkeys(job.scenario for job in jobs):
        try:
            data = parse_yaml(text, "scenario", SimError)
        except SimError:
            continue
        if isinstance(data, dict) and data.get("replay_csv"):
            does = (
                "leave their paths where the robot forces them off, and return"
                if data.get("replay_reacts")
                else "do not react to the robot"
            )
            name = str(data.get("name", ""))
            notes[name] = f"The recorded people of {name} {does}."
    return tuple(notes[name] for name in sorted(notes))


def _attentions(records: Iterable[EpisodeRecord]) -> dict[str, str]:
    """Return the attention of each scenario, and in how many episodes it was not measured so."""
    parts: dict[str, list[str]] = {}
    labels: dict[str, str] = {}
    for record in records:
        parts.setdefault(record.versioned_scenario, []).append(measured_part(record))
        labels[record.versioned_scenario] = record.attention
    return {
        scenario: f"{label}, {count(others)} of {count(len(parts[scenario]))} not"
        if (others := sum(part != label for part in parts[scenario]))
        else label
        for scenario, label in labels.items()
    }


def _group(title: str, meaning: str, arms: Sequence[Arm]) -> ColumnGroup:
    return ColumnGroup(title, meaning, tuple((arm.look, arm.name) for arm in arms))


def _contacts_cell(rows: Sequence[tuple[str, SummaryRow | None]]) -> TableCell:
    """Return the cell of the contacts with the moving robot, by arm."""
    hits = {
        name: round(row.moving_contact.value * row.moving_contact.n)
        for name, row in rows
        if row is not None and row.moving_contact.n
    }
    total = sum(hits.values())
    if not total:
        return TableCell(0, "0")
    return TableCell(total, ", ".join(f"{name} {count(n)}" for name, n in hits.items() if n), "bad")


def _mean_cell(row: SummaryRow | None, metric: Metric, decimals: int) -> TableCell:
    mean = estimate(row, metric)
    return _number_cell(mean.value if mean.known else None, decimals)


def _worst_cell(row: SummaryRow | None, metric: Metric, decimals: int) -> TableCell:
    return _number_cell(None if row is None else row.worst.get(metric.name), decimals)


def _won_back_cell(against: Comparison | None) -> TableCell:
    if against is None or not against.won_back.known:
        return TableCell(None, NOTHING)
    return TableCell(round(against.won_back.value, 6), percent(against.won_back.value, 0))


def _number_cell(value: float | None, decimals: int) -> TableCell:
    return TableCell(None if value is None else round(value, 6), number(value, decimals))


def _with_rules(cells: Sequence[TableCell], groups: Sequence[ColumnGroup]) -> tuple[TableCell, ...]:
    """Return the cells, marked where a group begins."""
    firsts = {sum(len(group.columns) for group in groups[:i]) for i in range(len(groups))}
    return tuple(
        replace(cell, classes=f"{cell.classes} first".strip()) if place in firsts else cell
        for place, cell in enumerate(cells)
    )
