"""The plan view: paths of tracks, truth and camera from above, in the odom frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray
from tracking.smoothing import SmoothedPath

from ..errors import counted
from ..figures import Axes, Ellipse, Wedge
from ._history import TrackedRecording, TrackHistory, TrackSample
from ._page import BACKGROUND_COLOUR, CAMERA_COLOUR, FAINT_COLOUR, TEXT_COLOUR
from ._truth import MAX_TRUTH_GAP_S, TruePerson

#: Line width and style of each status of a track.
LINE_STYLES: Final[dict[str, tuple[float, tuple[float, tuple[float, ...]]]]] = {
    "tentative": (0.8, (0.0, ())),
    "confirmed": (2.0, (0.0, ())),
    "coasting": (1.4, (0.0, (2.0, 1.4))),
    "given": (2.0, (0.0, ())),
}
#: Look of a smoothed path.
SMOOTHED_LINE: Final[dict[str, Any]] = {"color": TEXT_COLOUR, "linewidth": 0.9, "alpha": 0.85}
# Most ellipses and fields of view along a path.
_MOST_ELLIPSES: Final = 8
_MOST_VIEWS: Final = 5
# A slower person gets no arrows.
_STANDING_MPS: Final = 0.2
_MARGIN_M: Final = 1.0
_MIN_EXTENT_M: Final = 3.0
_ELLIPSE_SIGMAS: Final = 2.0


def plan_limits(
    tracked: TrackedRecording, people: Sequence[TruePerson]
) -> tuple[float, float, float, float]:
    """Return x_min, x_max, y_min, y_max (m) of camera and tracks; of people without any track.

    The limits span at least 3 m. People of the truth that were not tracked may lie outside.
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
    x_min, y_min = (centre - half).tolist()
    x_max, y_max = (centre + half).tolist()
    return x_min, x_max, y_min, y_max


def draw_plan(
    axes: Axes,
    tracked: TrackedRecording,
    coloured: Sequence[tuple[TrackHistory, str]],
    others: Sequence[TrackHistory],
    people: Sequence[TruePerson],
    camera: Camera | None,
    smoothed: Mapping[int, SmoothedPath],
) -> None:
    """Draw camera, truth and tracks into axes that have their limits and equal scales.

    Args:
        axes: to draw into.
        tracked: has the camera's path.
        coloured: tracks with their colours.
        others: tracks that are drawn grey and without their ids.
        people: of the truth; may be empty.
        camera: gives the field of view; None draws only the direction of view.
        smoothed: paths by the ids of tracks; those of coloured tracks are drawn.
    """
    extent_m = float(np.ptp(axes.get_xlim()))
    _draw_camera(axes, tracked.camera_poses, camera, 0.12 * extent_m)
    for person in people:
        x, y = _with_gaps(person.stamps_s, person.positions_odom_m).T
        axes.plot(x, y, color=TEXT_COLOUR, linewidth=1.0, linestyle=(0, (1.0, 1.6)), zorder=6)
    for history in others:
        _draw_path(axes, history, FAINT_COLOUR, None)
    for history, colour in coloured:
        _draw_path(axes, history, colour, extent_m / 14.0)
        if history.id in smoothed:
            x, y = smoothed[history.id].states[:, :2].T
            axes.plot(x, y, zorder=6, **SMOOTHED_LINE)
    for history, colour in coloured:
        _draw_ends(axes, history, colour)
    if not tracked.histories:
        text = f"no people in {counted(len(tracked.camera_stamps_s), 'frame')}"
        place: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "transform": axes.transAxes,
            "zorder": 9,
        }
        axes.text(
            0.5,
            0.75,
            text,
            fontsize=16,
            color=TEXT_COLOUR,
            backgroundcolor=BACKGROUND_COLOUR,
            **place,
        )
    axes.set_xlabel("odom x (m)")
    axes.set_ylabel("odom y (m)")
    axes.grid(alpha=0.3, linewidth=0.6)


def view_edges_rad(camera: Camera) -> tuple[float, float]:
    """Return the angles of the image's right and left edge from straight ahead, left positive."""
    row = camera.cy_px
    # Pixel centres are at whole numbers.
    edges = np.array([[camera.width_px - 0.5, row], [-0.5, row]])
    right, left = (-np.arctan(camera.normalise(edges, nearest=True)[:, 0])).tolist()
    return right, left


