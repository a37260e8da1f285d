"""The picture of the comparison: time lost, and speed, awareness and radius along the aisle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.figures import Axes, new_figure, save_figure
from perception.arrays import FloatArray

from ..crossing import CrossingFrame, CrossingResult
from ._film_values import WITHOUT_AWARENESS, largest_radius_m, lowest_bound, time_lost_s

_COLOURS: Final = ("#8a8f98", "#1f4e79", "#b3261e", "#2e7d4f", "#b8651b")
_QUIET: Final = "#5c6069"
_TEXT_PT: Final = 13
_SMALL_PT: Final = 12
# The part of the robot's way in which curves are compared and labelled, metres.
_LABELLED_M: Final = (2.5, 12.4)
# Curves whose mean distance is below this share of the axis are one curve with both names.
_SAME: Final = 0.03
# Size of a letter: width in metres of the robot's way, and height as a share of the axis.
_LETTER_M: Final = 0.19
_LINE_SHARE: Final = 0.12
# A limit this far below the speed of the free robot slows the robot down.
_SLOWER_MPS: Final = 0.002

# x_min, y_min, x_max, y_max of a text, in the units of its axes.
_Box = tuple[float, float, float, float]
Rows = Sequence[tuple[str, CrossingResult]]


@dataclass(frozen=True, slots=True, eq=False)
class _Curve:
    """One quantity of one crossing along the robot's way; NaN where there is none."""

    label: str
    colour: str
    along_m: FloatArray
    values: FloatArray


def plot_comparison(path: Path, rows: Rows) -> None:
    """Plot the time that each crossing loses, and why: speed, awareness and radius over its way.

    Args:
        path: the PNG file.
        rows: name and result of each crossing; the first has nobody in it, and the others lose
            time against it.
    """
    figure = new_figure(7.4, 9.6, dpi=110.0)
    bars, speed, bound, radius = figure.subplots(
        4, 1, gridspec_kw={"height_ratios": [1.25, 1.25, 1.0, 1.0]}
    )
    figure.suptitle(headline(rows), fontsize=16, fontweight="bold", x=0.02, ha="left")
    _plot_time_lost(bars, rows)
    met = [row for row in rows if row[1].frames[0].truth]
    aware = [row for row in met if row[1].policy not in WITHOUT_AWARENESS]
    for axes, name, shown, pick, top in (
        (speed, "speed (m/s)", rows, lambda frame: frame.robot_state.travel_mps, 1.8),
        (bound, "awareness α: the lower bound that acts", aware, lowest_bound, 1.1),
        (radius, "obstacle radius (m)", met, largest_radius_m, 2.5),
    ):
        axes.set_title(name, fontsize=_TEXT_PT, fontweight="bold", loc="left")
        axes.set_xlim(0.0, 13.1)
        axes.set_ylim(0.0, top)
        axes.tick_params(labelsize=_SMALL_PT)
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
        if met:
            place_m = float(met[0][1].frames[-1].truth[0].position_odom_m[0])
            axes.axvline(place_m, color="0.5", lw=1.2, ls=":", zorder=0)
            if axes is speed:
                axes.text(place_m + 0.1, 0.05, "worker", fontsize=_SMALL_PT, color=_QUIET)
        texts: list[_Box] = []
        if axes is speed:
            texts += _mark_limits(axes, rows)
        for _, result in aware:
            if axes is bound:
                texts += _mark_memory(axes, result)
            if axes is radius:
                texts += _mark_false_people(axes, result)
        _plot_curves(axes, _curves(rows, shown, pick), texts)
    radius.set_xlabel("robot's way along the aisle (m)", fontsize=_TEXT_PT)
    save_figure(figure, path)


def headline(rows: Rows) -> str:
    """Return the result in two lines: the time that the aware robot loses to each worker."""
    lost = {label: time_lost_s(result, rows[0][1]) for label, result in rows}

    watched, ignored = (lost[f"aware, {kind} worker"] for kind in ("attentive", "distracted"))
    if watched is None or ignored is None:
        return "The aware robot does not reach\nits goal in both runs"
    return (
        f"The aware robot loses {watched:.1f} s to a worker\n"
        f"who watches it, and {ignored:.1f} s to one who looks away"
    )


