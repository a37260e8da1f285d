"""Random policies, robots and situations, and the real adapter driven to each situation."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    RobotProfile,
    RobotState,
    protective_separation_m,
)
from tracking import PersonTrack

TRACKS = ("confirmed", "confirmed", "confirmed", "coasting", "tentative", "first sight")
#: The rules that a policy may leave out.
OPTIONAL_RULES = ("protective_field", "standing", "walking", "start_reserve", "zones", "near_cap")
_SHAPES = ("smoothstep", "linear", "logistic", "two_level")


def _ramp(draw: random.Random) -> dict[str, Any]:
    below = draw.uniform(0.0, 0.6)
    return {
        "unaware_below": below,
        "aware_above": draw.uniform(below + 0.05, 0.9),
        "shape": draw.choice(_SHAPES),
        "steepness": draw.uniform(1.0, 50.0),
    }


def _table(draw: random.Random, low: float, high: float) -> list[list[float]]:
    count = draw.randint(1, 5)
    alphas = sorted(draw.uniform(0.0, 1.0) for _ in range(count))
    values = sorted((draw.uniform(low, high) for _ in range(count)), reverse=True)
    return [list(pair) for pair in zip(alphas, values, strict=True)]


def _speed(draw: random.Random) -> dict[str, Any]:
    if draw.random() < 0.25:
        return {"table_mps": _table(draw, 0.0, 2.5)}
    unaware = draw.choice([1.6, draw.uniform(0.0, 2.5)])
    speed = {
        **_ramp(draw),
        "unaware_human_speed_mps": unaware,
        "aware_human_speed_mps": unaware * draw.random(),
    }
    if speed["shape"] != "two_level" and draw.random() < 0.6:
        speed["watching_above"] = draw.uniform(speed["aware_above"] + 0.01, 1.0)
        speed["watching_human_speed_mps"] = speed["aware_human_speed_mps"] * draw.random()
    return speed


def _rules(draw: random.Random) -> dict[str, Any]:
    rules: dict[str, Any] = {
        "turn_within_stop_deg": draw.uniform(45.0, 180.0),
        "people_turn_deg": draw.uniform(0.0, 180.0),
    }
    if draw.random() < 0.15:
        rules["protective_field"] = {"beside_m": draw.uniform(0.0, 1.0)}
    if draw.random() < 0.5:
        bound, delay = draw.uniform(0.3, 5.0), draw.uniform(0.0, 0.6)
        rules["standing"] = {
            "human_acceleration_mps2": bound,
            "start_delay_s": delay,
            "standing_below_mps": min(bound * delay, 2.0) * draw.random(),
            "delay_from_tracks": draw.random() < 0.5,
        }
    if draw.random() < 0.5:
        rules["walking"] = _walking(draw)
    if draw.random() < 0.5:
        rules["start_reserve"] = {
            "human_acceleration_mps2": draw.uniform(0.3, 5.0),
            "start_delay_s": draw.uniform(0.0, 0.5),
        }
    if draw.random() < 0.3:
        stop = draw.uniform(0.0, 2.0)
        rules["zones"] = {"stop_within_m": stop, "full_speed_beyond_m": stop + draw.uniform(0.1, 5)}
    if draw.random() < 0.3:
        rules["near_cap"] = {"within_m": draw.uniform(0.1, 3), "speed_mps": draw.uniform(0.1, 1.5)}
    return rules


def _walking(draw: random.Random) -> dict[str, Any]:
    return {
        "human_acceleration_mps2": draw.choice([draw.uniform(0.3, 5.0), draw.uniform(0.8, 2.5)]),
        "turn_delay_s": draw.choice([0.0, draw.uniform(0.0, 0.6)]),
        "velocity_sigmas": draw.choice([0.0, draw.uniform(0.0, 3.0)]),
    }


def walking_policy(draw: random.Random) -> AwarenessPolicy:
    """Return a random policy with the rule for people who walk, and none that hides it."""
    values = random_policy(draw).model_dump(mode="json")
    hiding = {"protective_field": None, "zones": None, "near_cap": None}
    values["rules"].update({"walking": _walking(draw), **hiding})
    aware_mps = draw.uniform(0.5, 1.5)
    values["speed"] = {
        **_ramp(draw),
        "unaware_human_speed_mps": draw.choice([1.6, draw.uniform(aware_mps, 2.0)]),
        "aware_human_speed_mps": aware_mps,
    }
    return AwarenessPolicy.model_validate(values)


def reserve_policy(draw: random.Random) -> AwarenessPolicy:
    """Return one of these whose start reserve limits the robot before aware people."""
    values = walking_policy(draw).model_dump(mode="json")
    # The turn counts with the reserve if its bound is the lower one.
    walking = values["rules"]["walking"]
    bound_mps2, turn_delay_s = walking["human_acceleration_mps2"], walking["turn_delay_s"]
    values["rules"]["start_reserve"] = {
        "human_acceleration_mps2": bound_mps2 * draw.choice([1.0, 1.5, draw.uniform(0.6, 1.0)]),
        "start_delay_s": draw.choice(
            [0.0, draw.uniform(0.5, 1.0) * turn_delay_s, draw.uniform(0.3, 0.8)]
        ),
    }
    values["margins"]["separation_clearance_m"] = 0.0
    values["speed"] = {**_ramp(draw), "aware_human_speed_mps": draw.uniform(0.0, 0.3)}
    return AwarenessPolicy.model_validate(values)


def random_policy(draw: random.Random) -> AwarenessPolicy:
    """Return a valid policy; every setting that an answer depends on may have any value."""
    unaware = draw.uniform(0.2, 1.5)
    inflation = {
        **_ramp(draw),
        "unaware_radius_m": unaware,
        "aware_radius_m": unaware * draw.uniform(0.3, 1.0),
    }
    if draw.random() < 0.25:
        inflation = {"table_m": _table(draw, 0.05, 1.5)}
    ahead_s, fresh_s = (
        draw.choice([0.0, draw.uniform(0.1, 1.0), draw.uniform(0.1, 2.0)]),
        draw.uniform(0.1, 0.5),
    )
    stale_s = fresh_s + draw.uniform(0.0, 0.5)
    return AwarenessPolicy.model_validate(
        {
            "inflation": inflation,
            "speed": _speed(draw),
            "outline": {
                **_ramp(draw),
                "unaware_ahead_s": ahead_s,
                "aware_ahead_s": ahead_s * draw.random(),
                "longest_ahead_m": draw.uniform(0.2, 2.0),
                "sweep_s": draw.choice([0.0, draw.uniform(0.1, 2.0)]),
                "acceleration_density_m2ps3": draw.uniform(0.0, 1.0),
                "overconfidence_per_s": draw.uniform(0.0, 2.0),
            },
            "rules": _rules(draw),
            "noticed": draw.choice(
                [None, {"at_least": draw.uniform(0.1, 1), "counts_as_awareness": draw.random()}]
            ),
            # An alert is due again in every update, as it is the first time.
            "alerts": draw.choice(
                [
                    None,
                    {
                        "unaware_below": draw.random(),
                        "miss_within_m": draw.uniform(0.0, 3.0),
                        "light_within_s": draw.uniform(0.0, 9.0),
                        "voice_within_s": draw.uniform(0.0, 5.0),
                        "horn_within_s": draw.uniform(0.0, 3.0),
                        "repeat_after_s": 0.0,
                        "quiet_s": 0.0,
                    },
                ]
            ),
            "margins": {
                "minimum_clearance_m": draw.uniform(0.1, 0.5),
                "separation_clearance_m": draw.uniform(0.0, 0.5),
                "uncertainty_sigmas": draw.uniform(0.0, 3.0),
                "unseen_sigmas": draw.uniform(0.0, 4.0),
                "maximum_radius_m": draw.choice([None, draw.uniform(1.6, 2.5)]),
            },
            "timing": {
                "shrink_rate_mps": draw.uniform(1.0, 5.0),
                "shrink_after_s": draw.choice([0.0, draw.uniform(0.0, 0.5)]),
                "fresh_within_s": fresh_s,
                "stale_after_s": stale_s,
                "stop_after_s": stale_s * draw.uniform(1.0, 2.0),
            },
        }
    )


def random_robot(draw: random.Random) -> dict[str, Any]:
    """Return the values of a robot file; the footprint is any polygon about the origin."""
    count = draw.randint(3, 7)
    angles = [2.0 * math.pi * (step + 0.8 * draw.random()) / count for step in range(count)]
    long_m, wide_m, shift_m = draw.uniform(0.2, 0.8), draw.uniform(0.2, 0.8), draw.uniform(0, 0.3)
    drive = draw.choice([None, "differential", "ackermann", "holonomic"])
    return {
        "footprint_m": [[long_m * math.cos(a) - shift_m, wide_m * math.sin(a)] for a in angles],
        "max_speed_mps": draw.uniform(0.3, 3.0),
        "max_acceleration_mps2": draw.uniform(0.3, 3.0),
        "max_deceleration_mps2": draw.uniform(0.3, 3.0),
        "reaction_time_s": draw.choice([0.0, draw.uniform(0.0, 0.8)]),
        "drive": drive,
        "min_turning_radius_m": 1.5 if drive == "ackermann" else None,
    }


def round_robot(draw: random.Random) -> dict[str, Any]:
    """Return a fast robot whose outline is nearly its circle, from which some bounds count."""
    angles, radius_m = np.arange(12) * (math.pi / 6.0), draw.uniform(0.2, 0.5)
    corners = radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return {
        **random_robot(draw),
        "footprint_m": corners.tolist(),
        "max_speed_mps": draw.uniform(1.0, 3.0),
    }


def random_state(draw: random.Random, timing: Any) -> dict[str, Any]:
    """Return the state that the page's ``answer`` takes."""
    angle, distance_m = draw.uniform(-math.pi, math.pi), draw.uniform(0.2, 6.0)
    if draw.random() < 0.4:
        angle *= 0.1
    walking, direction = draw.choice([0.0, draw.uniform(0, 0.4), draw.uniform(0, 3)]), draw.random()
    unseen_s = draw.choice([0.0, 0.0, draw.uniform(0.0, 2.0 * timing.fresh_within_s)])
    old_s = draw.choice([0.0, 0.0, draw.uniform(0.0, 1.9 * timing.stale_after_s)])
    sideways = draw.choice([0.0, 0.0, 0.0, draw.uniform(-0.1, 0.1), draw.uniform(-1.0, 1.0)])
    return {
        "x_m": distance_m * math.cos(angle),
        "y_m": distance_m * math.sin(angle),
        "vx_mps": walking * math.cos(2.0 * math.pi * direction),
        "vy_mps": walking * math.sin(2.0 * math.pi * direction),
        "sigma_m": draw.choice([0.0, draw.uniform(0.0, 0.4)]),
        "velocity_sigma_mps": draw.choice([0.0, draw.uniform(0.0, 0.6)]),
        "awareness_lower": draw.choice([0.0, 1.0, draw.random(), draw.random(), draw.random()]),
        "noticed": draw.choice([0.0, draw.random()]),
        "was_aware": draw.random() < 0.3,
        "track": draw.choice(TRACKS),
        "unseen_s": unseen_s,
        "data_age_s": old_s,
        "moved_m": None,
        "moved_age_s": 0.0,
        "speed_mps": draw.choice(
            [0.0, draw.uniform(-2, 2), draw.uniform(0, 2), draw.uniform(0, 2)]
        ),
        "lateral_mps": sideways,
    }


