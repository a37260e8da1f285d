"""The film of an aisle: what the robot's camera sees, and three robots in the aisle from above."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.drawing import (
    DARK,
    WHITE,
    Colour,
    Font,
    awareness_colour,
    draw_disc,
    draw_line,
    fill_hull,
)
from awarenav.video import VideoWriter
from perception.arrays import ImageRgb

from ..crossing import (
    STANDING_SPEED_MPS,
    CrossingFrame,
    CrossingResult,
    MapScale,
    RequestMemory,
)
from ..scenario import Scenario
from ._camera_film import CAMERA_PX, PICTURE_S, CameraPicture

#: Pictures per second: the film runs at twice the real speed.
FILM_HZ: Final = 10
#: Time for which the first picture, with the results, is shown.
HOLD_S: Final = 3.0

FILM_PX: Final = (780, 576)
# Height of a line of text. At a width of 390 px its letters have a size of 12 px.
_LINE_PX: Final = 33

_EDGE_PX: Final = 8
_LANE_LEFT_PX: Final = _EDGE_PX + CAMERA_PX[0] + 12
_LANE_PX: Final = (FILM_PX[0] - _EDGE_PX - _LANE_LEFT_PX, 188)
_MAP_PX: Final = (_LANE_PX[0], _LANE_PX[1] - 2 * _LINE_PX - 8)

_QUIET: Final[Colour] = (172, 176, 186)
_FLOOR: Final[Colour] = (52, 56, 66)
_RACK: Final[Colour] = (96, 102, 116)
_ROBOT: Final[Colour] = (126, 200, 255)
_BAD: Final[Colour] = (255, 122, 108)

_TITLE: Final = Font(_LINE_PX, weight=650)
_TEXT: Final = Font(_LINE_PX, weight=450)

_BODY_RADIUS_M: Final = 0.26
_CONE_LENGTH_M: Final = 1.3
# Radii of the rings around a person who is asked to look.
_WAVES_M: Final = (0.45, 0.65)
# A circle farther than this from a person is not theirs.
_SAME_PERSON_M: Final = 0.8
# A slower robot counts as stopping.
_STOPPING_MPS: Final = 0.05
_MARGIN_M: Final = 0.7
# Of each sign: whether it is a ring, α, and what it says.
_LEGEND: Final = (
    (False, 1.0, "has noticed"),
    (False, 0.0, "has not"),
    (True, 0.0, "kept free: unaware"),
    (True, 0.5, "kept free: partly sure"),
)

#: Policies that ignore awareness: α says nothing about what the robot does.
WITHOUT_AWARENESS: Final = ("blind", "scanner", "scanner_warning")

#: Rows of the comparison that the film shows, and the title of each lane.
LANES: Final[dict[str, str]] = {
    "today-costmap": "Today: costmap AMR",
    "blind": "Slow for everybody",
    "awarenav": "awarenav",
}


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison."""

    label: str
    result: CrossingResult
    scenario: Scenario
    pictures: tuple[CameraPicture, ...] = ()


def time_lost_s(result: CrossingResult, free: CrossingResult) -> float | None:
    """Return how much later a robot arrives than with nobody there; None if one never arrives."""
    if result.time_to_goal_s is None or free.time_to_goal_s is None:
        return None
    return result.time_to_goal_s - free.time_to_goal_s


@dataclass(frozen=True, slots=True)
class Passage:
    """The moment at which a moving robot comes nearest to a person."""

    t_s: float
    distance_m: float
    speed_mps: float
    hit: bool = False


def unaware_person(result: CrossingResult) -> int:
    """Return the number of the person who looks least at the robot."""
    since_s = np.array([[view.since_look_s for view in frame.truth] for frame in result.frames])
    return int((since_s <= 0.0).mean(axis=0).argmin())


def passage(result: CrossingResult, person: int) -> Passage:
    """Return the moment at which the moving robot is nearest to a person: the fastest touch."""
    touches = [
        contact
        for contact in result.contacts
        if contact.worker == person and contact.robot_speed_mps > STANDING_SPEED_MPS
    ]
    if touches:
        fastest = max(touches, key=lambda contact: contact.robot_speed_mps)
        return Passage(fastest.t_s, 0.0, fastest.robot_speed_mps, fastest.by == "robot")
    moving = [
        frame
        for frame in result.frames
        if abs(frame.robot_state.travel_mps) > STANDING_SPEED_MPS and frame.separations_m
    ]
    nearest = min(moving, key=lambda frame: frame.separations_m[person])
    return Passage(nearest.t_s, nearest.separations_m[person], nearest.robot_state.travel_mps)