def _plot_time_lost(axes: Axes, rows: Rows) -> None:
    """Plot one bar a crossing, with its name, time lost and speed beside the worker above it."""
    free = rows[0][1]
    losses = [time_lost_s(result, free) for _, result in rows[1:]]
    for place, ((label, result), lost, colour) in enumerate(
        zip(rows[1:], losses, _COLOURS[1:], strict=False)
    ):
        axes.barh(place, lost or 0.0, color=colour, height=0.28)
        text = "does not arrive" if lost is None else f"{lost:.1f} s"
        text = f"{label}: {text}, passes at up to {result.max_speed_within_2m_mps:.2f} m/s"
        axes.text(0.0, place - 0.2, text, va="bottom", fontsize=_TEXT_PT, color=colour)
    axes.set_ylim(len(rows) - 1.6, -0.85)
    axes.set_xlim(0.0, max(*(lost or 0.0 for lost in losses), 1.0))
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[["top", "right", "bottom", "left"]].set_visible(False)
    time = "" if free.time_to_goal_s is None else f" (nobody there: {free.time_to_goal_s:.2f} s)"
    axes.set_title(f"time lost{time}", fontsize=_TEXT_PT, fontweight="bold", loc="left")


def _curves(rows: Rows, shown: Rows, pick: Callable[[CrossingFrame], float | None]) -> list[_Curve]:
    names = [label for label, _ in rows]
    curves = []
    for label, result in shown:
        values = [np.nan if (v := pick(frame)) is None else v for frame in result.frames]
        colour = _COLOURS[names.index(label)]
        curves.append(_Curve(label, colour, _along_m(result), np.array(values, dtype=float)))
    return curves


def _along_m(result: CrossingResult) -> FloatArray:
    return np.array([frame.robot_state.position_odom_m[0] for frame in result.frames])


def _plot_curves(axes: Axes, curves: Sequence[_Curve], texts: Sequence[_Box]) -> None:
    """Plot curves with their names beside them; curves that coincide share one label.

    Args:
        axes: to plot in.
        curves: the curves.
        texts: texts on the axes, which the names keep clear of.
    """
    low, high = axes.get_ylim()
    grid = np.linspace(*_LABELLED_M, 100)
    groups: list[tuple[list[_Curve], FloatArray]] = []
    for curve in curves:
        values = np.interp(grid, curve.along_m, np.nan_to_num(curve.values, nan=low))
        same = next(
            (
                members
                for members, other in groups
                if np.abs(other - values).mean() < _SAME * (high - low)
            ),
            None,
        )
        # The second of two equal curves is dashed, so that both colours show.
        style = "-" if same is None else (0, (3, 3))
        axes.plot(curve.along_m, curve.values, color=curve.colour, lw=2.4, ls=style)
        if same is None:
            groups.append(([curve], values))
        else:
            same.append(curve)
    everything = np.array([values for _, values in groups])
    taken = list(texts)
    for members, values in groups:
        names = " = ".join(curve.label.removeprefix("aware, ") for curve in members)
        half = (0.5 * _LETTER_M * len(names), 0.5 * _LINE_SHARE * (high - low))
        x, y = _free_place(grid, values, everything, half, (low, high), taken)
        taken.append((x - half[0], y - half[1], x + half[0], y + half[1]))
        axes.text(
            x, y, names, color=members[-1].colour, fontsize=_TEXT_PT, ha="center", va="center"
        )


