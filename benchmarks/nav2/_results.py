"""The table of docs/test_your_nav2.md, from the committed rows of crossings under Nav2."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.files import markdown_table
from sim_tests.study.measures import (
    Conduct,
    EpisodeRecord,
    bootstrap_interval,
    paired,
    read_records,
)

#: A robot whose controller keeps its path while it slows down.
ON_ITS_CURVE: Final = Path(__file__).with_name("on_its_curve.yaml")
#: The committed rows.
ROWS: Final = Path(__file__).with_name("rows.csv")
# Beside them: by how much the fastest point of the robot was above the limit.
_EXCESS: Final = "excess.csv"
_EXCESS_COLUMNS: Final = (
    *("planner", "policy", "robot", "scenario", "seed"),
    "fastest_point_excess_mps",
)
_TODAY: Final = "today"
#: Policies of the summary: awarenav's default, and slow for everybody.
_SUMMED: Final = ("balanced", "blind")
_FACES: Final = {
    _TODAY: "today: scans alone",
    "limit": "limit",
    "grid": "limit and grid of people",
    "mask": "limit and speed mask",
}
#: Robots of the rows, in words.
_ROBOTS: Final = {"": "", ON_ITS_CURVE.stem: ", keeps its path"}


def write_excess(
    path: Path, rows: Sequence[EpisodeRecord], conducts: Sequence[Conduct | None]
) -> None:
    """Write, beside the table ``path`` of rows, the excess over the limit where it is known."""
    with path.with_name(_EXCESS).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_EXCESS_COLUMNS)
        for row, conduct in zip(rows, conducts, strict=True):
            if conduct is not None and conduct.fastest_point_excess_mps is not None:
                excess_mps = round(conduct.fastest_point_excess_mps, 4)
                writer.writerow((*_keys(row), row.scenario, row.seed, excess_mps))


def _keys(row: EpisodeRecord) -> tuple[str, str, str]:
    """Return the stack and the robot of a row. Alone, no policy reaches the stack."""
    policy = "" if row.planner.endswith(f", {_TODAY}") else row.policy
    return row.planner, policy, row.robot or ""


def _read_excess(path: Path) -> dict[tuple[str, str, str], list[float]]:
    """Return the excesses (m/s) beside a table of rows, by stack and robot."""
    found: dict[tuple[str, str, str], list[float]] = {}
    with path.with_name(_EXCESS).open(newline="", encoding="utf-8") as file:
        for planner, policy, robot, _, _, value in list(csv.reader(file))[1:]:
            found.setdefault((planner, policy, robot), []).append(float(value))
    return found


def table(path: Path = ROWS) -> str:
    """Return the table as Markdown.

    Times are sums over the episodes that both robots drove, with 95 % intervals by bootstrap over
    episodes; an episode that never arrives counts with what it lasted.
    """
    above_mps = _read_excess(path)
    groups = _groups(path)
    header = (
        *("stack", "goals", "time over today's", "with attentive people", "touched while moving"),
        *("step-out impacts, never noticed; all", "above the limit, m/s: median, worst"),
    )
    lines = []
    for (stack, policy, robot), rows in groups.items():
        controller, _, face = stack.partition(", ")
        today = groups[f"{controller}, {_TODAY}", "", ""]
        attentive = [each for each in rows if each.attention == "attentive"]
        cells = [
            f"{controller}, {_FACES[face]}{policy and f', `{policy}`'}{_ROBOTS[robot]}",
            f"{sum(each.time_to_goal_s is not None for each in rows)} of {len(rows)}",
            _times(today, rows) if policy else "1",
            _times(today, attentive) if policy else "1",
            _touched(rows),
            _impacts(rows),
            _excess(above_mps[stack, policy, robot]) if policy else "",
        ]
        lines.append(cells)
    return markdown_table(header, lines)


def summary(path: Path = ROWS) -> str:
    """Return a short table with a column for each robot: Nav2 alone, and with two policies.

    The limit alone reaches Nav2, and the robot does not keep its path.
    """
    groups = _groups(path)
    lines = ["| | **awarenav** | slow for all | Nav2 |", "| --- | --- | --- | --- |"]
    for controller in sorted({stack.partition(", ")[0] for stack, _, _ in groups}):
        today = groups[f"{controller}, {_TODAY}", "", ""]
        attentive = [each for each in today if each.attention == "attentive"]
        robots = [groups[f"{controller}, limit", each, ""] for each in _SUMMED]
        rows = {
            "time among people who watch it": (*(_times(attentive, r) for r in robots), "1"),
            "time among all": (*(_times(today, each) for each in robots), "1"),
            f"touched while it moved, of {len(today)}": map(_touched, [*robots, today]),
            "impacts, never noticed; all": map(_impacts, [*robots, today]),
        }
        lines += [f"| {controller}: {name} | {' | '.join(row)} |" for name, row in rows.items()]
    return "\n".join(lines)


def _groups(path: Path) -> dict[tuple[str, str, str], list[EpisodeRecord]]:
    """Return the rows by stack and robot."""
    groups: dict[tuple[str, str, str], list[EpisodeRecord]] = {}
    for row in read_records(path):
        groups.setdefault(_keys(row), []).append(row)
    return groups


def _touched(rows: Sequence[EpisodeRecord]) -> str:
    touched = [each for each in rows if each.moving_contacts]
    fastest = max((each.moving_contact_mps or 0.0 for each in touched), default=0.0)
    return f"{len(touched)}, {fastest:.2f} m/s" if touched else "0"


def _impacts(rows: Sequence[EpisodeRecord]) -> str:
    return "; ".join(f"{_mean(rows, name):.1f}" for name in ("step_out_never", "step_out_all"))


def _times(today: Sequence[EpisodeRecord], rows: Sequence[EpisodeRecord]) -> str:
    pairs = [(first.lasted_s, second.lasted_s) for first, second in paired(today, rows)]
    interval = bootstrap_interval(
        [second for _, second in pairs],
        np.random.default_rng(0),
        over=[first for first, _ in pairs],
    )
    return interval.text(2)


def _excess(values_mps: Sequence[float]) -> str:
    return f"{max(float(np.median(values_mps)), 0.0):.2f}, {max(values_mps):.2f}"


def _mean(rows: Sequence[EpisodeRecord], name: str) -> float:
    return float(np.mean([getattr(each, name) or 0.0 for each in rows]))
