"""The panel with α over time of a track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from ..errors import counted
from ..figures import Axes
from ._history import TrackHistory
from ._page import BACKGROUND_COLOUR, FAINT_COLOUR, TEXT_COLOUR, UNSEEN_COLOUR
from ._truth import MAX_TRUTH_GAP_S, TruthMatch, person_ids_text

# Height of the marks of frames that show the person without evidence, below α = 0.
_NO_EVIDENCE_MARK: Final = -0.085


def draw_awareness(
    axes: Axes,
    history: TrackHistory,
    colour: str,
    matches: Sequence[TruthMatch] | None,
    *,
    short_title: bool = False,
) -> None:
    """Draw α with its standard deviation, the lower bound, the measured α, and the unseen times.

    Args:
        axes: to draw into.
        history: of the track.
        colour: of the track.
        matches: of the track with people of the truth; None without truth.
        short_title: for a narrow panel.
    """
    axes.set_ylim(-0.15, 1.06)
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.grid(axis="y", alpha=0.3, linewidth=0.6)
    for start_s, end_s in history.unseen_spans():
        axes.axvspan(start_s, end_s, color=UNSEEN_COLOUR, linewidth=0, zorder=0)
    stamps = history.stamps_s
    alpha, std = history.values("awareness"), history.values("awareness_std")
    low, high = np.clip(alpha - std, 0.0, 1.0), np.clip(alpha + std, 0.0, 1.0)
    if len(stamps) == 1:  # a line through one point would be invisible
        axes.errorbar(stamps, alpha, std, color=colour, linewidth=0.9, marker="_", zorder=3)
    axes.fill_between(stamps, low, high, color=colour, alpha=0.2, linewidth=0, zorder=1)
    axes.plot(stamps, alpha, color=colour, linewidth=0.9, zorder=3)
    axes.plot(stamps, history.values("awareness_lower"), color=colour, linewidth=2.2, zorder=5)
    _draw_measured(axes, history, colour)
    if matches:
        _draw_truth(axes, matches)
    _draw_ends(axes, history, colour)
    _write_title(axes, history, colour, matches, short_title)


def _draw_truth(axes: Axes, matches: Sequence[TruthMatch]) -> None:
    """Draw the true α; the line is broken at gaps, and where the person changes."""
    stamps = np.array([match.stamp_s for match in matches])
    true = np.array([match.awareness for match in matches])
    people = np.array([match.person_id for match in matches])
    gaps = np.flatnonzero((np.diff(stamps) > MAX_TRUTH_GAP_S) | (np.diff(people) != 0)) + 1
    axes.plot(
        np.insert(stamps, gaps, np.nan),
        np.insert(true, gaps, np.nan),
        color=TEXT_COLOUR,
        linewidth=1.1,
        linestyle=(0, (1.0, 1.6)),
        zorder=6,
    )


def _draw_measured(axes: Axes, history: TrackHistory, colour: str) -> None:
    """Draw the measured α, and marks for frames that show the person without evidence."""
    measured = history.values("measured_awareness")
    axes.plot(history.stamps_s, measured, ".", color=colour, markersize=3.2, alpha=0.55, zorder=2)
    without_evidence = [
        sample.stamp_s
        for sample in history.frames
        if sample.seen and sample.measured_awareness is None
    ]
    axes.plot(
        without_evidence,
        np.full(len(without_evidence), _NO_EVIDENCE_MARK),
        "|",
        color=FAINT_COLOUR,
        markersize=4,
        markeredgewidth=0.8,
        zorder=2,
    )


def _draw_ends(axes: Axes, history: TrackHistory, colour: str) -> None:
    """Mark birth and death of the track on the lower edge."""
    floor = axes.get_ylim()[0]
    marks: dict[str, Any] = {"color": colour, "clip_on": False, "zorder": 8, "linestyle": "none"}
    axes.plot(
        history.born_s, floor, marker="o", markersize=6, markerfacecolor=BACKGROUND_COLOUR, **marks
    )
    if history.died_s is not None:
        axes.plot(history.died_s, floor, marker="x", markersize=7, markeredgewidth=2, **marks)


def _write_title(
    axes: Axes,
    history: TrackHistory,
    colour: str,
    matches: Sequence[TruthMatch] | None,
    short: bool,
) -> None:
    """Write the track's id, how often it is seen, and the person that it follows."""
    frames = history.frames
    seen = history.seen_frames / len(frames) if frames else 0.0
    text = (
        f"seen {100.0 * seen:.0f} %"
        if short
        else f"seen in {100.0 * seen:.0f} % of {counted(len(frames), 'frame')}"
    )
    if history.confirmed_s is None:
        text += ", never confirmed"
    if matches is not None:
        text += f", person {person_ids_text(matches)}" + ("" if short else " of the truth")
    kind = "person" if history.samples[0].status == "given" else "track"
    axes.set_title(f"{kind} {history.id}", fontsize=10, loc="left", color=colour, weight="bold")
    axes.set_title(text, fontsize=9, loc="right", color=TEXT_COLOUR)
