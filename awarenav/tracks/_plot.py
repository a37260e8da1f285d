"""The plot of ``awarenav tracks``: people from above, and a panel with α of each track.

Recordings without a camera tell nothing of awareness, so they have the plan view alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray

from ..errors import counted
from ..figures import Axes, Ellipse, Figure, GridSpec, Line2D, Patch, Wedge, new_figure
from ._history import TrackedRecording, TrackHistory
from ._smoothing import SmoothedPath
from ._truth import MAX_TRUTH_GAP_S, TruePerson, Truth, TruthMatch, person_ids_text

_TEXT: Final = "#28282e"
_FAINT: Final = "#8a8f98"
_UNSEEN: Final = "#e4e5e9"
_CAMERA: Final = "#26548c"
# Ten hues that are dark enough for a thin line on white, then the same hues darker or duller.
_TRACK_COLOURS: Final = (
    *("#1f77b4", "#d95f02", "#2e8b45", "#c2185b", "#7b4fb5"),
    *("#8c5a3c", "#00929e", "#a08800", "#e0403a", "#5c6470"),
    *("#0b3f78", "#8a3c00", "#0f5227", "#75003a", "#44207c"),
    *("#4d2a14", "#004f57", "#574a00", "#86110d", "#22272e"),
)
# Line width and style of each status of a track.
_LINES: Final[dict[str, dict[str, Any]]] = {
    "tentative": {"linewidth": 0.8},
    "confirmed": {"linewidth": 2.0},
    "coasting": {"linewidth": 1.4, "linestyle": (0.0, (2.0, 1.4))},
    "given": {"linewidth": 2.0},
}
_SMOOTHED: Final[dict[str, Any]] = {"color": _TEXT, "linewidth": 0.9, "alpha": 0.85}
_TRUTH: Final[dict[str, Any]] = {"color": _TEXT, "linewidth": 1.1, "linestyle": (0.0, (1.0, 1.6))}
# Sizes in inches; a panel is higher in one column than in several.
_WIDTH: Final = 12.0
_MIN_PLAN_HEIGHT: Final = 4.6
_MAX_PLAN_HEIGHT: Final = 7.0
_WIDE_ROW_HEIGHT: Final = 1.7
_NARROW_ROW_HEIGHT: Final = 1.4
# Most ellipses and fields of view along a path.
_MOST_ELLIPSES: Final = 8
_MOST_VIEWS: Final = 5
_ELLIPSE_SIGMAS: Final = 2.0
# A slower person gets no arrows.
_STANDING_MPS: Final = 0.2
_MARGIN_M: Final = 1.0
_MIN_EXTENT_M: Final = 3.0
# Height of the marks of frames that show the person without evidence, below α = 0.
_NO_EVIDENCE_MARK: Final = -0.085


def track_colour(index: int) -> str:
    """Return the colour of the track with this index; the colours repeat after twenty."""
    return _TRACK_COLOURS[index % len(_TRACK_COLOURS)]


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
    panels = coloured if len(tracked.camera_poses) else []
    columns = 1 if len(panels) <= 6 else 2 if len(panels) <= 12 else 3
    rows = math.ceil(len(panels) / columns)
    low, high = plan_limits(tracked, people)
    plan_height = _WIDTH * (high - low)[1] / (high - low)[0]
    heights = [float(np.clip(plan_height, _MIN_PLAN_HEIGHT, _MAX_PLAN_HEIGHT))]
    heights += [_WIDE_ROW_HEIGHT if columns == 1 else _NARROW_ROW_HEIGHT] * rows

    figure = new_figure(_WIDTH, sum(heights), dpi=150.0)
    grid = GridSpec(1 + rows, columns, figure, height_ratios=heights)
    figure.suptitle(title, fontsize=12, weight="bold", color=_TEXT)
    plan = figure.add_subplot(grid[0, :])
    plan.set_title(_note_on_others(others), fontsize=9.5, loc="left", color=_TEXT)
    extent_m = float((high - low).max())
    _draw_camera(plan, tracked.camera_poses, camera, 0.12 * extent_m)
    _draw_people(plan, coloured, others, people, smoothed or {}, arrows_m=extent_m / 14.0)
    # Equal scales may widen these limits: matplotlib warns of that unless they are automatic.
    plan.set_aspect("equal", adjustable="datalim")
    plan.set_xlim(low[0], high[0], auto=True)
    plan.set_ylim(low[1], high[1], auto=True)
    if not tracked.histories:
        text = f"no people in {counted(len(tracked.camera_stamps_s), 'frame')}"
        middle: dict[str, Any] = {"ha": "center", "transform": plan.transAxes, "zorder": 9}
        plan.text(0.5, 0.75, text, fontsize=16, color=_TEXT, backgroundcolor="white", **middle)
    start_s, end_s = tracked.span_s
    slack_s = max(0.01 * (end_s - start_s), 0.02)
    for index, (history, colour) in enumerate(panels):
        row, column = index % rows, index // rows
        panel = figure.add_subplot(grid[1 + row, column])
        panel.set_xlim(start_s - slack_s, end_s + slack_s)
        matches = None if truth is None else truth.matches.get(history.id, [])
        _draw_awareness(panel, history, colour, matches)
        _write_title(panel, history, colour, matches, short=columns > 2)
        panel.set_ylabel("awareness α" if column == 0 else "")
        last = row == rows - 1 or index == len(panels) - 1
        panel.set_xlabel("stamp (s)" if last else "")
        panel.tick_params(labelbottom=last)
    _draw_legends(figure, tracked, camera, truth=truth is not None, smoothed=bool(smoothed))
    return figure


def plan_limits(
    tracked: TrackedRecording, people: Sequence[TruePerson]
) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper corner, (2,) each, m, of camera and tracks.

    The limits span at least 3 m. People of the truth count only where nobody was tracked.
    """
    points = [tracked.camera_poses[:, :2]]
    points += [history.positions_odom_m for history in tracked.histories]
    if not tracked.histories:
        points += [person.positions_odom_m for person in people]
    every = np.vstack(points)
    if not len(every):
        every = np.zeros((1, 2))
    low, high = every.min(axis=0), every.max(axis=0)
    half = np.maximum(0.5 * (high - low) + _MARGIN_M, 0.5 * _MIN_EXTENT_M)
    centre = 0.5 * (low + high)
    return centre - half, centre + half