def walking_state(draw: random.Random, timing: Any) -> dict[str, Any]:
    """Return a state with somebody who walks near the robot: away from it, across or towards it."""
    bearing, distance_m = draw.gauss(0.0, 0.6), draw.uniform(0.8, 3.0)
    off = draw.choice([math.pi, 0.0, -0.5 * math.pi, 0.5 * math.pi]) + draw.uniform(-0.7, 0.7)
    walking_mps, course = (
        draw.choice([0.0, draw.uniform(0.1, 0.5), draw.uniform(0.1, 1.8)]),
        bearing + off,
    )
    return {
        **random_state(draw, timing),
        "x_m": distance_m * math.cos(bearing),
        "y_m": distance_m * math.sin(bearing),
        "vx_mps": walking_mps * math.cos(course),
        "vy_mps": walking_mps * math.sin(course),
        "sigma_m": draw.uniform(0.0, 0.1),
        "velocity_sigma_mps": draw.choice([0.0, draw.uniform(0.0, 0.3)]),
        "track": draw.choice(["confirmed", "confirmed", "confirmed", *TRACKS]),
        "speed_mps": draw.choice([0.0, draw.uniform(0.0, 1.5), draw.uniform(0.3, 1.0)]),
        "lateral_mps": 0.0,
    }


