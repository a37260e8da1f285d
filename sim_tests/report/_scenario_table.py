"""A row a scenario, the arms side by side under each measure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ._arm import Arm, judged
from ._episode import Episode
from ._estimates import plain_mean, won_back_of
from ._measure import MARGIN, TIME_LOST, VIOLATION
from ._text import NOTHING, count, number, percent


@dataclass(frozen=True, slots=True)
class Cell:
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
    """One scenario: its name, version and attention, its number of episodes, and the cells."""

    name: str
    version: int
    attention: str
    episodes: int
    cells: tuple[Cell, ...]


@dataclass(frozen=True, slots=True)
class ScenarioTable:
    """The table; cells of a row run through the columns of all groups."""

    groups: tuple[ColumnGroup, ...]
    rows: tuple[ScenarioRow, ...]


def tabulate(arms: Sequence[Arm]) -> ScenarioTable:
    """Draw up the table over the episodes without a fault."""
    arms = [arm for arm in arms if arm.episodes]
    reference = next((arm for arm in arms if arm.role == "reference"), None)
    winners = [] if reference is None else [arm for arm in judged(arms) if arm is not reference]
    groups = [
        _group("Robot contacts", "episodes in which the robot moved into a person", arms),
        _group("Time lost, s", "mean over the empty hall", arms),
        *([_group("Won back", "of what the reference loses", winners)] if winners else []),
        _group("Margin violated, s", "mean an episode", arms),
        _group("Smallest margin, m", "the worst episode", arms),
    ]
    found: dict[tuple[str, int, str], dict[str, list[Episode]]] = {}
    for arm in arms:
        for each in arm.episodes:
            record = each.record
            key = (record.scenario, record.scenario_version, record.attention)
            found.setdefault(key, {}).setdefault(arm.name, []).append(each)
    rows = []
    for (name, version, attention), parts in sorted(found.items()):
        cells = [
            *_cells(arms, parts, _contacts),
            *_cells(arms, parts, _time_lost),
            *(
                _won_back(parts.get(reference.name, []), parts.get(arm.name, []))
                for arm in winners
                if reference is not None
            ),
            *_cells(arms, parts, _violation),
            *_cells(arms, parts, _least_margin),
        ]
        total = sum(len(part) for part in parts.values())
        rows.append(ScenarioRow(name, version, attention, total, _ruled(cells, groups)))
    return ScenarioTable(tuple(groups), tuple(rows))


def _group(title: str, meaning: str, arms: Sequence[Arm]) -> ColumnGroup:
    return ColumnGroup(title, meaning, tuple((arm.look, arm.name) for arm in arms))


def _cells(
    arms: Sequence[Arm],
    parts: dict[str, list[Episode]],
    cell: Callable[[Sequence[Episode]], Cell],
) -> list[Cell]:
    return [cell(parts.get(arm.name, [])) for arm in arms]


def _contacts(episodes: Sequence[Episode]) -> Cell:
    hits = sum(each.record.robot_contacts > 0 for each in episodes)
    return Cell(hits, count(hits), "bad" if hits else "") if episodes else Cell(None, NOTHING)


def _time_lost(episodes: Sequence[Episode]) -> Cell:
    return _number(plain_mean(episodes, TIME_LOST.value), 1)


def _violation(episodes: Sequence[Episode]) -> Cell:
    return _number(plain_mean(episodes, VIOLATION.value), 2)


def _least_margin(episodes: Sequence[Episode]) -> Cell:
    known = [value for each in episodes if (value := MARGIN.value(each.record)) is not None]
    return _number(min(known) if known else None, 2)


def _won_back(reference: Sequence[Episode], episodes: Sequence[Episode]) -> Cell:
    back = won_back_of(reference, episodes)
    if not back.known:
        return Cell(None, NOTHING)
    return Cell(round(back.value, 6), percent(back.value, 0))


def _number(value: float | None, decimals: int) -> Cell:
    return Cell(None if value is None else round(value, 6), number(value, decimals))


def _ruled(cells: Sequence[Cell], groups: Sequence[ColumnGroup]) -> tuple[Cell, ...]:
    """The cells with a rule before each group."""
    firsts = {sum(len(group.columns) for group in groups[:i]) for i in range(len(groups))}
    return tuple(
        replace(cell, classes=f"{cell.classes} first".strip()) if place in firsts else cell
        for place, cell in enumerate(cells)
    )
