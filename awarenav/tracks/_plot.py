"""The plot of ``awarenav tracks``: a plan view, and a panel with the awareness of each track.

Recordings without a camera tell nothing of awareness, so they have the plan view alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from perception import Camera
from tracking.smoothing import SmoothedPath

from ..figures import Axes, Figure, Line2D, Patch
from ._awareness_panel import draw_awareness
from ._history import TrackedRecording, TrackHistory
from ._page import (
    BACKGROUND_COLOUR,
    CAMERA_COLOUR,
    FAINT_COLOUR,
    TEXT_COLOUR,
    UNSEEN_COLOUR,
    Page,
    track_colour,
)
from ._plan_view import LINE_STYLES, SMOOTHED_LINE, draw_plan, plan_limits
from ._truth import Truth

# Sizes, margins and gaps in inches.
_WIDTH: Final = 12.0
_LEFT: Final = 0.75
_RIGHT: Final = 0.3
_TOP: Final = 0.75
_BOTTOM: Final = 0.6
_LEGEND_WIDTH: Final = 2.35
_MIN_PLAN_HEIGHT: Final = 4.3
_MAX_PLAN_HEIGHT: Final = 6.6
_PLAN_GAP: Final = 0.95
_ROW_GAP: Final = 0.34
_COLUMN_GAP: Final = 0.4
# Height of a panel in one column, and in several.
_WIDE_ROW_HEIGHT: Final = 1.35
_NARROW_ROW_HEIGHT: Final = 1.05


def shown_tracks(
    histories: Sequence[TrackHistory], most: int
) -> tuple[list[TrackHistory], list[TrackHistory]]:
    """Return the tracks that get a colour and a panel, in the order of their ids, and all others.

    They are those that were seen in most frames, among the tracks that were ever confirmed; if none
    was, among all tracks.
    """
    confirmed = [each for each in histories if each.confirmed_s is not None]
    ranked = sorted(confirmed or histories, key=lambda each: (-each.seen_frames, each.id))
    shown = sorted(ranked[:most], key=lambda each: each.id)
    ids = {each.id for each in shown}
    return shown, [each for each in histories if each.id not in ids]


def tracks_figure(
    tracked: TrackedRecording,
    title: str,
    *,
    camera: Camera | None = None,
    truth: Truth | None = None,
    smoothed: Mapping[int, SmoothedPath] | None = None,
    most: int = 20,
) -> Figure:
    """Draw the tracks of a recording.

    Args:
        tracked: the tracks.
        title: of the figure.
        camera: for its field of view.
        truth: is drawn dotted in black.
        smoothed: paths by the ids of tracks, drawn thin in black over those with a colour.
        most: most tracks with a colour and a panel; a line of text gives the number of others.
    """
    shown, others = shown_tracks(tracked.histories, most)
    people = () if truth is None else truth.people
    coloured = [(each, track_colour(index)) for index, each in enumerate(shown)]
    limits = plan_limits(tracked, people)
    plan_width = _WIDTH - _LEFT - _RIGHT - _LEGEND_WIDTH
    plan_height = plan_width * (limits[3] - limits[2]) / (limits[1] - limits[0])
    plan_height = min(max(plan_height, _MIN_PLAN_HEIGHT), _MAX_PLAN_HEIGHT)
    with_camera = bool(len(tracked.camera_poses))
    panels = coloured if with_camera else []
    columns = 1 if len(panels) <= 6 else 2 if len(panels) <= 12 else 3
    rows = math.ceil(len(panels) / columns)
    row_height = _WIDE_ROW_HEIGHT if columns == 1 else _NARROW_ROW_HEIGHT
    height = _TOP + plan_height + _BOTTOM
    if panels:
        height += _PLAN_GAP + rows * (row_height + _ROW_GAP)

    page = Page(_WIDTH, height)
    page.write(_LEFT, 0.3, title, size=12, weight="bold")
    page.write(_LEFT, 0.58, _note_on_others(others), size=9.5)
    plan = page.axes(_LEFT, _TOP, plan_width, plan_height)
    _set_plan_limits(plan, limits, plan_width / plan_height)
    draw_plan(plan, tracked, coloured, others, people, camera, smoothed or {})
    _draw_legends(
        page.figure,
        plan,
        0.1 / _WIDTH,
        with_tracker=_has_tracker(tracked),
        truth=truth is not None,
        smoothed=bool(smoothed),
        with_camera=with_camera,
        field_of_view=camera is not None,
    )
    panel_width = (_WIDTH - _LEFT - _RIGHT + _COLUMN_GAP) / columns - _COLUMN_GAP
    for index, (history, colour) in enumerate(panels):
        row, column = index % rows, index // rows
        panel = page.axes(
            _LEFT + column * (panel_width + _COLUMN_GAP),
            _TOP + plan_height + _PLAN_GAP + row * (row_height + _ROW_GAP),
            panel_width,
            row_height,
        )
        _set_time_limits(panel, tracked.span_s)
        matches = None if truth is None else truth.matches.get(history.id, [])
        draw_awareness(panel, history, colour, matches, short_title=columns > 2)
        panel.set_ylabel("awareness α" if column == 0 else "")
        last = row == rows - 1 or index == len(panels) - 1
        panel.set_xlabel("stamp (s)" if last else "")
        panel.tick_params(labelbottom=last)
    return page.figure


def _draw_legends(
    figure: Figure,
    plan: Axes,
    gap: float,
    *,
    with_tracker: bool,
    truth: bool,
    smoothed: bool,
    with_camera: bool,
    field_of_view: bool,
) -> None:
    """Draw the legends of plan and panels to the right of the plan.

    Args:
        figure: to draw into.
        plan: axes of the plan.
        gap: between both, as a share of the figure's width.
        with_tracker: whether a tracker made the tracks.
        truth: whether the truth is drawn.
        smoothed: whether smoothed paths are drawn.
        with_camera: whether there is a camera, and with it a legend of the panels.
        field_of_view: whether the camera's field of view is drawn.
    """

    def line(style: str, label: str) -> Line2D:
        width, dashes = LINE_STYLES[style]
        return Line2D([], [], color=TEXT_COLOUR, linewidth=width, linestyle=dashes, label=label)

    def mark(marker: str, label: str, **more: Any) -> Line2D:
        looks: dict[str, Any] = {"color": TEXT_COLOUR, "linestyle": "none", "markersize": 7, **more}
        return Line2D([], [], marker=marker, label=label, **looks)

    plan_marks: list[Line2D | Patch] = [
        *(
            [
                line("confirmed", "confirmed"),
                line("tentative", "tentative"),
                line("coasting", "coasting (not seen)"),
            ]
            if with_tracker
            else [line("given", "person of the file")]
        ),
        mark(">", "direction of time"),
        mark("o", "birth", markerfacecolor=BACKGROUND_COLOUR),
        mark("x", "death", markeredgewidth=2.2),
        mark("o", "2σ of position", markerfacecolor="none", markersize=10, markeredgewidth=0.8),
    ]
    if with_camera:
        plan_marks.append(mark("s", "camera", color=CAMERA_COLOUR, markersize=5))
    if smoothed:
        plan_marks.append(Line2D([], [], label="smoothed", **SMOOTHED_LINE))
    if field_of_view:
        plan_marks.append(Patch(facecolor=CAMERA_COLOUR, alpha=0.2, label="its field of view"))
    awareness_marks: list[Line2D | Patch] = [
        Line2D([], [], color=TEXT_COLOUR, linewidth=2.2, label="lower bound, which counts"),
        Line2D([], [], color=TEXT_COLOUR, linewidth=0.9, label="α"),
        Patch(facecolor=TEXT_COLOUR, alpha=0.2, label="α ± 1 σ"),
        mark(".", "α of one frame", markersize=5, alpha=0.6),
        mark("|", "seen, no evidence", color=FAINT_COLOUR, markersize=6),
        Patch(facecolor=UNSEEN_COLOUR, label="not seen"),
    ]
    if not with_tracker:
        awareness_marks = awareness_marks[3:]
    if truth:
        dotted: dict[str, Any] = {
            "color": TEXT_COLOUR,
            "linewidth": 1.1,
            "linestyle": (0, (1.0, 1.6)),
        }
        plan_marks.append(Line2D([], [], label="truth", **dotted))
        awareness_marks.append(Line2D([], [], label="true α", **dotted))
    box = plan.get_position()
    left = box.x1 + gap
    style: dict[str, Any] = {
        "frameon": False,
        "fontsize": 9.5,
        "title_fontsize": 10,
        "alignment": "left",
    }
    figure.legend(
        handles=plan_marks,
        title="From above",
        loc="upper left",
        bbox_to_anchor=(left, box.y1 + 0.01),
        **style,
    )
    if with_camera:
        figure.legend(
            handles=awareness_marks,
            title="Awareness over time",
            loc="lower left",
            bbox_to_anchor=(left, box.y0 - 0.02),
            **style,
        )


def _has_tracker(tracked: TrackedRecording) -> bool:
    """Return whether a tracker made the tracks."""
    return not any(each.samples[0].status == "given" for each in tracked.histories)


def _set_time_limits(axes: Axes, span_s: tuple[float, float]) -> None:
    slack_s = max(0.01 * (span_s[1] - span_s[0]), 0.02)
    axes.set_xlim(span_s[0] - slack_s, span_s[1] + slack_s)


def _set_plan_limits(axes: Axes, limits: tuple[float, float, float, float], aspect: float) -> None:
    """Widen the limits to the aspect ratio of the axes, so that both scales are equal."""
    x_min, x_max, y_min, y_max = limits
    width, height = x_max - x_min, y_max - y_min
    if width < aspect * height:
        x_min, x_max = _widened(x_min, x_max, aspect * height)
    else:
        y_min, y_max = _widened(y_min, y_max, width / aspect)
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(y_min, y_max)
    axes.set_aspect("equal", adjustable="box")


def _widened(low: float, high: float, length: float) -> tuple[float, float]:
    middle = 0.5 * (low + high)
    return middle - 0.5 * length, middle + 0.5 * length


def _note_on_others(others: Sequence[TrackHistory]) -> str:
    """Return a line of text about the tracks without a panel; empty if there are none."""
    unconfirmed = sum(each.confirmed_s is None for each in others)
    parts = []
    if unconfirmed:
        parts.append(f"{unconfirmed} never confirmed")
    if len(others) > unconfirmed:
        parts.append(f"{len(others) - unconfirmed} beyond the most that are shown")
    return f"grey, without a panel: {' and '.join(parts)}" if parts else ""
