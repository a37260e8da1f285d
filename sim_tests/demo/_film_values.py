"""The numbers that the film of a crossing shows, taken from the recorded frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray, ImageRgb

from ..crossing import CrossingFrame, CrossingResult

#: Policies that ignore awareness: α says nothing about what the robot does.
WITHOUT_AWARENESS: Final = ("blind", "scanner")


@dataclass(frozen=True, slots=True, eq=False)
class FilmRun:
    """A crossing as one panel of the film.

    Attributes:
        title: the robot, in at most 20 letters.
        note: the worker or the sensors, in at most 30 letters.
        colour: of the panel, RGB.
        result: the crossing, with its frames.
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls.
        portraits: the worker in the robot's camera, one for each picture of the film; None where
            the camera does not show the worker. Empty for a robot without a camera.
    """

    title: str
    note: str
    colour: tuple[int, int, int]
    result: CrossingResult
    boxes_odom_m: FloatArray
    portraits: tuple[ImageRgb | None, ...]


@dataclass(frozen=True, slots=True)
class FilmValues:
    """The numbers of one panel at one time.

    Attributes:
        t_s: time of the frame.
        alpha: lower bound of α that the robot acts on, the lowest of all obstacles; None without
            an obstacle, and for a policy that ignores awareness.
        radius_m: largest radius of the obstacles; None without an obstacle.
        speed_mps: speed of the robot.
        speed_limit_mps: speed limit.
        limited_by: the rule that set the limit, without the person's number.
        lost_s: time behind a robot that meets nobody; None where that robot does not arrive.
        finished: whether the crossing is over.
    """

    t_s: float
    alpha: float | None
    radius_m: float | None
    speed_mps: float
    speed_limit_mps: float
    limited_by: str
    lost_s: float | None
    finished: bool


def frame_index(result: CrossingResult, t_s: float) -> int:
    """Return the index of the newest frame at ``t_s``; the last one after the end."""
    times = [frame.t_s for frame in result.frames]
    # A rounding error must not select the frame before.
    return max(int(np.searchsorted(times, t_s + 1e-9, side="right")) - 1, 0)


def film_values(result: CrossingResult, free: CrossingResult, t_s: float) -> FilmValues:
    """Return the numbers of a crossing at a time.

    Args:
        result: the crossing.
        free: the same crossing with nobody there.
        t_s: time since the start; after the end, the last frame counts.
    """
    index = frame_index(result, t_s)
    frame = result.frames[index]
    constraints = frame.constraints
    alpha = None if result.policy in WITHOUT_AWARENESS else lowest_bound(frame)
    finished = index == len(result.frames) - 1
    return FilmValues(
        t_s=frame.t_s,
        alpha=alpha,
        radius_m=largest_radius_m(frame),
        speed_mps=frame.robot_state.travel_mps,
        speed_limit_mps=constraints.speed_limit_mps,
        limited_by=constraints.limited_by.rpartition(": ")[2],
        lost_s=time_lost_s(result, free) if finished else time_behind_s(frame, free),
        finished=finished,
    )


def lowest_bound(frame: CrossingFrame) -> float | None:
    """Return the lowest bound of α that was used for an obstacle; None without obstacles."""
    return min((each.awareness_lower for each in frame.constraints.obstacles), default=None)


def largest_radius_m(frame: CrossingFrame) -> float | None:
    """Return the largest radius of the obstacles; None without obstacles."""
    return max((each.radius_m for each in frame.constraints.obstacles), default=None)


def time_lost_s(result: CrossingResult, free: CrossingResult) -> float | None:
    """Return how much later a robot arrives than with nobody there; None if one never arrives."""
    if result.time_to_goal_s is None or free.time_to_goal_s is None:
        return None
    return result.time_to_goal_s - free.time_to_goal_s


def time_behind_s(frame: CrossingFrame, free: CrossingResult) -> float | None:
    """Return the time since the free robot was as far along its way as this robot is now.

    None where the free robot does not arrive.
    """
    if free.time_to_goal_s is None:
        return None
    places = np.array([each.robot_state.position_odom_m for each in free.frames])
    way = places[-1] - places[0]
    way /= max(math.hypot(*way.tolist()), 1e-9)
    along = np.maximum.accumulate((places - places[0]) @ way)
    now = float((frame.robot_state.position_odom_m - places[0]) @ way)
    # Standing at the start counts as lost time, too.
    first = int(np.searchsorted(along, now, side="left"))
    if first == 0 or first == len(along):
        was_there_s = free.frames[min(first, len(along) - 1)].t_s
    else:
        times = [free.frames[each].t_s for each in (first - 1, first)]
        was_there_s = float(np.interp(now, along[first - 1 : first + 1], times))
    return max(frame.t_s - was_there_s, 0.0)