def write_crossing_film(paths: Sequence[Path], rows: Sequence[ComparisonRow]) -> None:
    """Write the film; its first picture shows the results.

    Args:
        paths: files to write, each ``.webp`` (animated image) or ``.mp4``.
        rows: the comparison. The first row is the crossing with nobody there, against which time
            is lost; the film shows those of :data:`LANES`.
    """
    with ExitStack() as stack:
        writers = [stack.enter_context(VideoWriter(path, FILM_HZ, FILM_PX)) for path in paths]
        for number, picture in enumerate(film_pictures(rows)):
            for _ in range(round(HOLD_S * FILM_HZ) if number == 0 else 1):
                for writer in writers:
                    writer.add(picture)


def film_pictures(rows: Sequence[ComparisonRow]) -> Iterator[ImageRgb]:
    """Yield the pictures of the film: the results, then all robots from the start to the goal."""
    free = rows[0].result
    shown = [row for row in rows if row.label in LANES]
    person = unaware_person(shown[0].result)
    seeing = next(row for row in shown[::-1] if row.pictures)
    yield _picture(shown, free, person, None, decisive_picture(seeing).rgb)
    # Who never arrives would make the film long.
    arrived = [row for row in shown if row.result.time_to_goal_s is not None]
    end_s = max(row.result.frames[-1].t_s for row in arrived or shown)
    for number in range(math.ceil(end_s / PICTURE_S - 1e-6) + 1):
        camera = seeing.pictures[min(number, len(seeing.pictures) - 1)].rgb
        yield _picture(shown, free, person, number * PICTURE_S, camera)


def decisive_picture(row: ComparisonRow) -> CameraPicture:
    """Return the last picture of the camera that shows most people as a whole."""
    most = max(len(each.whole) for each in row.pictures)
    return next(each for each in row.pictures[::-1] if len(each.whole) == most)


def _picture(
    rows: Sequence[ComparisonRow],
    free: CrossingResult,
    person: int,
    t_s: float | None,
    camera: ImageRgb,
) -> ImageRgb:
    """Draw a picture of the film at a time; None for the results."""
    image: ImageRgb = np.full((FILM_PX[1], FILM_PX[0], 3), DARK, np.uint8)
    _TITLE.write(image, "What awarenav sees", (_EDGE_PX, 4), WHITE)
    top = _LINE_PX + 10
    image[top : top + CAMERA_PX[1], _EDGE_PX : _EDGE_PX + CAMERA_PX[0]] = camera
    _write_legend(image, top + CAMERA_PX[1] + 10)
    for number, row in enumerate(rows):
        corner = _LANE_LEFT_PX, 4 + number * (_LANE_PX[1] + 2)
        lane = image[corner[1] : corner[1] + _LANE_PX[1], corner[0] : corner[0] + _LANE_PX[0]]
        lane[:] = draw_lane(row, free, person, t_s)
    return image


def _write_legend(image: ImageRgb, top: int) -> None:
    """Write each sign beside the one before, or where the room ends, below."""
    left = _EDGE_PX
    for is_ring, alpha, text in _LEGEND:
        width = 38 + _TEXT.width_px(text)
        if left + width > _LANE_LEFT_PX:
            left, top = _EDGE_PX, top + _LINE_PX + 2
        middle = np.array([left + 14.0, top + 0.5 * _LINE_PX])
        draw_disc(image, middle, 12.5 if is_ring else 11.0, awareness_colour(alpha))
        if is_ring:
            draw_disc(image, middle, 9.5, DARK)
        _TEXT.write(image, text, (left + 38, top), WHITE)
        left += width + 14


def draw_lane(row: ComparisonRow, free: CrossingResult, person: int, t_s: float | None) -> ImageRgb:
    """Draw one robot in the aisle at one time, with its title and two figures.

    Args:
        row: the crossing, one of :data:`LANES`.
        free: the same crossing with nobody there.
        person: number of the person whose passage is shown.
        t_s: the time; None for the results and the moment nearest to the person.

    Returns:
        An (H, W, 3) RGB image.
    """
    result = row.result
    image: ImageRgb = np.full((_LANE_PX[1], _LANE_PX[0], 3), DARK, np.uint8)
    near = passage(result, person)
    end = t_s is None or t_s >= result.frames[-1].t_s - 1e-9
    _TITLE.write(image, LANES[row.label], (0, 0), WHITE)
    lost = time_lost_s(result, free)
    if not end:
        _write_right(image, _TEXT, f"{t_s:.1f} s", 0, _QUIET)
    elif lost is None:
        _write_right(image, _TITLE, "no goal", 0, _BAD)
    else:
        _write_right(image, _TITLE, f"{round(lost, 1) + 0.0:.1f} s lost", 0, WHITE)
    image[_LINE_PX : _LINE_PX + _MAP_PX[1]] = draw_map(row, t_s)
    bottom = _LINE_PX + _MAP_PX[1]
    if t_s is not None and t_s < near.t_s:
        frame = result.frames[frame_index(result, t_s)]
        _TEXT.write(image, f"{frame.robot_state.travel_mps:.1f} m/s", (0, bottom), _QUIET)
    elif near.distance_m <= 0.0:
        verb = "hits" if near.hit else "touched"
        _TITLE.write(image, f"{verb} at {near.speed_mps:.1f} m/s", (0, bottom), _BAD)
    else:
        stops = near.speed_mps < _STOPPING_MPS
        speed = ", stopping" if stops else f" at {near.speed_mps:.1f} m/s"
        text = f"nearest {near.distance_m:.2f} m{speed}"
        _TEXT.write(image, text, (0, bottom), WHITE)
    return image


