"""The film of one crossing with three robots, side by side: faces, numbers, and the hall."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.drawing import Colour, Font, awareness_colour, draw_disc, draw_line, fill_hull
from awarenav.video import VideoWriter
from perception import AttentionCone
from perception.arrays import FloatArray, ImageRgb

from ..crossing import CrossingFrame, CrossingResult, RequestMemory
from ._comparison import (
    FILM_HZ,
    PORTRAIT_PX,
    WITHOUT_AWARENESS,
    ComparisonRow,
    largest_radius_m,
    lowest_bound,
    time_behind_s,
    time_lost_s,
)

#: Time for which the last picture, with the results, is shown.
HOLD_S: Final = 4.0

_GAP_PX: Final = 12
_LEGEND_PX: Final = 34
_LEGEND: Final = (
    "circle: obstacle · cone: where the worker looks · outline: robot with nobody there"
    " · α: lower bound"
)

#: Width and height of a panel, pixels.
PANEL_PX: Final = (320, 826)

_MAP_TOP_PX: Final = 282
_MAP_PX: Final = (320, 468)
#: Pixels per metre of the map; the way of the robot points up.
MAP_PX_PER_M: Final = 32.5
_MAP_CENTRE_M: Final = np.array([6.35, 0.0])

_BACKGROUND: Final[Colour] = (255, 255, 255)
_FLOOR: Final[Colour] = (238, 239, 241)
_RACK: Final[Colour] = (176, 182, 190)
_INK: Final[Colour] = (28, 30, 36)
_QUIET: Final[Colour] = (96, 100, 110)
_GHOST: Final[Colour] = (130, 134, 142)
_BAD: Final[Colour] = (190, 30, 30)

_LARGE: Final = Font(33, weight=600)
_TEXT: Final = Font(27, weight=600)
_SMALL: Final = Font(24, weight=500)

_BODY_RADIUS_M: Final = 0.24
_HEAD_RADIUS_M: Final = 0.13
# Radii of the rings around a person who is asked to look.
_WAVES_M: Final = (0.45, 0.65)
_CONE_LENGTH_M: Final = 1.6
# The line that shows where the robot faces.
_NOSE_M: Final = np.array([[0.0, 0.0], [0.62, 0.0]])
_PLATE: Final[Colour] = (214, 217, 222)

#: Rows of the comparison that the film shows: title, note and colour of the panel.
PANELS: Final[dict[str, tuple[str, str, Colour]]] = {
    "today's AMR": ("Scanners only", "today's AMR", (31, 78, 121)),
    "aware, attentive worker": ("Aware robot", "worker watches it", (46, 125, 79)),
    "aware, distracted worker": ("Aware robot", "worker looks away", (190, 105, 25)),
}


def write_crossing_film(paths: Sequence[Path], rows: Sequence[ComparisonRow]) -> None:
    """Write the film of crossings side by side, in real time; each panel stands still at its end.

    Args:
        paths: files to write, each ``.webp`` (animated image) or ``.mp4``.
        rows: the comparison. The first row is the crossing with nobody there, against which time
            is lost; the film shows today's robot and the aware one with both workers.

    Raises:
        AwarenavError: for another kind of file.
    """
    free = rows[0].result
    shown = [row for row in rows if row.label in PANELS]
    with ExitStack() as stack:
        writers = [
            stack.enter_context(VideoWriter(path, FILM_HZ, film_size_px(len(shown))))
            for path in paths
        ]
        for picture in film_pictures(shown, free):
            for writer in writers:
                writer.add(picture)
        for writer in writers:
            for _ in range(round(HOLD_S * FILM_HZ) - 1):
                writer.add(picture)


def film_size_px(panels: int) -> tuple[int, int]:
    """Return width and height of a film, both even."""
    width = panels * (PANEL_PX[0] + _GAP_PX) + _GAP_PX
    height = PANEL_PX[1] + _GAP_PX + _LEGEND_PX
    return width + width % 2, height + height % 2


def film_pictures(rows: Sequence[ComparisonRow], free: CrossingResult) -> Iterator[ImageRgb]:
    """Yield the pictures of the film, from the start to the end of the longest crossing."""
    width, height = film_size_px(len(rows))
    end_s = max(row.result.frames[-1].t_s for row in rows)
    for number in range(math.ceil(end_s * FILM_HZ - 1e-6) + 1):
        image = np.full((height, width, 3), 255, np.uint8)
        for column, row in enumerate(rows):
            left = _GAP_PX + column * (PANEL_PX[0] + _GAP_PX)
            panel = draw_panel(row, free, number)
            image[_GAP_PX : _GAP_PX + PANEL_PX[1], left : left + PANEL_PX[0]] = panel
        _SMALL.write(image, _LEGEND, (_GAP_PX + 8, height - _LEGEND_PX), (96, 100, 110))
        yield image


def draw_panel(row: ComparisonRow, free: CrossingResult, picture: int) -> ImageRgb:
    """Draw one crossing at one time; after its end the panel stands still.

    Args:
        row: the crossing, one of :data:`PANELS`.
        free: the same crossing with nobody there.
        picture: number of the picture in the film.

    Returns:
        An (H, W, 3) RGB image of :data:`PANEL_PX`.
    """
    title, note, colour = PANELS[row.label]
    index = frame_index(row.result, picture / FILM_HZ)
    image = np.full((PANEL_PX[1], PANEL_PX[0], 3), _BACKGROUND, np.uint8)
    image[:6] = colour
    _LARGE.write(image, title, (8, 12), _INK)
    _SMALL.write(image, note, (8, 46), _QUIET)
    _draw_portrait(image, row.portraits, picture)
    _write_numbers(image, row.result.frames[index], row.result.policy in WITHOUT_AWARENESS)
    bottom = _MAP_TOP_PX + _MAP_PX[1]
    image[_MAP_TOP_PX:bottom] = draw_map(row, free, picture / FILM_HZ)
    _write_clock(image, row.result, free, index, bottom + 4)
    return image


def frame_index(result: CrossingResult, t_s: float) -> int:
    """Return the index of the newest frame at ``t_s``; the last one after the end."""
    times = [frame.t_s for frame in result.frames]
    # A rounding error must not select the frame before.
    return max(int(np.searchsorted(times, t_s + 1e-9, side="right")) - 1, 0)


def _draw_portrait(image: ImageRgb, portraits: tuple[ImageRgb | None, ...], picture: int) -> None:
    left, top = 8, 80
    width, height = PORTRAIT_PX
    place = image[top : top + height, left : left + width]
    portrait = portraits[min(picture, len(portraits) - 1)] if portraits else None
    if portrait is not None:
        place[:] = portrait
        return
    place[:] = _PLATE
    for row, text in enumerate(("out of", "view") if portraits else ("no", "camera")):
        x = left + (width - _TEXT.width_px(text)) // 2
        _TEXT.write(image, text, (x, top + 46 + 29 * row), _QUIET)


def _write_numbers(image: ImageRgb, frame: CrossingFrame, unused: bool) -> None:
    left, top = 158, 80
    alpha, radius_m = lowest_bound(frame), largest_radius_m(frame)
    if unused or alpha is None:
        _LARGE.write(image, "α unused" if unused else "α –", (left, top), _QUIET)
    else:
        draw_disc(image, np.array([left + 9.0, top + 19.0]), 9.0, awareness_colour(alpha))
        _LARGE.write(image, f"α ≥ {alpha:.2f}", (left + 26, top), _INK)
    radius = "–" if radius_m is None else f"{radius_m:.2f} m"
    _TEXT.write(image, f"radius {radius}", (left, top + 38), _INK)
    _LARGE.write(image, f"{frame.robot_state.travel_mps:.2f} m/s", (left, top + 72), _INK)
    limit = frame.constraints
    _TEXT.write(image, f"limit {limit.speed_limit_mps:.2f} m/s", (left, top + 110), _INK)
    rule = limit.limited_by.rpartition(": ")[2]  # without the person's number
    _SMALL.write(image, f"limited by {rule}", (8, 240), _QUIET)


def _write_clock(
    image: ImageRgb, result: CrossingResult, free: CrossingResult, index: int, top: int
) -> None:
    frame, colour, below = result.frames[index], _INK, ""
    if index < len(result.frames) - 1:
        clock, lost_s = f"{frame.t_s:.1f} s", time_behind_s(frame, free)
    else:
        clock, lost_s = "not at the goal", time_lost_s(result, free)
        if result.time_to_goal_s is not None:
            clock = f"goal {result.time_to_goal_s:.2f} s"
            below = f"passed at up to {result.max_speed_within_2m_mps:.2f} m/s"
        if result.contact:
            below = "touched the worker"
        if result.contact or result.time_to_goal_s is None:
            colour = _BAD
        image[top - 2 : top + 40] = _PLATE
    lost = "" if lost_s is None else f"{lost_s:.1f} s lost"
    _LARGE.write(image, clock, (8, top), colour)
    _LARGE.write(image, lost, (PANEL_PX[0] - 8 - _LARGE.width_px(lost), top), colour)
    _TEXT.write(image, below, (8, top + 40), colour)


def draw_map(row: ComparisonRow, free: CrossingResult, t_s: float) -> ImageRgb:
    """Draw the hall from above, the robot's way pointing up.

    Shows racks, the worker with head and attention cone, each obstacle as its circle, the robot,
    requests to look and their answers, and as an outline the robot that meets nobody.
    """
    result, robot = row.result, PANELS[row.label][2]
    index = frame_index(result, t_s)
    frame = result.frames[index]
    image = np.full((_MAP_PX[1], _MAP_PX[0], 3), _FLOOR, np.uint8)
    for x0, y0, x1, y1 in row.scenario.layout.obstacle_boxes_odom:
        fill_hull(image, map_px(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])), _RACK, 1.0)
    blind = result.policy in WITHOUT_AWARENESS
    for obstacle in frame.constraints.obstacles:
        colour = awareness_colour(None if blind else obstacle.awareness_lower)
        ring = obstacle.center_odom_m + obstacle.radius_m * _circle()
        fill_hull(image, map_px(ring), colour, 0.30)
        draw_line(image, map_px(ring), colour, 2)
    path = np.array([each.robot_state.position_odom_m for each in result.frames[: index + 1]])
    draw_line(image, map_px(path), robot, 1)
    for number in range(len(frame.truth)):
        walked = [each.truth[number].position_odom_m for each in result.frames[: index + 1]]
        draw_line(image, map_px(np.array(walked)), _GHOST, 1)
        _draw_person(image, frame, number)
    ghost = free.frames[frame_index(free, t_s)]
    draw_line(image, map_px(_footprint(ghost, free)), _GHOST, 2)
    fill_hull(image, map_px(_footprint(frame, result)), robot, 1.0)
    draw_line(image, map_px(_placed(frame, _NOSE_M)), robot, 3)
    _draw_requests(image, result, index, robot)
    return image


def _draw_requests(image: ImageRgb, result: CrossingResult, index: int, asks: Colour) -> None:
    memory = RequestMemory()
    for each in result.frames[: index + 1]:
        memory.take(each)
    for row, request in enumerate(memory.shown(result.frames[index])):
        colour = awareness_colour(1.0) if request.answered else asks
        _SMALL.write(image, request.text, (8, 6 + 28 * row), _INK)
        if request.place_odom_m is not None:
            for radius_m in _WAVES_M:
                ring = request.place_odom_m + radius_m * _circle()
                draw_line(image, map_px(ring), colour, 2)


def map_px(points_odom_m: FloatArray) -> FloatArray:
    """Return where points (N, 2) of the hall are on the map: x in odom up, y to the left."""
    shifted = (np.asarray(points_odom_m) - _MAP_CENTRE_M) * MAP_PX_PER_M
    return np.stack([0.5 * _MAP_PX[0] - shifted[:, 1], 0.5 * _MAP_PX[1] - shifted[:, 0]], axis=1)


def _draw_person(image: ImageRgb, frame: CrossingFrame, number: int) -> None:
    view = frame.truth[number]
    gaze = (frame.T_odom_camera[:3, :3] @ view.gaze_camera)[:2]
    heading = math.atan2(gaze[1], gaze[0])
    half = AttentionCone().half_angle_rad
    angles = np.linspace(-half, half, 15) + heading
    arc = view.position_odom_m + _CONE_LENGTH_M * np.stack([np.cos(angles), np.sin(angles)], 1)
    sector = map_px(np.vstack([view.position_odom_m, arc]))
    fill_hull(image, sector, _INK, 0.22)
    draw_line(image, np.vstack([sector, sector[:1]]), _INK, 1)
    centre = map_px(view.position_odom_m[None])
    draw_disc(image, centre, _BODY_RADIUS_M * MAP_PX_PER_M, _QUIET)
    draw_disc(image, centre, _HEAD_RADIUS_M * MAP_PX_PER_M, _INK)
    nose = view.position_odom_m + 0.32 * np.array([math.cos(heading), math.sin(heading)])
    draw_line(image, map_px(np.stack([view.position_odom_m, nose])), _INK, 3)


def _circle() -> FloatArray:
    angles = np.linspace(0.0, 2.0 * math.pi, 65)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _placed(frame: CrossingFrame, points_m: FloatArray) -> FloatArray:
    """Return points (N, 2) of the robot's base frame in odom."""
    cos, sin = (f(frame.robot_state.heading_odom_rad) for f in (math.cos, math.sin))
    turned = points_m @ np.array([[cos, -sin], [sin, cos]]).T
    return np.asarray(turned + frame.robot_state.position_odom_m)


def _footprint(frame: CrossingFrame, result: CrossingResult) -> FloatArray:
    """Return the closed outline (N, 2) of the robot in odom."""
    corners = _placed(frame, result.robot.footprint_m)
    return np.vstack([corners, corners[:1]])
