"""A scenario fitted to another robot: room for its outline, and time for its speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from nav_adapter import RobotProfile
from perception.arrays import FloatArray

from ..actors.robot import NOVA_CARTER, RobotModel

# Share of the longer reach that becomes room beside the lane: a long robot swings its ends out.
_SWING_SHARE: Final = 0.5


def fit(data: dict[str, Any], model: RobotModel) -> None:
    """Fit the fields of a scenario, made for the Nova Carter, to another robot, in place.

    See :class:`~sim_tests.scenario.Scenario`. Places within the aisle are stretched; racks and
    people's routes beyond it are shifted. Pauses and turns stay at the same place of the route. The
    hall is longer by what the robot is longer. People start later by what the robot takes longer
    for half of the way; those who set off as it comes let a slower robot come nearer, as near in
    time. Smaller and faster robots change neither.
    """
    _widen(data, model)
    usual, slower = NOVA_CARTER, model.profile
    task = data["robot"]
    way_m = math.hypot(task["goal_x_m"] - task["start_x_m"], task["goal_y_m"] - task["start_y_m"])
    ratio = max(_drive_s(slower, way_m) / _drive_s(usual, way_m), 1.0)
    data["duration_s"] = min(data["duration_s"] * ratio, 600.0)
    half_m = 0.5 * way_m
    _delay(data, max(_drive_s(slower, half_m) - _drive_s(usual, half_m), 0.0))
    _let_nearer(data, min(slower.max_speed_mps / usual.max_speed_mps, 1.0))
    data |= {"name": f"{data['name']}_{model.name}", "robot_model": model}
    data["scanners"] = model.scanners


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
    # Unit vector across the task's line, which may lie at any angle in the hall.
    start = np.array([task["start_x_m"], task["start_y_m"]])
    ux, uy = np.array([task["goal_x_m"], task["goal_y_m"]]) - start
    across = np.array([-uy, ux]) / max(math.hypot(ux, uy), 1e-9)
    inner_m = 0.5 * float(hall["aisle_width_m"])

    def outward_m(off_m: float) -> float:
        """Return how far something so far to the left of the line moves to the left."""
        return extra_m * min(max(off_m / inner_m, -1.0), 1.0)

    def off_m(x_m: float, y_m: float) -> float:
        return float(across @ (np.array([x_m, y_m]) - start))

    def moved(place: dict[str, Any]) -> dict[str, Any]:
        dx, dy = (outward_m(off_m(place["x_m"], place["y_m"])) * across).tolist()
        return {**place, "x_m": place["x_m"] + dx, "y_m": place["y_m"] + dy}

    if task["lane_half_width_m"] is not None:
        task["lane_half_width_m"] += extra_m
    hall["aisle_width_m"] += 2.0 * extra_m
    ends_m = max(longer_m, extra_m)
    share_x, share_y = np.abs(across).tolist()
    for axis, beside, ahead in (("x", share_x, share_y), ("y", share_y, share_x)):
        hall[f"{axis}_min_m"] -= extra_m * beside + ends_m * ahead
        hall[f"{axis}_max_m"] += extra_m * beside + ends_m * ahead
    racks = []
    for rack in hall["racks"]:
        half_m = 0.5 * (share_x * rack["length_m"] + share_y * rack["width_m"])
        middle_m = off_m(rack["x_m"], rack["y_m"])
        low_m, high_m = (outward_m(middle_m + sign * half_m) for sign in (-1.0, 1.0))
        dx, dy = (0.5 * (low_m + high_m) * across).tolist()
        wider_m = high_m - low_m  # of a rack that reaches into the aisle
        racks.append(
            {
                **rack,
                "x_m": rack["x_m"] + dx,
                "y_m": rack["y_m"] + dy,
                "length_m": rack["length_m"] + share_x * wider_m,
                "width_m": rack["width_m"] + share_y * wider_m,
            }
        )
    hall["racks"] = racks
    hall["props"] = [moved(prop) for prop in hall["props"]]
    data["people"] = [_moved_person(person, moved) for person in data["people"]]


def _moved_person(
    person: dict[str, Any], moved: Callable[[dict[str, Any]], dict[str, Any]]
) -> dict[str, Any]:
    """Return a person whose route has moved, with the stops and the turn where they were on it."""
    route = [moved(key) for key in person["route"]]
    before, after = (
        np.array([[key["x_m"], key["y_m"]] for key in keys]) for keys in (person["route"], route)
    )

    old_m, new_m = _reached_m(before), _reached_m(after)

    def length_m(at_m: float) -> float:
        """Return the length of the new route at the place that was at a length of the old one."""
        if at_m > old_m[-1]:  # beyond the end, where it means nothing
            return float(new_m[-1] + at_m - old_m[-1])
        piece = max(int(np.searchsorted(old_m, at_m)) - 1, 0)
        if piece + 1 == len(after):  # a route of one point
            return at_m
        share = (at_m - old_m[piece]) / (old_m[piece + 1] - old_m[piece])
        x_m, y_m = (before[piece] + share * (before[piece + 1] - before[piece])).tolist()
        place, step = moved({"x_m": x_m, "y_m": y_m}), after[piece + 1] - after[piece]
        on = (np.array([place["x_m"], place["y_m"]]) - after[piece]) @ step / (step @ step)
        return float(new_m[piece] + np.clip(on, 0.0, 1.0) * (new_m[piece + 1] - new_m[piece]))

    turn_m = person["turns_back_at_m"]
    turns = turn_m is not None and turn_m < old_m[-1]

    def stop_m(at_m: float) -> float:
        if turns and at_m > turn_m:  # on the way back
            return 2.0 * length_m(turn_m) - length_m(2.0 * turn_m - at_m)
        return length_m(at_m)

    fitted = {**person, "route": route}
    if turn_m is not None:
        fitted["turns_back_at_m"] = length_m(turn_m)
    fitted["pauses"] = [{**pause, "at_m": stop_m(pause["at_m"])} for pause in person["pauses"]]
    return fitted


def _reached_m(corners: FloatArray) -> FloatArray:
    """Return the (N,) lengths of a route at its corners (N, 2)."""
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(legs)])


def _delay(data: dict[str, Any], later_s: float) -> None:
    """Let everybody start later, and look later where they look as planned."""
    data["people"] = [
        {
            **person,
            "start_s": person["start_s"] + later_s,
            "gaze": [{**key, "t_s": key["t_s"] + later_s} for key in person["gaze"]],
        }
        for person in data["people"]
    ]


def _let_nearer(data: dict[str, Any], share: float) -> None:
    """Let people who set off as the robot comes wait until it is at a share of the distance."""
    for person in data["people"]:
        if person["sets_off_within_m"] is not None:
            person["sets_off_within_m"] *= share