def leaving_state(draw: random.Random, timing: Any) -> dict[str, Any]:
    """Return a state with somebody aware who walks away from the robot, or nearly across."""
    state = walking_state(draw, timing)
    away = math.atan2(state["y_m"], state["x_m"]) + draw.uniform(-1.6, 1.6)
    walking_mps = draw.uniform(0.0, 1.5)
    return {
        **state,
        "vx_mps": walking_mps * math.cos(away),
        "vy_mps": walking_mps * math.sin(away),
        "awareness_lower": 1.0,
        "track": "confirmed",
    }


def _track(state: dict[str, Any], stamp_s: float, awareness: float, seen_s: float) -> PersonTrack:
    """Return the track at a stamp; at ``-data_age_s`` it is that of the state."""
    ahead_s = stamp_s + state["data_age_s"]
    velocity = np.array([state["vx_mps"], state["vy_mps"]])
    unseen_s = max(stamp_s - seen_s, 0.0)
    status = "confirmed" if state["track"] == "first sight" else state["track"]
    if status == "coasting" and stamp_s < seen_s:
        status = "confirmed"
    variances = [state["sigma_m"] ** 2] * 2 + [state["velocity_sigma_mps"] ** 2] * 2
    return PersonTrack(
        id=1,
        stamp_s=stamp_s,
        status=status,
        position_odom_m=np.array([state["x_m"], state["y_m"]]) + ahead_s * velocity,
        velocity_odom_mps=velocity,
        covariance_odom=np.diag(variances),
        awareness=awareness,
        awareness_std=0.0,
        awareness_lower=awareness,
        height_m=1.7,
        time_since_seen_s=unseen_s,
        noticed=state["noticed"],
    )


