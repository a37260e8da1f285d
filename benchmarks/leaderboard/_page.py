"""The page of the leaderboard, made from the committed results."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sim_tests.study.measures import (
    EpisodeRecord,
    Interval,
    bootstrap_interval,
    paired_difference,
    proportion_interval,
)

from ._measure import read_about, read_results
from ._rows import RESULTS, Board, Row

_ATTENTIONS: Final = ("attentive", "mixed", "unaware")
# Violation times that agree to so many decimals of a second count as equal in the ranking.
_RANKED_DECIMALS: Final = 2

_COLUMNS: Final = ("rank, row", "contacts, moving", "violation (s)", "time lost (s)")
_MORE_COLUMNS: Final = ("row", "against today's AMR (s)", "goals; walked into", "measured")
_STEP_OUT_COLUMNS: Final = (
    "row",
    "unaware",
    "above 0.25 m/s",
    "worst (m/s)",
    "aware",
    "faster starts: unaware",
    "worst (m/s)",
)
_PARTS_COLUMNS: Final = ("row", *_ATTENTIONS)
_TEMPLATE: Final = Path(__file__).with_name("page.txt")


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """A row with its results.

    Attributes:
        row: the row.
        records: its episodes.
        planned: number of episodes that it should have.
    """

    row: Row
    records: tuple[EpisodeRecord, ...]
    planned: int

    @property
    def ran(self) -> tuple[EpisodeRecord, ...]:
        """Episodes without an error."""
        return tuple(each for each in self.records if not each.error)

    @property
    def is_complete(self) -> bool:
        """Whether every episode has a result."""
        return len(self.ran) == self.planned

    @property
    def contacts(self) -> Interval:
        """Share of episodes in which a person and the moving robot touched."""
        return proportion_interval(sum(each.moving_touched for each in self.ran), len(self.ran))

    def mean(self, field: str, attention: str = "") -> Interval:
        """Return the mean of a field with its interval, resampled within scenarios."""
        kept = [
            each
            for each in self.ran
            if getattr(each, field) is not None and attention in ("", each.attention)
        ]
        return bootstrap_interval(
            [getattr(each, field) for each in kept],
            np.random.default_rng(0),
            strata=[each.scenario for each in kept],
        )

    @property
    def rank_key(self) -> tuple[float, float, float, str]:
        """The key by which complete rows are ranked."""
        return (
            self.contacts.value,
            round(self.mean("violation_time_s").value, _RANKED_DECIMALS),
            self.mean("time_lost_s").value,
            self.row.name,
        )


def standings(board: Board, folder: Path = RESULTS) -> list[Standing]:
    """Return every row with its results, in the order of the board."""
    planned = len(board.templates) * board.seeds
    return [Standing(row, read_results(board, row, folder), planned) for row in board.rows]


def ranked(rows: Sequence[Standing]) -> list[Standing]:
    """Return the complete rows, the best first."""
    return sorted((each for each in rows if each.is_complete), key=lambda each: each.rank_key)


def leaderboard_page(board: Board, folder: Path = RESULTS) -> str:
    """Return the Markdown of the page."""
    rows = standings(board, folder)
    about = read_about(folder)
    first = ranked(rows)
    others = [each for each in rows if not each.is_complete]
    baseline = next(each for each in rows if each.row.name == board.baseline)
    ranks = {each.row.name: number for number, each in enumerate(first, start=1)}
    scenarios = len(board.templates)
    missing = [each.row.name for each in others]
    note = "Means have 95 % intervals."
    if missing:
        names = ", ".join(f"`{name}`" for name in missing)
        note += f" Not complete, and so without a rank: {names}."
    shown = [each for each in (*first, *others) if each.ran]
    # About 2.5 s of a core per episode with camera and scanners.
    minutes = max(round(scenarios * board.seeds * 2.5 / 60.0), 1)
    return _TEMPLATE.read_text(encoding="utf-8").format(
        episodes=scenarios * board.seeds,
        scenarios=scenarios,
        sets=", ".join(f"`{each}`" for each in board.scenarios),
        seeds=f"the seeds 0 to {board.seeds - 1}" if board.seeds > 1 else "the seed 0",
        table=_table(_COLUMNS, [_cells(each, ranks, baseline) for each in shown]),
        more=_table(_MORE_COLUMNS, [_more_cells(each, baseline, about) for each in shown]),
        step_out=_table(_STEP_OUT_COLUMNS, [_step_out_cells(each) for each in shown]),
        note=textwrap.fill(note, 100, break_long_words=False, break_on_hyphens=False),
        parts=_table(_PARTS_COLUMNS, [_parts_cells(each) for each in shown]),
        minutes=minutes,
    )


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [" | ".join(cells) for cells in (columns, ["---"] * len(columns), *rows)]
    return "\n".join(f"| {line} |" for line in lines)


def _cells(standing: Standing, ranks: Mapping[str, int], baseline: Standing) -> list[str]:
    """Return the cells of the ranking; a row without a rank has a dash, today's AMR is marked."""
    row, ran, contacts = standing.row, standing.ran, standing.contacts
    hits = sum(each.moving_touched for each in ran)
    rank = f"{ranks[row.name]}. " if row.name in ranks else "– "
    policy = f"**`{row.policy_name}`, today's AMR**" if standing is baseline else _policy(row)
    return [
        f"{rank}{policy}, {row.sensors}, {_planner(row)}",
        f"{hits} of {len(ran)} (≤ {100.0 * contacts.high:.1f} %)",
        standing.mean("violation_time_s").text(2),
        standing.mean("time_lost_s").text(1),
    ]


