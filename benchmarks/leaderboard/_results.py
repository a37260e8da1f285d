"""The figures of README, the demonstration's page and the safety argument, from committed rows."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks._harness import with_figures
from benchmarks.nav2 import summary
from sim_tests.demo import reported_table, reported_text
from sim_tests.study.measures import EpisodeRecord, Interval, bootstrap_interval, paired
from sim_tests.study.report import Table

from ._page import ROBOTS, Standing, standings
from ._rows import RESULTS, ROOT, Board
from ._safety import hazard_figures, margin_figures, reach_figures

_AWARE, _BLIND, _TODAY, _COSTMAP = ROBOTS
#: Heads of README's table of meetings.
COLUMNS: Final = ("**awarenav**", "slow for all", "AMRs of today")
_FILES: Final = ("README.md", "docs/simulation_results.md", "docs/safety.md")
#: Pages with parts that are made here, each between two comments.
PAGES: Final = tuple(ROOT / name for name in _FILES)


def write_figures(board: Board) -> None:
    """Write the parts with figures into the pages.

    Raises:
        SimError: the board has no row of a name that is needed here.
    """
    parts = figures(board)
    for page in PAGES:
        page.write_text(with_figures(page.read_text("utf-8"), parts), "utf-8")


def figures(board: Board, folder: Path = RESULTS) -> dict[str, str]:
    """Return the parts of the pages, by the names in their comments.

    Intervals are 95 %, by bootstrap over scenarios: they say what other scenarios of this kind
    might give.

    Raises:
        SimError: the board has no row of a name that is needed here.
    """
    rows = {each.row.name: each for each in standings(board, folder)}
    robots = {name: rows[board.named(name).name] for name in ROBOTS}
    return {
        "meetings": f"{_meetings(robots).markdown()}\n\n{_price(robots)}",
        "nav2": summary(),
        "hazards": hazard_figures(board, folder),
        "margins": margin_figures(board, folder),
        "reach": reach_figures(),
        "film": _filled(reported_text()),
        "lanes": f"```text\n{reported_table()}\n```",
    }


def _filled(text: str) -> str:
    return textwrap.fill(text, 100, break_long_words=False, break_on_hyphens=False)


def _meetings(robots: Mapping[str, Standing]) -> Table:
    """Return a table with the robots as columns."""
    count = {each.planned for each in robots.values()}.pop()
    lines: dict[str, Callable[[Standing], str]] = {
        "seconds lost, people who watch": lambda each: _mean(each, "time_lost_s", "attentive"),
        "seconds lost, all": lambda each: _mean(each, "time_lost_s"),
        f"touched while it moved, of {count}": lambda each: str(
            sum(record.moving_touched for record in each.ran)
        ),
        "impacts, never noticed": lambda each: _mean(each, "step_out_never"),
        "impacts, had noticed": _noticed,
        "impacts, all": lambda each: _mean(each, "step_out_all"),
    }
    # A telephone shows four narrow columns, and no fifth: the two of today share one.
    columns = [[robots[_AWARE]], [robots[_BLIND]], [robots[_TODAY], robots[_COSTMAP]]]
    return Table(
        dict.fromkeys(("", *COLUMNS), ""),
        [
            [title, *("; ".join(map(cell, column)) for column in columns)]
            for title, cell in lines.items()
        ],
    )


def _mean(each: Standing, field: str, attention: str = "") -> str:
    return f"{each.mean(field, attention).value:.1f}"


def _noticed(each: Standing) -> str:
    """Return the mean step-out impacts with people who had noticed the robot."""
    never, everybody = (each.mean(f"step_out_{people}").value for people in ("never", "all"))
    return f"{everybody - never:.1f}"


def _price(robots: Mapping[str, Standing]) -> str:
    """Return what awareness costs and saves, with intervals."""
    aware, blind = robots[_AWARE], robots[_BLIND]
    attentive = [each for each in aware.ran if each.attention == "attentive"]
    saved, saved_attentive = (
        over_scenarios(group, blind.ran, lambda first, second: second - first).text(1)
        for group in (aware.ran, attentive)
    )
    predicts, costmap = (times(robots[name], aware).text(2) for name in (_TODAY, _COSTMAP))
    scenarios = len({each.scenario for each in aware.ran})
    return _filled(
        f"Means of {aware.planned} meetings of each robot in {scenarios} scenarios. awarenav has a "
        "forward camera (120°) and two laser scanners, the AMRs of today the scanners alone: the "
        "first predicts people, the second has a costmap planner. Impacts are those [expected "
        "per 1 000 meetings if people step out]"
        f"(docs/what_it_wins.md#step-out-impacts). awarenav takes {costmap} × the time of the AMR "
        f"with a costmap planner and {predicts} × that of the one that predicts people. Awareness "
        f"saves {saved_attentive} s a meeting with people who watch and {saved} s over all, beside "
        "the same robot that is slow for everybody. Intervals are 95 %."
    )


def times(base: Standing, other: Standing) -> Interval:
    """Return the time to the goal of one row over that of another, as a ratio of sums.

    An episode that never arrives counts with what it lasted.
    """
    pairs = _by_scenario(base.ran, other.ran, "lasted_s")
    return bootstrap_interval(
        [second for _, second in pairs],
        np.random.default_rng(0),
        over=[first for first, _ in pairs],
    )


def over_scenarios(
    base: Sequence[EpisodeRecord],
    other: Sequence[EpisodeRecord],
    value: Callable[[float, float], float],
) -> Interval:
    """Return the mean over scenarios of a figure of the mean times that two rows lost."""
    pairs = _by_scenario(base, other, "time_lost_s")
    return bootstrap_interval([value(*pair) for pair in pairs], np.random.default_rng(0))


def _by_scenario(
    base: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], field: str
) -> list[tuple[float, float]]:
    """Return the means of a field by scenario, of the episodes where both have it."""
    found: dict[str, list[tuple[float, float]]] = {}
    for first, second in paired(base, other):
        values = getattr(first, field), getattr(second, field)
        if None not in values:
            found.setdefault(first.scenario, []).append(values)
    return [
        (float(np.mean([a for a, _ in each])), float(np.mean([b for _, b in each])))
        for each in found.values()
    ]