def view_edges_rad(camera: Camera) -> tuple[float, float]:
    """Return the angles of the image's right and left edge from straight ahead, left positive."""
    row = camera.cy_px
    # Pixel centres are at whole numbers.
    edges = np.array([[camera.width_px - 0.5, row], [-0.5, row]])
    right, left = (-np.arctan(camera.normalise(edges, nearest=True)[:, 0])).tolist()
    return right, left


def _draw_camera(axes: Axes, poses: FloatArray, camera: Camera | None, length_m: float) -> None:
    """Draw the camera's path, and its field of view at some poses; without one, its direction."""
    if not len(poses):
        return
    axes.plot(poses[:, 0], poses[:, 1], color=_CAMERA, linewidth=1.6, zorder=2)
    right, left = (-0.02, 0.02) if camera is None else view_edges_rad(camera)
    moved = np.ptp(poses[:, :2], axis=0).max() > 0.05 or np.ptp(np.unwrap(poses[:, 2])) > 0.05
    rows = np.linspace(0, len(poses) - 1, _MOST_VIEWS if moved else 1).round().astype(int)
    for x, y, heading in poses[np.unique(rows)].tolist():
        angles_deg = math.degrees(heading + right), math.degrees(heading + left)
        view = Wedge((x, y), length_m, *angles_deg, color=_CAMERA, lw=0.6, alpha=0.16, zorder=1)
        axes.add_patch(view)
        axes.plot(x, y, marker="s", markersize=4.5, color=_CAMERA, zorder=2)


def _draw_people(
    axes: Axes,
    coloured: Sequence[tuple[TrackHistory, str]],
    others: Sequence[TrackHistory],
    people: Sequence[TruePerson],
    smoothed: Mapping[int, SmoothedPath],
    *,
    arrows_m: float,
) -> None:
    """Draw truth and tracks from above.

    Args:
        axes: to draw into.
        coloured: tracks with their colours.
        others: tracks that are drawn grey and without their ids.
        people: of the truth; may be empty.
        smoothed: paths by the ids of tracks; those of coloured tracks are drawn.
        arrows_m: distance of the arrows along a path.
    """
    for person in people:
        gaps = np.flatnonzero(np.diff(person.stamps_s) > MAX_TRUTH_GAP_S) + 1
        x, y = np.insert(person.positions_odom_m, gaps, np.nan, axis=0).T
        axes.plot(x, y, zorder=6, **_TRUTH)
    for history, colour in [*((each, _FAINT) for each in others), *coloured]:
        for status, segment in history.segments():
            x, y = np.array([sample.position_odom_m for sample in segment]).T
            axes.plot(x, y, color=colour, zorder=4, **_LINES[status])
    for history, colour in coloured:
        _draw_ellipses(axes, history, colour)
        for x, y, heading in path_arrows(history, arrows_m):
            triangle = (3, 0, math.degrees(heading) - 90.0)
            axes.plot(x, y, marker=triangle, markersize=7.5, color=colour, zorder=5)
        if history.id in smoothed:
            x, y = smoothed[history.id].states[:, :2].T
            axes.plot(x, y, zorder=6, **_SMOOTHED)
        x, y = history.samples[0].position_odom_m.tolist()
        axes.plot(x, y, "o", markersize=7, markerfacecolor="white", color=colour, zorder=7)
        box = {"boxstyle": "round,pad=0.12", "facecolor": "white", "alpha": 0.75, "linewidth": 0}
        name: dict[str, Any] = {"fontweight": "bold", "color": colour, "bbox": box, "zorder": 9}
        axes.annotate(str(history.id), (x, y), (5, 6), textcoords="offset points", **name)
        if history.died_s is not None:
            x, y = history.samples[-1].position_odom_m.tolist()
            axes.plot(x, y, "x", markersize=8, markeredgewidth=2.2, color=colour, zorder=8)
    axes.set_xlabel("odom x (m)")
    axes.set_ylabel("odom y (m)")
    axes.grid(alpha=0.3, linewidth=0.6)