def _free_place(
    grid: FloatArray,
    values: FloatArray,
    everything: FloatArray,
    half: tuple[float, float],
    limits: tuple[float, float],
    taken: Sequence[_Box],
) -> tuple[float, float]:
    """Return the middle of a text near the curve ``values`` that no curve crosses.

    Args:
        grid: (N,) places along the way.
        values: (N,) the curve.
        everything: (M, N) all curves.
        half: half of the width and height of the text.
        limits: of the vertical axis.
        taken: other texts.
    """
    low, high = limits
    half_width_m, half_height = half
    best, found = -np.inf, (float(grid[0]), float(values[0]))
    for place, x in enumerate(grid):
        near = np.abs(grid - x) <= half_width_m
        if x - half_width_m < grid[0] or x + half_width_m > grid[-1]:
            continue
        for side in (1.0, -1.0):
            edge = values[near].max() if side > 0 else values[near].min()
            y = float(edge + side * 1.25 * half_height)
            if not low <= y - half_height <= y + half_height <= high:
                continue
            if any(
                abs(0.5 * (box[0] + box[2]) - x) < half_width_m + 0.5 * (box[2] - box[0])
                and abs(0.5 * (box[1] + box[3]) - y) < half_height + 0.5 * (box[3] - box[1])
                for box in taken
            ):
                continue
            gap = np.abs(everything[:, near] - y).min() / half_height
            away = abs(edge - values[place]) / half_height
            score = min(gap, 1.25) - 0.3 * away - 0.02 * abs(x - 6.5) + 0.05 * side
            if score > best:
                best, found = score, (float(x), y)
    return found


def _mark_limits(axes: Axes, rows: Rows) -> list[_Box]:
    """Mark the places at which the worker begins to limit the speed of a robot."""
    free = rows[0][1]
    along, speeds = _along_m(free), [frame.robot_state.travel_mps for frame in free.frames]
    first: dict[float, tuple[float, str]] = {}
    for (_, result), colour in zip(rows[1:], _COLOURS[1:], strict=False):
        for x, frame in zip(_along_m(result).tolist(), result.frames, strict=True):
            if frame.constraints.speed_limit_mps < np.interp(x, along, speeds) - _SLOWER_MPS:
                if all(abs(x - other) > 0.1 for other in first):
                    first[x] = (frame.robot_state.travel_mps, colour)
                break
    boxes: list[_Box] = []
    for x, (speed_mps, colour) in sorted(first.items()):
        axes.plot(x, speed_mps, "o", color=colour, ms=7)
        text, side = (f"{x:.1f} m", 1.0) if boxes else (f"limit from {x:.1f} m", -1.0)
        boxes.append(_write(axes, text, x, speed_mps + 0.13, side, colour))
    return boxes


def _mark_memory(axes: Axes, result: CrossingResult) -> list[_Box]:
    """Mark where the worker is out of the camera's view and still counts as aware."""
    along, frames = _along_m(result).tolist(), result.frames
    seen = [x for x, frame in zip(along, frames, strict=True) if frame.observation_of(0)]
    aware = [x for x, frame in zip(along, frames, strict=True) if lowest_bound(frame)]
    if not seen or not aware or aware[-1] <= seen[-1]:
        return []
    axes.axvspan(seen[-1], aware[-1], color=_COLOURS[3], alpha=0.10, lw=0)
    lines = ("out of camera's view:", "remembered")
    return [
        _write(axes, text, seen[-1] + 0.1, 0.99 - 0.16 * row, 1.0, _QUIET)
        for row, text in enumerate(lines)
    ]


def _mark_false_people(axes: Axes, result: CrossingResult) -> list[_Box]:
    """Mark where the robot tracks more people than there are."""
    for x, frame in zip(_along_m(result).tolist(), result.frames, strict=True):
        radius_m = largest_radius_m(frame)
        if radius_m is not None and len(frame.constraints.obstacles) > len(frame.truth):
            return [_write(axes, "false person in a scan", x - 0.1, radius_m, -1.0, _QUIET)]
    return []


def _write(axes: Axes, text: str, x: float, y: float, side: float, colour: str) -> _Box:
    """Write a text that begins (side 1) or ends (side −1) at x; return its box."""
    align = "left" if side > 0 else "right"
    axes.text(x, y, text, ha=align, va="center", fontsize=_SMALL_PT, color=colour)
    end = x + side * _LETTER_M * len(text)
    low, high = axes.get_ylim()
    half_height = 0.5 * _LINE_SHARE * (high - low)
    return min(x, end), y - half_height, max(x, end), y + half_height