def _draw_camera(axes: Axes, poses: FloatArray, camera: Camera | None, length_m: float) -> None:
    """Draw the camera's path, and its field of view at some poses."""
    if not len(poses):
        return
    axes.plot(poses[:, 0], poses[:, 1], color=CAMERA_COLOUR, linewidth=1.6, zorder=2)
    right, left = (-0.02, 0.02) if camera is None else view_edges_rad(camera)
    moved = np.ptp(poses[:, :2], axis=0).max() > 0.05 or np.ptp(np.unwrap(poses[:, 2])) > 0.05
    rows = np.linspace(0, len(poses) - 1, _MOST_VIEWS if moved else 1).round().astype(int)
    for x, y, heading in poses[np.unique(rows)].tolist():
        axes.add_patch(
            Wedge(
                (x, y),
                length_m,
                math.degrees(heading + right),
                math.degrees(heading + left),
                facecolor=CAMERA_COLOUR,
                edgecolor=CAMERA_COLOUR,
                linewidth=0.6,
                alpha=0.16,
                zorder=1,
            )
        )
        axes.plot(x, y, marker="s", markersize=4.5, color=CAMERA_COLOUR, zorder=2)


def _draw_path(axes: Axes, history: TrackHistory, colour: str, arrows_m: float | None) -> None:
    """Draw the path of a track; with ``arrows_m``, also ellipses, and arrows at this distance."""
    for status, segment in history.segments():
        width, style = LINE_STYLES[status]
        x, y = np.array([sample.position_odom_m for sample in segment]).T
        axes.plot(x, y, color=colour, linewidth=width, linestyle=style, zorder=4)
    if arrows_m is None:
        return
    for sample in _ellipse_samples(history):
        if sample.position_covariance_m2 is not None:
            ellipse = covariance_ellipse(
                sample.position_odom_m, sample.position_covariance_m2, colour
            )
            axes.add_patch(ellipse)
    for x, y, heading in path_arrows(history, arrows_m):
        triangle = (3, 0, math.degrees(heading) - 90.0)
        axes.plot(x, y, marker=triangle, markersize=7.5, color=colour, zorder=5)


def _draw_ends(axes: Axes, history: TrackHistory, colour: str) -> None:
    """Mark birth and death of a track, and write its id."""
    x, y = history.samples[0].position_odom_m.tolist()
    axes.plot(
        x, y, marker="o", markersize=7, markerfacecolor=BACKGROUND_COLOUR, color=colour, zorder=7
    )
    axes.annotate(
        str(history.id),
        (x, y),
        (5, 6),
        textcoords="offset points",
        fontsize=10,
        fontweight="bold",
        color=colour,
        bbox={
            "boxstyle": "round,pad=0.12",
            "facecolor": BACKGROUND_COLOUR,
            "edgecolor": "none",
            "alpha": 0.75,
        },
        zorder=9,
    )
    if history.died_s is not None:
        x, y = history.samples[-1].position_odom_m.tolist()
        axes.plot(x, y, marker="x", markersize=8, markeredgewidth=2.2, color=colour, zorder=8)


def _ellipse_samples(history: TrackHistory) -> list[TrackSample]:
    """Return samples at least 1 s apart, further apart in a long history, and the last sample."""
    life_s = history.samples[-1].stamp_s - history.born_s
    every_s = max(1.0, life_s / _MOST_ELLIPSES)
    chosen = []
    next_s = history.born_s + every_s
    for sample in history.samples:
        if sample.stamp_s >= next_s:
            chosen.append(sample)
            next_s = sample.stamp_s + every_s
    if not chosen or chosen[-1] is not history.samples[-1]:
        chosen.append(history.samples[-1])
    return chosen


def covariance_ellipse(centre_m: FloatArray, covariance_m2: FloatArray, colour: str) -> Ellipse:
    """Return the ellipse of two standard deviations."""
    values, vectors = np.linalg.eigh(covariance_m2)
    height, width = (2.0 * _ELLIPSE_SIGMAS * np.sqrt(np.maximum(values, 0.0))).tolist()
    angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
    x, y = centre_m.tolist()
    return Ellipse(
        (x, y),
        width,
        height,
        angle=angle,
        facecolor="none",
        edgecolor=colour,
        linewidth=0.8,
        alpha=0.65,
        zorder=3,
    )


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


def _with_gaps(stamps_s: FloatArray, points: FloatArray) -> FloatArray:
    """Return the points with a row of NaN at each gap of the stamps, which breaks the line."""
    gaps = np.flatnonzero(np.diff(stamps_s) > MAX_TRUTH_GAP_S) + 1
    return np.asarray(np.insert(points, gaps, np.nan, axis=0))
