"""The results that README leads with, from the committed rows of the leaderboard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sim_tests.study.measures import EpisodeRecord, Interval, bootstrap_interval, paired

from ._page import Standing, standings
from ._rows import RESULTS, Board

_TODAY: Final = "today"
_COSTMAP: Final = "today-costmap"
_AWARE: Final = "balanced-camera+scanner"
_BLIND: Final = "blind-camera+scanner"


def headline(board: Board, folder: Path = RESULTS) -> str:
    """Return the results as lines of text.

    Intervals are 95 %, by bootstrap over scenarios: they say what other scenarios of this kind
    might give.

    Raises:
        SimError: the board has no row of a name that is needed here.
    """
    rows = {each.row.name: each for each in standings(board, folder)}
    today, costmap, aware, blind = (
        rows[board.named(name).name] for name in (_TODAY, _COSTMAP, _AWARE, _BLIND)
    )
    attentive = [each for each in aware.ran if each.attention == "attentive"]
    won, won_attentive = (
        over_scenarios(group, blind.ran, lambda first, second: second - first)
        for group in (aware.ran, attentive)
    )
    lines = [
        f"{len(board.templates)} scenarios, {board.seeds} seed(s) each, camera and scanners",
        f"time over today's AMR:          {times(today, aware).text(2)}",
        f"  over that with a costmap:     {times(costmap, aware).text(2)}",
        f"what awareness saves:           {won.text(1)} s a crossing",
        f"  with attentive people:        {won_attentive.text(1)} s",
        "step-out impacts per 1 000 crossings (fastest), never noticed; all people:",
    ]
    for name, row in (
        ("today's AMR", today),
        ("with a costmap planner", costmap),
        ("slow for everybody", blind),
        ("awarenav", aware),
    ):
        hits = sum(each.moving_touched for each in row.ran)
        lines.append(
            f"  {name:30s}{row.impacts('never')}; {row.impacts('all')}; contacts with the moving "
            f"robot in {hits} of {len(row.ran)}"
        )
    return "\n".join(lines)


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
