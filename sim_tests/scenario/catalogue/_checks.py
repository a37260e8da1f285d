"""Where everybody would be if nobody reacted to anybody.

What makes a scenario impossible to act out, and whether robot and people meet in it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ...actors.behaviour import PersonSpec
from ...actors.robot import NOVA_CARTER
from ...world import crosses_boxes
from .._scenario import RobotTask, Scenario
from .._template import ScenarioTemplate


def robot_plan(task: RobotTask, t_s: FloatArray) -> FloatArray:
    """(T, 2) odom positions of a robot that drives straight to its goal, speeding up first.

    It drives at its maximum speed, or at the task's own, and stands at its goal.
    """
    start = np.array([task.start_x_m, task.start_y_m])
    goal = np.array([task.goal_x_m, task.goal_y_m])
    length = float(np.linalg.norm(goal - start))
    speed = task.straight_on_speed_mps or NOVA_CARTER.max_speed_mps
    rising_s = speed / NOVA_CARTER.max_acceleration_mps2
    rising = np.minimum(t_s, rising_s)
    driven = 0.5 * NOVA_CARTER.max_acceleration_mps2 * rising**2 + speed * (t_s - rising)
    share = np.minimum(driven / max(length, 1e-9), 1.0)
    return np.asarray(start + share[:, None] * (goal - start))


def person_plan(spec: PersonSpec, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (T, 2) in odom and length walked (T,) of a person who reacts to nothing.

    The person walks the route at the free speed with its pauses, and back if that is planned.
    """
    corners = np.array([[point.x_m, point.y_m] for point in spec.route])
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(legs)])
    turn_m = spec.turns_back_at_m
    if turn_m is None or turn_m >= reached[-1]:
        turn_m, way_m = float(reached[-1]), float(reached[-1])
    else:
        way_m = 2.0 * turn_m
    # Knots of length over time: pauses are where time goes on and length does not.
    times, lengths = [spec.start_s], [0.0]
    for pause in sorted(spec.pauses, key=lambda each: each.at_m):
        if pause.at_m < way_m:
            times.append(times[-1] + (pause.at_m - lengths[-1]) / spec.speed_mps)
            times.append(times[-1] + pause.for_s)
            lengths += [pause.at_m, pause.at_m]
    times.append(times[-1] + (way_m - lengths[-1]) / spec.speed_mps)
    lengths.append(way_m)
    walked = np.interp(t_s, times, lengths)
    along = np.where(walked > turn_m, 2.0 * turn_m - walked, walked)
    if len(corners) == 1:
        return np.repeat(corners, len(t_s), axis=0), walked
    columns = [np.interp(along, reached, corners[:, axis]) for axis in (0, 1)]
    return np.column_stack(columns), np.asarray(walked)


_STEP_S: Final = 0.02


def closest_approaches(scenario: Scenario) -> dict[str, tuple[float, float]]:
    """How near the robot would come to each person if neither reacted, and when.

    The robot drives straight to its goal; people keep to their plans. Only the time until the robot
    is there counts.

    Returns:
        By name (``worker 0`` for the first scripted worker): distance of the centres in metres and
        time in seconds.
    """
    t_s = np.arange(0.0, scenario.duration_s, _STEP_S)
    robot = robot_plan(scenario.robot, t_s)
    arrived = np.flatnonzero((robot == robot[-1]).all(axis=1))[0] + 1
    t_s, robot = t_s[:arrived], robot[:arrived]
    ways = {spec.name: person_plan(spec, t_s)[0] for spec in scenario.people}
    for number, script in enumerate(scenario.workers):
        places = [script.motion(float(t)).position_odom_m for t in t_s]
        ways[f"worker {number}"] = np.array(places)
    nearest = {}
    for name, way in ways.items():
        apart = np.linalg.norm(way - robot, axis=1)
        at = int(apart.argmin())
        nearest[name] = (float(apart[at]), float(t_s[at]))
    return nearest


