"""What lines and marks of the picture mean.

The whole picture: a plan of the paths, and beneath it the awareness of each track.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from perception import Camera

from ..figures import Axes, Figure, Line2D, Patch
from ._awareness_panel import draw_awareness
from ._history import TrackHistory, TrackRun
from ._page import CAMERA, FAINT, INK, PAPER, SHADE, Page, colour_of
from ._plan_view import STYLES, draw_plan, plan_limits
from ._truth import Truth


def draw_legends(
    figure: Figure, plan: Axes, gap: float, *, given: bool, truth: bool, field_of_view: bool
) -> None:
    """Explain the plan and the panels, to the right of the plan.

    Args:
        figure: to draw into.
        plan: the plan's axes.
        gap: between both, as a share of the figure's width.
        given: the identities come without a tracker.
        truth: there is truth beside them.
        field_of_view: the camera's is drawn.
    """

    def line(style: str, label: str) -> Line2D:
        width, dashes = STYLES[style]
        return Line2D([], [], color=INK, linewidth=width, linestyle=dashes, label=label)

    def mark(marker: str, label: str, **more: Any) -> Line2D:
        looks: dict[str, Any] = {"color": INK, "linestyle": "none", "markersize": 7, **more}
        return Line2D([], [], marker=marker, label=label, **looks)

    plan_marks: list[Line2D | Patch] = [
        *(
            [line("given", "person of the file")]
            if given
            else [
                line("confirmed", "confirmed"),
                line("tentative", "tentative"),
                line("coasting", "coasting (not seen)"),
            ]
        ),
        mark(">", "direction of time"),
        mark("o", "birth", markerfacecolor=PAPER),
        mark("x", "death", markeredgewidth=2.2),
        mark("o", "2σ of position", markerfacecolor="none", markersize=10, markeredgewidth=0.8),
        mark("s", "camera", color=CAMERA, markersize=5),
    ]
    if field_of_view:
        plan_marks.append(Patch(facecolor=CAMERA, alpha=0.2, label="its field of view"))
    awareness_marks: list[Line2D | Patch] = [
        Line2D([], [], color=INK, linewidth=2.2, label="lower bound, which counts"),
        Line2D([], [], color=INK, linewidth=0.9, label="α"),
        Patch(facecolor=INK, alpha=0.2, label="α ± 1 σ"),
        mark(".", "α of one frame", markersize=5, alpha=0.6),
        mark("|", "seen, no evidence", color=FAINT, markersize=6),
        Patch(facecolor=SHADE, label="not seen"),
    ]
    if given:
        awareness_marks = awareness_marks[3:]
    if truth:
        dotted: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (1.0, 1.6))}
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
    figure.legend(
        handles=awareness_marks,
        title="Awareness over time",
        loc="lower left",
        bbox_to_anchor=(left, box.y0 - 0.02),
        **style,
    )


# Inches.
_WIDTH: Final = 12.0
_LEFT: Final = 0.75
_RIGHT: Final = 0.3
_TOP: Final = 0.75
_BOTTOM: Final = 0.6
_LEGEND: Final = 2.35
_PLAN_HEIGHT: Final = (4.3, 6.6)
_ROW_HEIGHT: Final = (1.35, 1.05)
_BETWEEN_PARTS: Final = 0.95
_BETWEEN_ROWS: Final = 0.34
_BETWEEN_COLUMNS: Final = 0.4


def shown_tracks(
    histories: Sequence[TrackHistory], most: int
) -> tuple[list[TrackHistory], list[TrackHistory]]:
    """The tracks that get a colour and a panel, in the order of their ids, and all others.

    Those that were ever confirmed come first, then those that were seen in most frames.
    """
    confirmed = [each for each in histories if each.confirmed_s is not None]
    ranked = sorted(confirmed or histories, key=lambda each: (-each.seen_frames, each.id))
    shown = sorted(ranked[:most], key=lambda each: each.id)
    ids = {each.id for each in shown}
    return shown, [each for each in histories if each.id not in ids]


def tracks_figure(
    run: TrackRun,
    title: str,
    *,
    camera: Camera | None = None,
    truth: Truth | None = None,
    most: int = 20,
) -> Figure:
    """Draw a run.

    Args:
        run: the tracks.
        title: what was tracked.
        camera: for its field of view.
        truth: drawn dotted in black where it is given.
        most: tracks with a colour and a panel at most; a line says how many are left out.
    """
    shown, others = shown_tracks(run.histories, most)
    people = () if truth is None else truth.people
    coloured = [(each, colour_of(index)) for index, each in enumerate(shown)]
    limits = plan_limits(run, people)
    plan_width = _WIDTH - _LEFT - _RIGHT - _LEGEND
    plan_height = plan_width * (limits[3] - limits[2]) / (limits[1] - limits[0])
    plan_height = min(max(plan_height, _PLAN_HEIGHT[0]), _PLAN_HEIGHT[1])
    columns = 1 if len(shown) <= 6 else 2 if len(shown) <= 12 else 3
    rows = math.ceil(len(shown) / columns)
    row_height = _ROW_HEIGHT[0 if columns == 1 else 1]
    height = _TOP + plan_height + _BOTTOM
    if shown:
        height += _BETWEEN_PARTS + rows * (row_height + _BETWEEN_ROWS)

    page = Page(_WIDTH, height)
    page.write(_LEFT, 0.3, title, size=12, weight="bold")
    page.write(_LEFT, 0.58, _left_out(others), size=9.5)
    plan = page.axes(_LEFT, _TOP, plan_width, plan_height)
    _set_limits(plan, limits, plan_width / plan_height)
    draw_plan(plan, run, coloured, others, people, camera)
    draw_legends(
        page.figure,
        plan,
        0.1 / _WIDTH,
        given=_is_given(run),
        truth=truth is not None,
        field_of_view=camera is not None,
    )
    panel_width = (_WIDTH - _LEFT - _RIGHT + _BETWEEN_COLUMNS) / columns - _BETWEEN_COLUMNS
    for index, (history, colour) in enumerate(coloured):
        row, column = index % rows, index // rows
        panel = page.axes(
            _LEFT + column * (panel_width + _BETWEEN_COLUMNS),
            _TOP + plan_height + _BETWEEN_PARTS + row * (row_height + _BETWEEN_ROWS),
            panel_width,
            row_height,
        )
        _set_times(panel, run.span_s)
        matched = None if truth is None else truth.matches.get(history.id, [])
        draw_awareness(panel, history, colour, matched, brief=columns > 2)
        panel.set_ylabel("awareness α" if column == 0 else "")
        last = row == rows - 1 or index == len(coloured) - 1
        panel.set_xlabel("stamp (s)" if last else "")
        panel.tick_params(labelbottom=last)
    return page.figure


def _is_given(run: TrackRun) -> bool:
    """Whether the identities come without a tracker."""
    return any(each.samples[0].status == "given" for each in run.histories)


def _set_times(axes: Axes, span_s: tuple[float, float]) -> None:
    slack_s = max(0.01 * (span_s[1] - span_s[0]), 0.02)
    axes.set_xlim(span_s[0] - slack_s, span_s[1] + slack_s)


def _set_limits(axes: Axes, limits: tuple[float, float, float, float], aspect: float) -> None:
    """Limits that hold everything and make a metre as long along x as along y."""
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


def _left_out(others: Sequence[TrackHistory]) -> str:
    """What has no panel, in words."""
    fleeting = sum(each.confirmed_s is None for each in others)
    parts = []
    if fleeting:
        parts.append(f"{fleeting} never confirmed")
    if len(others) > fleeting:
        parts.append(f"{len(others) - fleeting} beyond the most that are shown")
    return f"grey, without a panel: {' and '.join(parts)}" if parts else ""