def adapters_answer(
    policy: AwarenessPolicy, robot: RobotProfile, state: dict[str, Any]
) -> NavConstraints:
    """Return the constraints of the adapter at 0 s, after the person has been as in the state.

    The person is seen in one update after another until ``unseen_s`` before the track's stamp,
    which lies ``data_age_s`` before 0. The robot stands at the origin of odom, whatever its speed.
    """
    adapter, timing = NavAdapter(policy, robot), policy.timing
    age_s, unseen_s = state["data_age_s"], state["unseen_s"]
    seen_s = -age_s - unseen_s
    velocity = [state["speed_mps"], state["lateral_mps"]]

    def update(stamp_s: float, awareness: float, at_s: float | None = None) -> NavConstraints:
        now = stamp_s if at_s is None else at_s
        robot_state = RobotState(now, [0.0, 0.0], 0.0, velocity[0], 0.0, velocity)
        track = _track(state, stamp_s, awareness, seen_s)
        return adapter.update((track,), robot_state, now, perception_stamp_s=stamp_s)

    if state["track"] == "first sight":
        return update(-age_s, state["awareness_lower"], 0.0)
    step_s = 0.95 * timing.fresh_within_s
    shrinks_m = policy.inflation.radius_m(0.0) - policy.margins.floor_m
    if policy.outline.unaware_ahead_s > 0.0:
        shrinks_m = max(shrinks_m, policy.outline.longest_ahead_m)
    shrinking_s = timing.shrink_after_s + max(shrinks_m, 0.0) / timing.shrink_rate_mps
    steps = math.ceil(shrinking_s / step_s) + 3
    for step in range(steps, 0, -1):
        remembers = state["was_aware"] and step > steps - 2
        update(seen_s - step * step_s, 1.0 if remembers else state["awareness_lower"])
    constraints = update(seen_s, state["awareness_lower"])
    for times in (_between(seen_s, -age_s, step_s), _between(-age_s, 0.0, timing.stale_after_s)):
        for stamp_s in times:
            shown_s = min(stamp_s, -age_s)
            constraints = update(shown_s, state["awareness_lower"], stamp_s)
    return constraints


def _between(start_s: float, end_s: float, step_s: float) -> list[float]:
    """Return stamps after ``start_s`` up to ``end_s``, which is the last."""
    if end_s <= start_s:
        return []
    count = math.ceil((end_s - start_s) / step_s)
    return [start_s + (end_s - start_s) * each / count for each in range(1, count)] + [end_s]


def stopping_distance_m(robot: RobotProfile, limit_mps: float, age_s: float) -> float:
    """Return the way of the robot until it stands, by the library."""
    return float(
        protective_separation_m(
            limit_mps,
            0.0,
            deceleration_mps2=robot.max_deceleration_mps2,
            reaction_time_s=robot.reaction_time_s + age_s,
            clearance_m=0.0,
        )
    )