def _draw_ellipses(axes: Axes, history: TrackHistory, colour: str) -> None:
    """Draw ellipses at least 1 s apart, further apart in a long history, and at its end."""
    last = history.samples[-1]
    every_s = max(1.0, (last.stamp_s - history.born_s) / _MOST_ELLIPSES)
    next_s = history.born_s + every_s
    for sample in history.samples:
        if sample.stamp_s < next_s and sample is not last:
            continue
        next_s = sample.stamp_s + every_s
        if sample.position_covariance_m2 is not None:
            place, covariance = sample.position_odom_m, sample.position_covariance_m2
            axes.add_patch(covariance_ellipse(place, covariance, colour))


def covariance_ellipse(centre_m: FloatArray, covariance_m2: FloatArray, colour: str) -> Ellipse:
    """Return the ellipse of two standard deviations."""
    values, vectors = np.linalg.eigh(covariance_m2)
    height, width = (2.0 * _ELLIPSE_SIGMAS * np.sqrt(np.maximum(values, 0.0))).tolist()
    angle_deg = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": colour, "linewidth": 0.8}
    x, y = centre_m.tolist()
    return Ellipse((x, y), width, height, angle=angle_deg, alpha=0.65, zorder=3, **look)


def path_arrows(history: TrackHistory, every_m: float) -> list[tuple[float, float, float]]:
    """Return x, y (m) and heading (rad) of arrows along the path of a walking person."""
    arrows = []
    distance_m = 0.5 * every_m  # so that the first arrow is near the start
    for before, sample in zip(history.samples, history.samples[1:], strict=False):
        step = sample.position_odom_m - before.position_odom_m
        distance_m += float(np.linalg.norm(step))
        velocity = sample.velocity_odom_mps
        if velocity is None:
            velocity = step / (sample.stamp_s - before.stamp_s)
        vx, vy = velocity.tolist()
        if distance_m >= every_m and math.hypot(vx, vy) > _STANDING_MPS:
            x, y = sample.position_odom_m.tolist()
            arrows.append((x, y, math.atan2(vy, vx)))
            distance_m = 0.0
    return arrows


def _draw_awareness(
    axes: Axes, history: TrackHistory, colour: str, matches: Sequence[TruthMatch] | None
) -> None:
    """Draw α with its standard deviation, the lower bound, the measured α, and the unseen times.

    Args:
        axes: to draw into.
        history: of the track.
        colour: of the track.
        matches: of the track with people of the truth; None without truth.
    """
    axes.set(ylim=(-0.15, 1.06), yticks=[0.0, 0.5, 1.0])
    axes.grid(axis="y", alpha=0.3, linewidth=0.6)
    for start_s, end_s in history.unseen_spans():
        axes.axvspan(start_s, end_s, color=_UNSEEN, linewidth=0, zorder=0)
    stamps = history.stamps_s
    alpha, std = history.values("awareness"), history.values("awareness_std")
    low, high = np.clip(alpha - std, 0.0, 1.0), np.clip(alpha + std, 0.0, 1.0)
    if len(stamps) == 1:  # a line through one point would be invisible
        axes.errorbar(stamps, alpha, std, color=colour, linewidth=0.9, marker="_", zorder=3)
    axes.fill_between(stamps, low, high, color=colour, alpha=0.2, linewidth=0, zorder=1)
    axes.plot(stamps, alpha, color=colour, linewidth=0.9, zorder=3)
    axes.plot(stamps, history.values("awareness_lower"), color=colour, linewidth=2.2, zorder=5)
    measured = history.values("measured_awareness")
    axes.plot(stamps, measured, ".", color=colour, markersize=3.2, alpha=0.55, zorder=2)
    blind_s = [s.stamp_s for s in history.frames if s.seen and s.measured_awareness is None]
    marks = np.full(len(blind_s), _NO_EVIDENCE_MARK)
    axes.plot(blind_s, marks, "|", color=_FAINT, markersize=4, markeredgewidth=0.8, zorder=2)
    if matches:
        stamps_s = np.array([match.stamp_s for match in matches])
        true = np.array([match.awareness for match in matches])
        people = np.array([match.person_id for match in matches])
        # The line is broken at gaps, and where the person changes.
        gaps = np.flatnonzero((np.diff(stamps_s) > MAX_TRUTH_GAP_S) | (np.diff(people) != 0)) + 1
        axes.plot(
            np.insert(stamps_s, gaps, np.nan), np.insert(true, gaps, np.nan), zorder=6, **_TRUTH
        )
    floor = axes.get_ylim()[0]
    end: dict[str, Any] = {"color": colour, "clip_on": False, "zorder": 8}
    axes.plot(history.born_s, floor, "o", markersize=6, markerfacecolor="white", **end)
    if history.died_s is not None:
        axes.plot(history.died_s, floor, "x", markersize=7, markeredgewidth=2, **end)


