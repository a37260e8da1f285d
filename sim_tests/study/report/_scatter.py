"""Section of a report: a scatter plot of time lost over the smallest margin of every episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from ._arm import Arm, Episode
from ._episode_list import outcome_of
from ._panel import Scale
from ._text import count, number, plural

#: Most marks in the plot; of more episodes, some with larger margins are left out.
MOST_MARKS: Final = 3000
# Share of the largest margins that lie beyond the right end of the axis and are drawn at the edge.
_FAR_SHARE: Final = 0.01
# Height in per cent of the strip above the axis of time, for episodes that never arrived.
_BAND: Final = 9.0


@dataclass(frozen=True, slots=True)
class Mark:
    """One episode in the plot.

    Attributes:
        line: line of the list of all episodes, to which the mark links.
        label: text for a screen reader.
        arm: number of its arm.
        look: number of the arm's colour and shape.
        x: place in per cent from the left.
        y: place in per cent from the top.
        touched: the robot moved into a person.
    """

    line: int
    label: str
    arm: int
    look: int
    x: float
    y: float
    touched: bool


@dataclass(frozen=True, slots=True)
class Scatter:
    """The scatter plot.

    Attributes:
        marks: the marks in the order in which they are drawn.
        legend: look, name, number of marks and number of each arm.
        x_ticks: places and texts.
        y_ticks: places and texts.
        x_zero: place of a margin of 0; None outside the axis.
        band: height in per cent of the strip for episodes that never arrived, 0 without it.
        data: data for the script: scenarios, arms, the replay command up to the number, and one
            row per mark.
        left_out: a note on episodes that are not drawn; empty for none.
    """

    marks: tuple[Mark, ...]
    legend: tuple[tuple[int, str, str, int], ...]
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    x_zero: float | None
    band: float
    data: dict[str, Any]
    left_out: str


def scatter(arms: Sequence[Arm], listed: Sequence[Episode], replay_prefix: str) -> Scatter | None:
    """Return the plot of the arms' episodes; None without any episode to draw.

    Args:
        arms: the arms of the comparison.
        listed: episodes in the order of the list of episodes.
        replay_prefix: the command that replays an episode, up to its number.
    """
    points = [(arm, each) for arm in arms for each in arm.episodes if _drawable(each)]
    total = sum(len(arm.episodes) for arm in arms)
    if not points:
        return None
    shown = _thinned(points)
    margins = sorted(_margin(each) for _, each in shown)
    far = margins[-1 - int(_FAR_SHARE * len(margins))]
    x_scale = Scale.over([margins[0], far], zero=True, pad=0.04)
    arrived = [_lost(each) for _, each in shown if each.record.time_to_goal_s is not None]
    y_scale = Scale.over(arrived, zero=True, pad=0.04)
    band = _BAND if len(arrived) < len(shown) else 0.0
    scenarios = sorted({each.record.scenario for _, each in shown})
    places = {name: index for index, name in enumerate(scenarios)}
    numbers = {arm.name: index for index, arm in enumerate(arms)}
    lines = {id(each): index for index, each in enumerate(listed)}
    marks, rows = [], []
    # Contacts are drawn last, above all other marks.
    for arm, each in sorted(shown, key=lambda point: point[1].record.robot_touched):
        record = each.record
        key = -1 if each.number is None else each.number
        y = 0.5 * band
        if record.time_to_goal_s is not None:
            y = round(100.0 - y_scale.place(_lost(each)) * (1.0 - band / 100.0), 2)
        hit = record.robot_touched
        label = f"{arm.name}, {record.scenario}, seed {record.seed}"
        x = x_scale.place(_margin(each))
        marks.append(Mark(lines.get(id(each), 0), label, numbers[arm.name], arm.look, x, y, hit))
        rows.append(
            [
                key,
                numbers[arm.name],
                places[record.scenario],
                record.seed,
                _two_decimals(record.min_margin_m),
                _two_decimals(record.min_separation_m),
                _two_decimals(record.speed_at_min_separation_mps),
                _two_decimals(record.time_lost_s),
                outcome_of(each),
            ]
        )
    missing = []
    if total > len(points):
        missing.append(
            f"{plural(total - len(points), 'episode')} without a margin (nobody came near, or the "
            "robot never moved) or without a time to compare with"
        )
    if len(points) > len(shown):
        missing.append(f"{count(len(points) - len(shown))} others, evenly thinned out")
    return Scatter(
        tuple(marks),
        tuple(
            (arm.look, arm.name, count(sum(point[0] is arm for point in shown)), index)
            for index, arm in enumerate(arms)
            if arm.episodes
        ),
        x_scale.ticks(8),
        tuple(
            (round(100.0 - place * (1.0 - band / 100.0), 2), text)
            for place, text in y_scale.ticks(6)
        ),
        x_scale.place(0.0) if x_scale.low < 0.0 < x_scale.high else None,
        band,
        {
            "scenarios": scenarios,
            "arms": [arm.name for arm in arms],
            "replay": replay_prefix,
            "rows": rows,
        },
        f"Not drawn: {'; '.join(missing)}." if missing else "",
    )


def _drawable(episode: Episode) -> bool:
    return episode.record.min_margin_m is not None and episode.record.time_lost_s is not None


def _margin(episode: Episode) -> float:
    value = episode.record.min_margin_m
    return 0.0 if value is None else value


def _lost(episode: Episode) -> float:
    value = episode.record.time_lost_s
    return 0.0 if value is None else value


def _thinned(points: Sequence[tuple[Arm, Episode]]) -> list[tuple[Arm, Episode]]:
    """Return at most :data:`MOST_MARKS` points.

    Half of them have the smallest margins; the others are evenly spaced in the order of margins.
    """
    if len(points) <= MOST_MARKS:
        return list(points)
    order = sorted(
        range(len(points)),
        key=lambda i: (not points[i][1].record.robot_touched, _margin(points[i][1])),
    )
    worst, rest = order[: MOST_MARKS // 2], order[MOST_MARKS // 2 :]
    step = len(rest) / (MOST_MARKS - len(worst))
    kept = [*worst, *(rest[int(index * step)] for index in range(MOST_MARKS - len(worst)))]
    return [points[index] for index in sorted(kept)]


def _two_decimals(value: float | None) -> str:
    return number(value, 2)
