"""Where everybody would be if nobody reacted to anybody."""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

from .._scenario import RobotTask, Scenario
from ..people._person_spec import PersonSpec
from ..robot._amr import NOVA_CARTER


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