#: Robot and person are in conflict if their centres would come nearer than this.
CONFLICT_M: Final = 1.0


@dataclass(frozen=True, slots=True)
class Meetings:
    """How near robot and people would come in many draws if nobody reacted.

    Attributes:
        share: of the draws in which somebody is nearer than :data:`CONFLICT_M`.
        median_m: of the smallest distance between centres.
        median_s: of the time at which that is.
        draws: number of draws.
    """

    share: float
    median_m: float
    median_s: float
    draws: int


def meetings(template: ScenarioTemplate, draws: int = 200) -> Meetings | None:
    """The meetings of a scenario over seeds 0, 1, …; None where nobody has a plan of their own."""
    varies = bool(template.parameters())
    found = []
    for seed in range(draws if varies else 1):
        nearest = closest_approaches(template.for_seed(seed))
        if not nearest:
            return None
        found.append(min(nearest.values()))
    apart = np.array(found)
    return Meetings(
        float(np.mean(apart[:, 0] < CONFLICT_M)),
        float(np.median(apart[:, 0])),
        float(np.median(apart[:, 1])),
        len(found),
    )


def problems(scenario: Scenario) -> tuple[str, ...]:
    """What cannot be: people and robot in racks or outside the hall, missing files."""
    hall = scenario.layout
    boxes = hall.obstacle_boxes_odom
    inner = (hall.x_min_m, hall.y_min_m, hall.x_max_m, hall.y_max_m)
    task = scenario.robot
    start, goal = (task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)
    reach = NOVA_CARTER.circumscribed_radius_m
    found = [
        *_place_problems("the robot's start", start, boxes, inner, reach),
        *_place_problems("the robot's goal", goal, boxes, inner, reach),
    ]
    grown = boxes + BODY_RADIUS_M * np.array([-1.0, -1.0, 1.0, 1.0])
    for person in scenario.people:
        corners = [(point.x_m, point.y_m) for point in person.route]
        for number, corner in enumerate(corners):
            what = f"people: {person.name}: route point {number}"
            found += _place_problems(what, corner, boxes, inner, BODY_RADIUS_M)
        for number, (here, there) in enumerate(itertools.pairwise(corners)):
            if not _inside(here, boxes, 0.0) and crosses_boxes(grown, here, [there])[0]:
                found.append(
                    f"people: {person.name}: the way from route point {number} to {number + 1} "
                    f"leads through or within {BODY_RADIUS_M:g} m of a rack, a prop or a wall"
                )
    for number, script in enumerate(scenario.workers):
        for waypoint in script.path:
            what = f"workers: {number}: the place at {waypoint.t_s:g} s"
            found += _place_problems(what, (waypoint.x_m, waypoint.y_m), boxes, inner, 0.0)
    if scenario.replay_csv is not None and not Path(scenario.replay_csv).is_file():
        found.append(f"replay_csv: there is no file {scenario.replay_csv}")
    return tuple(dict.fromkeys(found))


def _place_problems(
    what: str,
    place_m: tuple[float, float],
    boxes: FloatArray,
    inner: tuple[float, float, float, float],
    room_m: float,
) -> list[str]:
    x, y = place_m
    if not (inner[0] <= x <= inner[2] and inner[1] <= y <= inner[3]):
        return [
            f"{what} at ({x:g}, {y:g}) m is outside the hall, x {inner[0]:g} to {inner[2]:g} m, "
            f"y {inner[1]:g} to {inner[3]:g} m"
        ]
    if _inside(place_m, boxes, room_m):
        return [
            f"{what} at ({x:g}, {y:g}) m is in, or nearer than {room_m:g} m to, a rack, a prop or "
            "a wall"
        ]
    return []


def _inside(place_m: tuple[float, float], boxes: FloatArray, room_m: float) -> bool:
    place = np.array(place_m)
    outside = np.maximum(np.maximum(boxes[:, :2] - place, place - boxes[:, 2:]), 0.0)
    return bool((np.linalg.norm(outside, axis=1) < max(room_m, 1e-9)).any())
