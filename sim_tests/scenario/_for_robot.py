"""A scenario fitted to another robot: room for its outline, and time for its speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from nav_adapter import RobotProfile

from ..actors.robot import NOVA_CARTER, RobotModel
from ._scenario import Scenario

# Share of the longer reach that becomes room beside the lane: a long robot swings its ends out.
_SWING_SHARE: Final = 0.5


def scenario_for_robot(
    scenario: Scenario, robot: RobotModel | RobotProfile | str | Path
) -> Scenario:
    """Return a scenario for another robot than the one that it was made for, the Nova Carter.

    *Room.* The lane, the aisle along it, and everything beside it move outward by what the robot is
    wider, and by half of what it reaches farther from its base. Places within the aisle are
    stretched; racks and people's routes beyond it are shifted. The hall is longer by what the robot
    is longer.

    *Time.* The duration grows with the time that the way takes at the robot's speed and
    acceleration. People start later by what the robot takes longer for half of the way, so that
    they still meet. Smaller and faster robots change neither.

    The name becomes ``scenario_robot``, such as ``blind_corner_forklift``.

    Args:
        scenario: the scenario. One that has a robot already is returned as it is, if it is the
            same.
        robot: a model, a shipped name, a YAML file, or a profile.

    Raises:
        SimError: for an unknown robot, or a scenario that has another robot already.
    """
    model = RobotModel.of(robot)
    if scenario.robot_model is not None:
        if scenario.robot_model == model:
            return scenario
        raise scenario.error(
            f"scenario {scenario.name!r} is for the robot {scenario.robot_model.name!r} already, "
            f"got {model.name!r}"
        )
    if model.body == "nova_carter":
        return scenario
    data = scenario.model_dump()
    _widen(data, model)
    usual, slower = NOVA_CARTER, model.profile
    task = scenario.robot
    way_m = math.hypot(task.goal_x_m - task.start_x_m, task.goal_y_m - task.start_y_m)
    ratio = max(_drive_s(slower, way_m) / _drive_s(usual, way_m), 1.0)
    data["duration_s"] = min(scenario.duration_s * ratio, 600.0)
    half_m = 0.5 * way_m
    _delay(data, max(_drive_s(slower, half_m) - _drive_s(usual, half_m), 0.0))
    data |= {"name": f"{scenario.name}_{model.name}", "robot_model": model}
    data["scanners"] = model.scanners
    return Scenario.from_data(data, scenario.name)


def _drive_s(robot: RobotProfile, way_m: float) -> float:
    """Return the time for a way from a standstill, without braking at its end."""
    speed, acceleration = robot.max_speed_mps, robot.max_acceleration_mps2
    ramp_m = 0.5 * speed * speed / acceleration
    if way_m <= ramp_m:
        return float(math.sqrt(2.0 * way_m / acceleration))
    return float(speed / acceleration + (way_m - ramp_m) / speed)


def _widen(data: dict[str, Any], model: RobotModel) -> None:
    """Move everything beside the lane outward, and the ends of the hall apart."""
    task, hall = data["robot"], data["layout"]
    profile = model.profile
    half_width = max(abs(y) for _, y in model.footprint_m)
    usual_half_width = float(NOVA_CARTER.footprint_m[:, 1].max())
    longer_m = max(profile.circumscribed_radius_m - NOVA_CARTER.circumscribed_radius_m, 0.0)
    extra_m = max(half_width - usual_half_width, 0.0) + _SWING_SHARE * longer_m
    if extra_m == 0.0:
        return
    along_x = task["start_y_m"] == task["goal_y_m"]
    along, across = ("x_m", "y_m") if along_x else ("y_m", "x_m")
    middle = float(task["start_y_m"] if along_x else task["start_x_m"])
    inner_m = 0.5 * float(hall["aisle_width_m"])

    def moved(place: float) -> float:
        off = place - middle
        if abs(off) <= inner_m:
            return middle + off * (1.0 + extra_m / inner_m)
        return place + math.copysign(extra_m, off)

    if task["lane_half_width_m"] is not None:
        task["lane_half_width_m"] += extra_m
    hall["aisle_width_m"] += 2.0 * extra_m
    side, end = across[0], along[0]
    for bound in (f"{side}_min_m", f"{side}_max_m"):
        hall[bound] = moved(hall[bound])
    ends_m = max(longer_m, extra_m)
    hall[f"{end}_min_m"] -= ends_m
    hall[f"{end}_max_m"] += ends_m
    size = "width_m" if along_x else "length_m"
    racks = []
    for rack in hall["racks"]:
        low, high = (moved(rack[across] + sign * 0.5 * rack[size]) for sign in (-1.0, 1.0))
        racks.append({**rack, across: 0.5 * (low + high), size: high - low})
    hall["racks"] = racks
    hall["props"] = [{**prop, across: moved(prop[across])} for prop in hall["props"]]
    _move_people(data, across, moved)


def _move_people(data: dict[str, Any], across: str, moved: Callable[[float], float]) -> None:
    data["workers"] = [
        {**worker, "path": [{**key, across: moved(key[across])} for key in worker["path"]]}
        for worker in data["workers"]
    ]
    data["people"] = [
        {**person, "route": [{**key, across: moved(key[across])} for key in person["route"]]}
        for person in data["people"]
    ]


def _delay(data: dict[str, Any], later_s: float) -> None:
    """Let everybody start later."""
    data["people"] = [
        {**person, "start_s": person["start_s"] + later_s} for person in data["people"]
    ]
    data["workers"] = [
        {
            **worker,
            **{
                name: [{**key, "t_s": key["t_s"] + later_s} for key in worker[name]]
                for name in ("path", "heading", "gaze", "activities")
            },
        }
        for worker in data["workers"]
    ]
