"""The page of the leaderboard, made from the committed results."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from sim_tests.study.measures import (
    NOTHING,
    STEP_OUT_PEOPLE,
    EpisodeRecord,
    Interval,
    bootstrap_interval,
    paired_difference,
    proportion_interval,
)
from sim_tests.study.report import Table

from ._measure import read_about, read_results
from ._rows import RESULTS, STEP_OUT, Board, Row

_ATTENTIONS: Final = ("attentive", "mixed", "unaware")
# Violation times that agree to so many decimals of a second count as equal in the ranking.
_RANKED_DECIMALS: Final = 2
#: The robots that README compares, by their rows.
ROBOTS: Final = {
    "balanced-camera+scanner": "**awarenav**",
    "blind-camera+scanner": "slow for everybody",
    "today": "today's AMR, predicts",
    "today-costmap": "today's AMR, costmap",
}
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

    def impacts(self, people: str) -> str:
        """Return the mean step-out impacts with a group of people, and the fastest one."""
        mean = self.mean(f"step_out_{people}")
        speeds = (getattr(each, f"step_out_{people}_worst_mps") for each in self.ran)
        fastest_mps = max((speed for speed in speeds if speed is not None), default=0.0)
        if mean.known and mean.value == 0.0:
            return "0"
        return f"{mean.value:.2f} ({fastest_mps:.2f} m/s)" if mean.known else NOTHING

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
    planned = len(board.all_scenarios) * board.seeds
    return [Standing(row, read_results(board, row, folder), planned) for row in board.rows]


def ranked(rows: Sequence[Standing]) -> list[Standing]:
    """Return the complete rows, the best first."""
    return sorted((each for each in rows if each.is_complete), key=lambda each: each.rank_key)


def leaderboard_page(board: Board, folder: Path = RESULTS) -> str:
    """Return the Markdown of the page."""
    rows = standings(board, folder)
    tables = leaderboard_tables(board, rows, read_about(folder))
    missing = ", ".join(f"`{each.row.name}`" for each in rows if not each.is_complete)
    note = "Means have 95 % intervals."
    if missing:
        note += f" Not complete, and so without a rank: {missing}."
    scenarios = len(board.all_scenarios)
    return _TEMPLATE.read_text(encoding="utf-8").format(
        **{name: table.markdown() for name, table in tables.items()},
        **steps_out(),
        episodes=scenarios * board.seeds,
        scenarios=scenarios,
        sets=", ".join(f"`{each}`" for each in board.scenarios),
        seeds=f"the seeds 0 to {board.seeds - 1}" if board.seeds > 1 else "the seed 0",
        note=textwrap.fill(note, 100, break_long_words=False, break_on_hyphens=False),
        # About 2.5 s of a core per episode with camera and scanners.
        minutes=max(round(scenarios * board.seeds * 2.5 / 60.0), 1),
    )


def leaderboard_tables(
    board: Board, rows: Sequence[Standing], about: Mapping[str, Mapping[str, str]]
) -> dict[str, Table]:
    """Return the tables of the page, by their names in ``page.txt``."""
    first = ranked(rows)
    baseline = next(each for each in rows if each.row.name == board.baseline)
    ranks = {each.row.name: f"{number}. " for number, each in enumerate(first, start=1)}
    shown = [each for each in (*first, *(r for r in rows if not r.is_complete)) if each.ran]

    def table(*columns: tuple[str, Callable[[Standing], str]]) -> Table:
        lines = [[cell(each) for _, cell in columns] for each in shown]
        return Table(dict.fromkeys((name for name, _ in columns), ""), lines)

    def ranking(each: Standing) -> str:
        policy = f"`{each.row.policy_name}`"
        if each is baseline:
            policy = f"**{policy}, today's AMR**"
        return f"{ranks.get(each.row.name, '– ')}{policy}, {each.row.senses}, {_planner(each.row)}"

    def against(each: Standing) -> str:
        if each is baseline:
            return ""
        return _signed(paired_difference(baseline.ran, each.ran, "time_lost_s"))

    def mean(field: str, decimals: int = 1) -> Callable[[Standing], str]:
        return lambda each: each.mean(field).text(decimals)

    return {
        **_beside_today(rows),
        "table": table(
            ("rank, row", ranking),
            ("contacts, moving", _contacts),
            ("violation (s)", mean("violation_time_s", 2)),
            ("time lost (s)", mean("time_lost_s")),
        ),
        "more": table(
            ("row", _label),
            ("against today's AMR (s)", against),
            ("goals; walked into", _goals),
            ("measured", lambda each: _measured(about.get(each.row.name, {}))),
        ),
        "step_out": table(
            ("row", _label),
            *(
                (title, partial(Standing.impacts, people=people))
                for people, (title, _) in STEP_OUT_PEOPLE.items()
            ),
            ("never noticed, above 0.25 m/s", mean("step_out_never_fast")),
            ("all, above 0.25 m/s", mean("step_out_all_fast")),
            ("never noticed, faster starts", mean("step_out_stress_never")),
        ),
        "parts": table(("row", _label), *((name, _part(name)) for name in _ATTENTIONS)),
    }


def _beside_today(rows: Sequence[Standing]) -> dict[str, Table]:
    """Return the robots of README: by the people they meet, and the time lost by scenario."""
    named = {each.row.name: each for each in rows}
    robots = {title: named[name] for name, title in ROBOTS.items() if name in named}
    lines = [
        [f"{attention or 'all'} people: time lost (s)"]
        + [each.mean("time_lost_s", attention).text(1) for each in robots.values()]
        for attention in ("", *_ATTENTIONS)
    ]
    lines += [
        [title, *map(cell, robots.values())]
        for title, cell in {
            "goals; walked into": _goals,
            "contacts, moving": _contacts,
            "violated margin, unaware people": _violated,
        }.items()
    ]
    scenarios = dict.fromkeys(record.scenario for each in rows for record in each.ran)
    by_scenario = [
        [f"`{name}`"]
        + [
            f"{np.mean([r.time_lost_s for r in each.ran if r.scenario == name]):.1f}"
            for each in robots.values()
        ]
        for name in scenarios
    ]
    columns = ("", *robots)
    return {
        "beside": Table(dict.fromkeys(columns, ""), lines),
        "by_scenario": Table(dict.fromkeys(("time lost (s)", *robots), ""), by_scenario),
    }


def _measured(about: Mapping[str, str]) -> str:
    """Return with what a row was measured, and when."""
    return ", ".join(about[name] for name in ("version", "commit", "date") if about.get(name))


def steps_out() -> dict[str, str]:
    """Return how often somebody who steps out and the moving robot touched, and how fast."""
    board = Board.read(STEP_OUT)
    robots = {each.row.name: each for each in standings(board, STEP_OUT)}
    table = Table(
        dict.fromkeys(("touched while it moved", *ROBOTS.values()), ""),
        [
            [f"`{of.name}`", *(touched(robots[name], of.name) for name in ROBOTS)]
            for of in board.all_scenarios
        ],
    )
    measured = "; ".join(dict.fromkeys(map(_measured, read_about(STEP_OUT).values())))
    return {
        "steps_out": table.markdown(),
        "step_outs": str(board.seeds),
        "step_out_rate": rate_left(board),
        "step_out_measured": textwrap.fill(f"({measured}):", 100),
    }


def rate_left(board: Board) -> str:
    """Return the true rate of touches that remains possible where a scenario had none."""
    return f"{100.0 * proportion_interval(0, board.seeds).high:.0f} %"


def touched(each: Standing, scenario: str) -> str:
    """Return in how many episodes the moving robot and a person touched, and the fastest touch."""
    ran = [record for record in each.ran if record.scenario == scenario]
    speeds = [record.moving_contact_mps or 0.0 for record in ran if record.moving_touched]
    return f"{len(speeds)} of {len(ran)}" + (f", {max(speeds):.2f} m/s" if speeds else "")


def _goals(each: Standing) -> str:
    arrived = sum(record.time_to_goal_s is not None for record in each.ran)
    touched = sum(record.person_touched for record in each.ran)
    return f"{arrived} of {len(each.ran)}; {touched} of {len(each.ran)}"


def _violated(each: Standing) -> str:
    unaware = [record for record in each.ran if record.attention == "unaware"]
    return f"{sum(record.violation_time_s > 0.0 for record in unaware)} of {len(unaware)}"


def _contacts(each: Standing) -> str:
    hits = sum(record.moving_touched for record in each.ran)
    return f"{hits} of {len(each.ran)} (≤ {100.0 * each.contacts.high:.1f} %)"


def _part(attention: str) -> Callable[[Standing], str]:
    def cell(each: Standing) -> str:
        time_s = each.mean("time_lost_s", attention)
        violation_s = each.mean("violation_time_s", attention)
        return f"{time_s.text(1)} s, {violation_s.text(2)} s" if time_s.known else NOTHING

    return cell


def _label(each: Standing) -> str:
    """Return a row in one cell."""
    row = each.row
    return f"`{row.policy_name}`, {row.senses}, {row.planner.rpartition(':')[2]}"


def _planner(row: Row) -> str:
    """Return the planner of a row, with a link to an example."""
    module, _, name = row.planner.rpartition(":")
    if module.startswith("examples."):
        return f"[{name}](../{module.replace('.', '/')}.py)"
    return row.planner


def _signed(change: Interval) -> str:
    """Return a difference with its interval and signs."""
    if not change.known:
        return NOTHING
    if not change.bounded:
        return f"{change.value:+.1f} [?]"
    return f"{change.value:+.1f} [{change.low:+.1f}, {change.high:+.1f}]"
