"""The charts of a report as SVG: time lost against risk, and every episode at its least margin."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from matplotlib import rc_context

from awarenav.figures import Axes, new_figure

from ..measures import METRICS, Interval
from ._results import Arm

# About as wide as a phone, in inches of 96 px; wide windows show it larger.
_SIZE_IN: Final = (4.4, 3.7)
# Colours as matplotlib draws them, and the page's variables that take their places: these differ
# in light and dark windows.
_VARIABLES: Final = {
    "#191c21": "--ink",
    "#565d68": "--soft",
    "#dfe2e6": "--line",
    "#fbe9e7": "--danger",
    "#6b727c": "--c0",
    "#0b66b0": "--c1",
    "#c2480a": "--c2",
    "#007a5c": "--c3",
    "#8b3f87": "--c4",
    "#866200": "--c5",
}
_INK, _SOFT, _LINE, _DANGER, *_COLOURS = _VARIABLES
_MARKERS: Final = "soD^vP"
_STYLE: Final[dict[Any, Any]] = {
    "font.size": 9.0,
    "axes.edgecolor": _SOFT,
    "axes.labelcolor": _INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": _LINE,
    "xtick.color": _SOFT,
    "ytick.color": _SOFT,
    "legend.frameon": False,
    "legend.labelcolor": _INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "awarenav",
}
# What the chart of risk can show upwards, the preferred one first, and the names of its axis.
_RISKS: Final = {
    "step_out_all": "step-out impacts, all people, per 1 000",
    "violation_time_s": "negative margins, s",
}
#: Most episodes in a chart; those with the largest margins are left out.
MOST_MARKS: Final = 3000


def risk_chart(arms: Sequence[Arm]) -> list[tuple[str, str]]:
    """Return the chart of the mean time lost against a measure of risk, and its caption.

    The risk is the step-out impacts with all people; where they are not known of every robot, or
    are all 0, the time of negative margins. Without any risk there is no chart.
    """
    rows = [arm.row.means for arm in arms]
    risk = next((name for name in _RISKS if _tells(rows, name)), None)
    if risk is None:
        return []

    def draw(axes: Axes) -> None:
        for number, (arm, row) in enumerate(zip(arms, rows, strict=True)):
            x, y = row["time_lost_s"], row[risk]
            if x.known and y.known:
                axes.errorbar(
                    x.value,
                    y.value,
                    xerr=_reach(x),
                    yerr=_reach(y),
                    fmt=_MARKERS[number % len(_MARKERS)],
                    color=_COLOURS[number % len(_COLOURS)],
                    elinewidth=1.2,
                    label=arm.name,
                )
        highest = axes.get_ylim()[1]
        axes.set_ylim(-0.04 * highest, highest)
        axes.set_xlabel("mean time lost, s")
        axes.set_ylabel(_RISKS[risk])

    caption = (
        "Time lost against risk: the lower left is best. Upwards: "
        f"{METRICS[risk].title.lower()}. Bars are 95 % intervals."
    )
    return [(_svg("risk", draw), caption)]


def _tells(rows: Sequence[Mapping[str, Interval]], risk: str) -> bool:
    """Return whether a risk can be drawn of every robot, and is not 0 of all."""
    known = all(row["time_lost_s"].known and row[risk].known for row in rows)
    return known and any(row[risk].value > 0.0 for row in rows)


def episode_chart(arms: Sequence[Arm]) -> tuple[str, str]:
    """Return the chart of all episodes by smallest margin and speed when nearest, and a caption."""
    points = [
        (record.min_margin_m, record.speed_at_min_separation_mps, number)
        for number, arm in enumerate(arms)
        for record in (each.record for each in arm.episodes)
        if record.min_margin_m is not None and record.speed_at_min_separation_mps is not None
    ]
    shown = sorted(points)[:MOST_MARKS]

    def draw(axes: Axes) -> None:
        for number, arm in enumerate(arms):
            own = [(x, y) for x, y, of in shown if of == number]
            axes.scatter(
                [x for x, _ in own],
                [y for _, y in own],
                s=14,
                marker=_MARKERS[number % len(_MARKERS)],
                color=_COLOURS[number % len(_COLOURS)],
                alpha=0.7,
                linewidths=0,
                label=arm.name,
            )
        left, right = axes.get_xlim()
        if left < 0.0:
            axes.axvspan(left, 0.0, color=_DANGER, zorder=0)
        axes.set_xlim(left, right)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("smallest separation margin, m")
        axes.set_ylabel("speed when nearest, m/s")

    left_out = f" The {len(points) - len(shown)} largest margins are left out." * (
        len(shown) < len(points)
    )
    caption = f"Every episode at its least margin; a margin below 0 is too close.{left_out}"
    return _svg("episodes", draw), caption


def _reach(interval: Interval) -> tuple[tuple[float], tuple[float]] | None:
    """Return the lengths of an error bar below and above its value; None without bounds."""
    if not interval.bounded:
        return None
    return (interval.value - interval.low,), (interval.high - interval.value,)


def _svg(name: str, draw: Callable[[Axes], None]) -> str:
    """Return a chart as the SVG element of an HTML page."""
    file = io.StringIO()
    with rc_context(_STYLE):
        figure = new_figure(*_SIZE_IN)
        figure.patch.set_alpha(0.0)
        axes = figure.add_subplot(facecolor="none")
        draw(axes)
        _, labels = axes.get_legend_handles_labels()
        if labels:
            columns = 2 if max(map(len, labels)) < 24 and len(labels) > 1 else 1
            figure.legend(loc="outside lower left", ncols=columns)
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
    text = file.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", text)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, f"var({variable})")
    return text.replace("<svg ", f'<svg role="img" aria-label="{name}" ', 1)