def _write_title(
    axes: Axes,
    history: TrackHistory,
    colour: str,
    matches: Sequence[TruthMatch] | None,
    *,
    short: bool,
) -> None:
    """Write the track's id, how often it is seen, and the person that it follows."""
    frames = history.frames
    share = 100.0 * history.seen_frames / len(frames) if frames else 0.0
    text = f"seen {share:.0f} %"
    if not short:
        text = f"seen in {share:.0f} % of {counted(len(frames), 'frame')}"
    if history.confirmed_s is None:
        text += ", never confirmed"
    if matches is not None:
        text += f", person {person_ids_text(matches)}" + ("" if short else " of the truth")
    kind = "person" if history.samples[0].status == "given" else "track"
    axes.set_title(f"{kind} {history.id}", fontsize=10, loc="left", color=colour, weight="bold")
    axes.set_title(text, fontsize=9, loc="right", color=_TEXT)


def _draw_legends(
    figure: Figure, tracked: TrackedRecording, camera: Camera | None, *, truth: bool, smoothed: bool
) -> None:
    """Draw the legends of what the plan and the panels show to the right of them."""

    def line(label: str, **look: Any) -> Line2D:
        return Line2D([], [], label=label, **{"color": _TEXT, **look})

    def mark(marker: str, label: str, **look: Any) -> Line2D:
        return line(label, marker=marker, **{"linestyle": "none", "markersize": 7, **look})

    given = any(each.samples[0].status == "given" for each in tracked.histories)
    statuses = {
        "confirmed": "confirmed",
        "tentative": "tentative",
        "coasting": "coasting (not seen)",
    }
    if given:
        statuses = {"given": "person of the file"}
    plan: list[Line2D | Patch] = [
        *(line(label, **_LINES[status]) for status, label in statuses.items()),
        mark(">", "direction of time"),
        mark("o", "birth", markerfacecolor="white"),
        mark("x", "death", markeredgewidth=2.2),
        mark("o", "2σ of position", markerfacecolor="none", markersize=10, markeredgewidth=0.8),
    ]
    panels: list[Line2D | Patch] = [
        line("lower bound, which counts", linewidth=2.2),
        line("α", linewidth=0.9),
        Patch(facecolor=_TEXT, alpha=0.2, label="α ± 1 σ"),
        mark(".", "α of one frame", markersize=5, alpha=0.6),
        mark("|", "seen, no evidence", color=_FAINT, markersize=6),
        Patch(facecolor=_UNSEEN, label="not seen"),
    ]
    if given:
        panels = panels[3:]
    if len(tracked.camera_poses):
        plan.append(mark("s", "camera", color=_CAMERA, markersize=5))
    if smoothed:
        plan.append(line("smoothed", **_SMOOTHED))
    if camera is not None:
        plan.append(Patch(facecolor=_CAMERA, alpha=0.2, label="its field of view"))
    if truth:
        plan.append(line("truth", **_TRUTH))
        panels.append(line("true α", **_TRUTH))
    style: dict[str, Any] = {"frameon": False, "fontsize": 9.5, "alignment": "left"}
    figure.legend(handles=plan, title="From above", loc="outside right upper", **style)
    if len(tracked.camera_poses):
        title = "Awareness over time"
        figure.legend(handles=panels, title=title, loc="outside right lower", **style)


def _note_on_others(others: Sequence[TrackHistory]) -> str:
    """Return a line of text about the tracks without a panel; empty if there are none."""
    unconfirmed = sum(each.confirmed_s is None for each in others)
    parts = []
    if unconfirmed:
        parts.append(f"{unconfirmed} never confirmed")
    if len(others) > unconfirmed:
        parts.append(f"{len(others) - unconfirmed} beyond the most that are shown")
    return f"grey, without a panel: {' and '.join(parts)}" if parts else ""