def _more_cells(
    standing: Standing, baseline: Standing, about: Mapping[str, Mapping[str, str]]
) -> list[str]:
    ran, measured = standing.ran, about.get(standing.row.name, {})
    change = paired_difference(baseline.ran, ran, "time_lost_s")
    arrived = sum(each.time_to_goal_s is not None for each in ran)
    touched = sum(each.person_touched for each in ran)
    return [
        _label(standing.row),
        "" if standing is baseline else _signed(change),
        f"{arrived} of {len(ran)}; {touched} of {len(ran)}",
        ", ".join(filter(None, (measured.get(name, "") for name in ("version", "commit", "date")))),
    ]


def _step_out_cells(standing: Standing) -> list[str]:
    def worst(field: str) -> str:
        values = [value for each in standing.ran if (value := getattr(each, field)) is not None]
        return f"{max(values):.2f}" if values else "–"

    return [
        _label(standing.row),
        standing.mean("step_out_unaware").text(1),
        standing.mean("step_out_unaware_fast").text(1),
        worst("step_out_worst_mps"),
        standing.mean("step_out_aware").text(1),
        standing.mean("step_out_stress_unaware").text(1),
        worst("step_out_stress_worst_mps"),
    ]


def _parts_cells(standing: Standing) -> list[str]:
    cells = [_label(standing.row)]
    for attention in _ATTENTIONS:
        time_s, violation_s = (
            standing.mean(field, attention) for field in ("time_lost_s", "violation_time_s")
        )
        cells.append(f"{time_s.text(1)} s, {violation_s.text(2)} s" if time_s.known else "–")
    return cells


def _label(row: Row) -> str:
    """Return a row in one cell."""
    return f"{_policy(row)}, {row.sensors}, {row.planner.rpartition(':')[2]}"


def _policy(row: Row) -> str:
    return f"`{row.policy_name}`"


def _planner(row: Row) -> str:
    """Return the planner of a row, with a link to an example."""
    module, _, name = row.planner.rpartition(":")
    if module.startswith("examples."):
        return f"[{name}](../{module.replace('.', '/')}.py)"
    return row.planner


def _signed(change: Interval) -> str:
    """Return a difference with its interval and signs."""
    if not change.known:
        return "–"
    if not change.bounded:
        return f"{change.value:+.1f} [?]"
    return f"{change.value:+.1f} [{change.low:+.1f}, {change.high:+.1f}]"
