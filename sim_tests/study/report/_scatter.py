"""Section of a report: a scatter plot of time lost over the smallest margin of every episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from ._arm import Arm, Episode
from ._episode_list import outcome_of
from ._geometry import PLOT_PX, Region, spread
from ._panel import Scale
from ._text import count, number, plural

#: Most marks in the plot; of more episodes, some with larger margins are left out.
MOST_MARKS: Final = 3000
# Share of the largest margins that lie beyond the right end of the axis and are drawn at the edge.
_FAR_SHARE: Final = 0.01
# Height in per cent of the strip above the axis of time, for episodes that never arrived.
_BAND: Final = 9.0
#: Up to so many marks, they are large.
FEW_MARKS: Final = 300
# Smallest distance of marks in per cent, large and small: 5 and 2 px on a phone.
_APART: Final = 1.6
_APART_MANY: Final = 0.6
# Marks keep this distance, in per cent, from lines that they must not cross.
_BESIDE: Final = 0.5


@dataclass(frozen=True, slots=True)
class Mark:
    """One episode in the plot.

    Attributes:
        line: line of the list of all episodes, to which the mark links.
        label: text for a screen reader.
        arm: number of its arm.
        look: number of the arm's colour and shape.
        x: place in per cent from the left.
        y: place in per cent from the top, moved off other marks.
        touched: a person and the moving robot touched.
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
        left_out: a note on episodes that are not drawn, or lie on others; empty for none.
    """

    marks: tuple[Mark, ...]
    legend: tuple[tuple[int, str, str, int], ...]
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    x_zero: float | None
    band: float
    data: dict[str, Any]
    left_out: str

    @property
    def large(self) -> bool:
        """True if the marks are few, and large."""
        return len(self.marks) <= FEW_MARKS


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
    x_zero = x_scale.place(0.0) if x_scale.low < 0.0 < x_scale.high else None
    # Contacts keep their places, and are drawn last, above all other marks.
    shown = sorted(shown, key=lambda point: not point[1].record.moving_touched)
    spots, covered = spread(
        [_place(each, x_scale, y_scale, x_zero, band) for _, each in shown],
        _APART if len(shown) <= FEW_MARKS else _APART_MANY,
    )
    drawn = sorted(
        zip(shown, spots, strict=True), key=lambda point: point[0][1].record.moving_touched
    )
    marks, rows = [], []
    for (arm, each), (x, y) in drawn:
        record = each.record
        key = -1 if each.number is None else each.number
        hit = record.moving_touched
        label = f"{arm.name}, {record.scenario}, seed {record.seed}"
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
    return Scatter(
        tuple(marks),
        tuple(
            (arm.look, arm.name, count(sum(point[0] is arm for point in shown)), index)
            for index, arm in enumerate(arms)
            if arm.episodes
        ),
        x_scale.ticks(8, PLOT_PX[0]),
        tuple(
            (round(100.0 - place * (1.0 - band / 100.0), 2), text)
            for place, text in y_scale.ticks(6)
        ),
        x_zero,
        band,
        {
            "scenarios": scenarios,
            "arms": [arm.name for arm in arms],
            "replay": replay_prefix,
            "rows": rows,
        },
        _left_out_note(total, len(points), len(shown), covered),
    )


def _left_out_note(total: int, drawable: int, shown: int, covered: int) -> str:
    """Return the note on episodes that are not drawn, or lie on others; empty for none."""
    missing = []
    if total > drawable:
        missing.append(
            f"{plural(total - drawable, 'episode')} without a margin (nobody came near, or the "
            "robot never moved) or without a time to compare with"
        )
    if drawable > shown:
        missing.append(f"{plural(drawable - shown, 'other')}, evenly thinned out")
    notes = [f"Not drawn: {'; '.join(missing)}."] if missing else []
    if covered:
        notes.append(f"{plural(covered, 'mark lies', 'marks lie')} on others.")
    return " ".join(notes)


def _place(
    episode: Episode, x_scale: Scale, y_scale: Scale, x_zero: float | None, band: float
) -> tuple[float, float, Region]:
    """Return the place of an episode in per cent, and where its mark may be moved.

    A mark stays on its side of a margin of 0, and in the strip of those that never arrived or
    below it.
    """
    x = x_scale.place(_margin(episode))
    left, right = 0.0, 100.0
    if x_zero is not None and _margin(episode) < 0.0:
        right = max(x, x_zero - _BESIDE)
    elif x_zero is not None:
        left = x_zero
    if episode.record.time_to_goal_s is None:
        return x, 0.5 * band, Region(left, right, 0.0, band)
    y = round(100.0 - y_scale.place(_lost(episode)) * (1.0 - band / 100.0), 2)
    return x, y, Region(left, right, min(y, band + _BESIDE), 100.0)


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
        key=lambda i: (not points[i][1].record.moving_touched, _margin(points[i][1])),
    )
    worst, rest = order[: MOST_MARKS // 2], order[MOST_MARKS // 2 :]
    step = len(rest) / (MOST_MARKS - len(worst))
    kept = [*worst, *(rest[int(index * step)] for index in range(MOST_MARKS - len(worst)))]
    return [points[index] for index in sorted(kept)]


def _two_decimals(value: float | None) -> str:
    return number(value, 2)
