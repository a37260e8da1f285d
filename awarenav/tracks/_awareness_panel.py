"""α over time of one track."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..figures import Axes
from ._history import TrackHistory
from ._page import FAINT, INK, PAPER, SHADE
from ._recording import count
from ._truth import SILENT_S, Matched, who

# Where a frame shows the person and no face, below α = 0.
_NO_FACE = -0.085


def draw_awareness(
    axes: Axes,
    history: TrackHistory,
    colour: str,
    matched: Matched | None,
    *,
    brief: bool = False,
) -> None:
    """Draw α with its band, the lower bound, what frames measured, and what was not seen.

    Args:
        axes: to draw into.
        history: of the track.
        colour: of the track.
        matched: stamp, person and true α of every frame that has the truth; None without truth.
        brief: there is little room for words.
    """
    axes.set_ylim(-0.15, 1.06)
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.grid(axis="y", alpha=0.3, linewidth=0.6)
    for start_s, end_s in history.unseen_spans():
        axes.axvspan(start_s, end_s, color=SHADE, linewidth=0, zorder=0)
    stamps = history.stamps_s
    alpha, std = history.numbers("awareness"), history.numbers("awareness_std")
    low, high = np.clip(alpha - std, 0.0, 1.0), np.clip(alpha + std, 0.0, 1.0)
    if len(stamps) == 1:  # a line through one point is not seen
        axes.errorbar(stamps, alpha, std, color=colour, linewidth=0.9, marker="_", zorder=3)
    axes.fill_between(stamps, low, high, color=colour, alpha=0.2, linewidth=0, zorder=1)
    axes.plot(stamps, alpha, color=colour, linewidth=0.9, zorder=3)
    axes.plot(stamps, history.numbers("awareness_lower"), color=colour, linewidth=2.2, zorder=5)
    _draw_measured(axes, history, colour)
    if matched:
        times = np.array([stamp for stamp, _, _ in matched])
        true = np.array([value for _, _, value in matched])
        changes = np.array([person for _, person, _ in matched])
        gaps = np.flatnonzero((np.diff(times) > SILENT_S) | (np.diff(changes) != 0)) + 1
        axes.plot(
            np.insert(times, gaps, np.nan),
            np.insert(true, gaps, np.nan),
            color=INK,
            linewidth=1.1,
            linestyle=(0, (1.0, 1.6)),
            zorder=6,
        )
    _draw_ends(axes, history, colour)
    _write_title(axes, history, colour, matched, brief)


def _draw_measured(axes: Axes, history: TrackHistory, colour: str) -> None:
    measured = history.numbers("measured_awareness")
    axes.plot(history.stamps_s, measured, ".", color=colour, markersize=3.2, alpha=0.55, zorder=2)
    faceless = [
        sample.stamp_s
        for sample in history.frames
        if sample.seen and sample.measured_awareness is None
    ]
    axes.plot(
        faceless,
        np.full(len(faceless), _NO_FACE),
        "|",
        color=FAINT,
        markersize=4,
        markeredgewidth=0.8,
        zorder=2,
    )


def _draw_ends(axes: Axes, history: TrackHistory, colour: str) -> None:
    floor = axes.get_ylim()[0]
    marks: dict[str, Any] = {"color": colour, "clip_on": False, "zorder": 8, "linestyle": "none"}
    axes.plot(history.born_s, floor, marker="o", markersize=6, markerfacecolor=PAPER, **marks)
    if history.died_s is not None:
        axes.plot(history.died_s, floor, marker="x", markersize=7, markeredgewidth=2, **marks)


def _write_title(
    axes: Axes,
    history: TrackHistory,
    colour: str,
    matched: Matched | None,
    brief: bool,
) -> None:
    frames = history.frames
    seen = history.seen_frames / len(frames) if frames else 0.0
    text = (
        f"seen {100.0 * seen:.0f} %"
        if brief
        else f"seen in {100.0 * seen:.0f} % of {count(len(frames), 'frame')}"
    )
    if history.confirmed_s is None:
        text += ", never confirmed"
    if matched is not None:
        text += f", person {who(matched)}" + ("" if brief else " of the truth")
    kind = "person" if history.samples[0].status == "given" else "track"
    axes.set_title(f"{kind} {history.id}", fontsize=10, loc="left", color=colour, weight="bold")
    axes.set_title(text, fontsize=9, loc="right", color=INK)
