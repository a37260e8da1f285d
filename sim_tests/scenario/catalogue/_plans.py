"""Planned motion: paths of robot and people if nobody reacted, and how close they would come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from nav_adapter import RobotProfile
from perception.arrays import FloatArray

from ...actors.behaviour import PersonSpec
from ...actors.robot import NOVA_CARTER
from .._scenario import RobotTask, Scenario
from .._template import ScenarioTemplate

#: Robot and person are in conflict if their centres would come closer than this.
CONFLICT_M: Final = 1.0
_STEP_S: Final = 0.02


def robot_plan(task: RobotTask, t_s: FloatArray, robot: RobotProfile = NOVA_CARTER) -> FloatArray:
    """Return the positions (T, 2) in odom of a robot that drives straight to its goal and stops.

    It accelerates to its maximum speed, or to the speed of the task; braking is not modelled.
    """
    start = np.array([task.start_x_m, task.start_y_m])
    goal = np.array([task.goal_x_m, task.goal_y_m])
    length = float(np.linalg.norm(goal - start))
    speed = task.straight_on_speed_mps or robot.max_speed_mps
    speed_up_s = np.minimum(t_s, speed / robot.max_acceleration_mps2)
    driven = 0.5 * robot.max_acceleration_mps2 * speed_up_s**2 + speed * (t_s - speed_up_s)
    share = np.minimum(driven / max(length, 1e-9), 1.0)
    return np.asarray(start + share[:, None] * (goal - start))


def person_plan(spec: PersonSpec, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the positions (T, 2) in odom and the walked lengths (T,) of a person's plan.

    The person walks the route at the planned speed, with its pauses, and turns back if planned.
    """
    corners = np.array([[point.x_m, point.y_m] for point in spec.route])
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(legs)])
    turn_m = spec.turns_back_at_m
    if turn_m is None or turn_m >= reached[-1]:
        turn_m, total_m = float(reached[-1]), float(reached[-1])
    else:
        total_m = 2.0 * turn_m
    # Knots of walked length over time; the length is constant in a pause.
    times, lengths = [spec.start_s], [0.0]
    for pause in sorted(spec.pauses, key=lambda each: each.at_m):
        if pause.at_m < total_m:
            times.append(times[-1] + (pause.at_m - lengths[-1]) / spec.speed_mps)
            times.append(times[-1] + pause.for_s)
            lengths += [pause.at_m, pause.at_m]
    times.append(times[-1] + (total_m - lengths[-1]) / spec.speed_mps)
    lengths.append(total_m)
    walked = np.interp(t_s, times, lengths)
    along = np.where(walked > turn_m, 2.0 * turn_m - walked, walked)
    if len(corners) == 1:
        return np.repeat(corners, len(t_s), axis=0), walked
    columns = [np.interp(along, reached, corners[:, axis]) for axis in (0, 1)]
    return np.column_stack(columns), np.asarray(walked)


def planned_people(scenario: Scenario) -> tuple[PersonSpec, ...]:
    """Return the people, with a planned start for those who set off as the robot comes."""
    t_s = np.arange(0.0, scenario.duration_s, _STEP_S)
    robot = robot_plan(scenario.robot, t_s, scenario.robot_profile)
    reach_m = float(scenario.robot_profile.footprint_m[:, 0].max())
    planned = []
    for spec in scenario.people:
        if spec.sets_off_within_m is not None:
            first, second = (np.array([point.x_m, point.y_m]) for point in spec.route[:2])
            ux, uy = (second - first) / max(float(np.linalg.norm(second - first)), 1e-9)
            gaps_m = np.abs((robot - first) @ np.array([-uy, ux])) - reach_m
            near = np.flatnonzero((gaps_m <= spec.sets_off_within_m) & (t_s >= spec.start_s))
            start_s = float(t_s[near[0]]) if len(near) else scenario.duration_s
            planned.append(spec.model_copy(update={"start_s": start_s, "sets_off_within_m": None}))
        else:
            planned.append(spec)
    return tuple(planned)


def closest_approaches(scenario: Scenario) -> dict[str, tuple[float, float]]:
    """Return how close the robot would come to each person if nobody reacted, and when.

    Robot and people keep to their plans; only the time until the robot reaches its goal counts.

    Returns:
        By name: distance of the centres in metres and
        time in seconds.
    """
    t_s = np.arange(0.0, scenario.duration_s, _STEP_S)
    robot = robot_plan(scenario.robot, t_s, scenario.robot_profile)
    arrived = np.flatnonzero((robot == robot[-1]).all(axis=1))[0] + 1
    t_s, robot = t_s[:arrived], robot[:arrived]
    paths = {spec.name: person_plan(spec, t_s)[0] for spec in planned_people(scenario)}
    closest = {}
    for name, path in paths.items():
        distances = np.linalg.norm(path - robot, axis=1)
        row = int(distances.argmin())
        closest[name] = (float(distances[row]), float(t_s[row]))
    return closest


@dataclass(frozen=True, slots=True)
class ApproachStatistics:
    """Closest approaches of robot and people over many draws of a scenario, if nobody reacted.

    Attributes:
        conflict_share: share of the draws in which somebody comes closer than :data:`CONFLICT_M`.
        median_distance_m: median of the smallest distance between centres.
        median_time_s: median of the time of that distance.
        draws: number of draws.
    """

    conflict_share: float
    median_distance_m: float
    median_time_s: float
    draws: int


def approach_statistics(template: ScenarioTemplate, draws: int = 200) -> ApproachStatistics | None:
    """Return the statistics over seeds 0, 1, …; None for a scenario without planned people."""
    varies = bool(template.parameters())
    closest = []
    for seed in range(draws if varies else 1):
        approaches = closest_approaches(template.for_seed(seed))
        if not approaches:
            return None
        closest.append(min(approaches.values()))
    rows = np.array(closest)
    return ApproachStatistics(
        float(np.mean(rows[:, 0] < CONFLICT_M)),
        float(np.median(rows[:, 0])),
        float(np.median(rows[:, 1])),
        len(closest),
    )