def _write_right(image: ImageRgb, font: Font, text: str, top: int, colour: Colour) -> None:
    font.write(image, text, (image.shape[1] - font.width_px(text), top), colour)


def frame_index(result: CrossingResult, t_s: float) -> int:
    """Return the index of the newest frame at ``t_s``; the last one after the end."""
    times = [frame.t_s for frame in result.frames]
    # A rounding error must not select the frame before.
    return max(int(np.searchsorted(times, t_s + 1e-9, side="right")) - 1, 0)


def draw_map(row: ComparisonRow, t_s: float | None) -> ImageRgb:
    """Draw the aisle from above, the robot's way pointing right.

    Shows racks, people with their attention cones in the colour of their awareness, each obstacle
    as its circle in the colour of the bound that the robot uses (grey: it uses none), the robot
    with the way it has come, and requests to look. Without a time each person is drawn at the
    moment at which the robot is nearest to them.

    Returns:
        An (H, W, 3) RGB image.
    """
    result, place = row.result, scale_of(row)
    image = place.hall(row.scenario.layout.obstacle_boxes_odom, _FLOOR, _RACK)
    people = range(len(result.frames[0].truth))
    times_s = [passage(result, each).t_s if t_s is None else t_s for each in people]
    if t_s is not None:
        times_s.append(t_s)  # where the robot is with nobody there
    indices = [frame_index(result, each) for each in times_s]
    for number, index in zip(people, indices, strict=False):
        _draw_circle(image, result, number, index, place)
    path = np.array([each.robot_state.position_odom_m for each in result.frames])
    draw_line(image, place.px(path[: None if t_s is None else indices[-1] + 1]), _ROBOT, 2)
    for number, index in zip(people, indices, strict=False):
        _draw_person(image, result.frames[index], number, place)
    for index in set(indices):
        outline = place.robot(result.frames[index], result.robot.footprint_m)
        fill_hull(image, outline, _ROBOT, 1.0)
    if t_s is not None:
        _draw_requests(image, result, indices[-1], place)
    return image


def _draw_circle(
    image: ImageRgb, result: CrossingResult, person: int, index: int, place: MapScale
) -> None:
    frame = result.frames[index]
    where = frame.truth[person].position_odom_m
    for obstacle in frame.constraints.obstacles:
        if float(np.hypot(*(obstacle.center_odom_m - where))) > _SAME_PERSON_M:
            continue
        ignored = result.policy in WITHOUT_AWARENESS
        colour = awareness_colour(None if ignored else obstacle.awareness_lower)
        ring = place.ring(obstacle.center_odom_m, obstacle.radius_m)
        fill_hull(image, ring, colour, 0.25)
        draw_line(image, ring, colour, 3)


def scale_of(row: ComparisonRow) -> MapScale:
    """Return the scale at which the robot's way fills the width of the map."""
    task = row.scenario.robot
    length_m = abs(task.goal_x_m - task.start_x_m) + 2.0 * _MARGIN_M
    middle = 0.5 * np.array([task.start_x_m + task.goal_x_m, task.start_y_m + task.goal_y_m])
    return MapScale(_MAP_PX[0] / length_m, middle, _MAP_PX)


def _draw_requests(image: ImageRgb, result: CrossingResult, index: int, place: MapScale) -> None:
    memory = RequestMemory()
    for each in result.frames[: index + 1]:
        memory.take(each)
    for request in memory.shown(result.frames[index]):
        colour = awareness_colour(1.0) if request.answered else WHITE
        if request.place_odom_m is not None:
            for radius_m in _WAVES_M:
                draw_line(image, place.ring(request.place_odom_m, radius_m), colour, 2)


def _draw_person(image: ImageRgb, frame: CrossingFrame, number: int, place: MapScale) -> None:
    view = frame.truth[number]
    sector = place.gaze(frame, view, view.position_odom_m, _CONE_LENGTH_M)
    colour = awareness_colour(view.awareness)
    fill_hull(image, sector, colour, 0.45)
    centre = place.px(view.position_odom_m[None])
    draw_disc(image, centre, _BODY_RADIUS_M * place.px_per_m + 1.5, DARK)
    draw_disc(image, centre, _BODY_RADIUS_M * place.px_per_m, colour)
