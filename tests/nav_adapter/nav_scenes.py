"""Robots and people for the tests of the adapter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from hypothesis import strategies as st
from shapely.geometry import Point

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    PersonObstacle,
    RobotProfile,
    RobotState,
)
from nav_adapter.exporters import speed_limit_at
from nav_adapter.limit import passing_radius_m
from perception import PersonObservation
from perception.arrays import FloatArray
from tracking import PersonTrack

ROBOT = RobotProfile(
    footprint_m=np.array([[0.3625, 0.25], [-0.3625, 0.25], [-0.3625, -0.25], [0.3625, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)

FLOOR_M = 0.40


# The rules that a robot leaves out that has the protective field of a scanner alone.
SCANNER: Final = ("reach", "walking on", "first sight")


def person(
    stamp_s: float = 0.0,
    *,
    track_id: int = 1,
    status: str = "confirmed",
    position: Sequence[float] = (3.0, 0.0),
    velocity: Sequence[float] = (0.0, 0.0),
    sigma_m: float = 0.0,
    awareness_lower: float = 0.0,
    unseen_s: float = 0.0,
) -> PersonTrack:
    return PersonTrack(
        id=track_id,
        stamp_s=stamp_s,
        status=status,
        position_odom_m=np.asarray(position),
        velocity_odom_mps=np.asarray(velocity),
        covariance_odom=np.diag([sigma_m**2, sigma_m**2, 0.0, 0.0]),
        awareness=awareness_lower,
        awareness_std=0.0,
        awareness_lower=awareness_lower,
        height_m=1.75,
        time_since_seen_s=unseen_s,
    )


def policy_radius_m(policy: AwarenessPolicy, alpha: float, robot: RobotProfile = ROBOT) -> float:
    """Return the radius of somebody whose place is certain, without the history of shrinking.

    It is that of the policy, or the one beside which a robot may pass at 0.3 m/s.
    """
    speed_mps, unaware_mps = (policy.speed.human_speed_mps(each) for each in (alpha, 0.0))
    passing_m = passing_radius_m(
        speed_mps,
        policy.reach if policy.applies("reach") else None,
        policy.margins.clearance_m,
        robot,
        policy.margins.within_m(speed_mps, unaware_mps),
    )
    return max(policy.inflation.radius_m(alpha), passing_m)


def robot_at(
    stamp_s: float = 0.0,
    *,
    position: Sequence[float] = (0.0, 0.0),
    heading_rad: float = 0.0,
    speed_mps: float = 0.0,
) -> RobotState:
    return RobotState(stamp_s, np.asarray(position), heading_rad, speed_mps, 0.0)


def settled_update(
    tracks: Sequence[PersonTrack],
    *,
    policy: AwarenessPolicy | None = None,
    robot: RobotProfile = ROBOT,
    state: RobotState | None = None,
    perceived: bool = False,
) -> NavConstraints:
    """Return the constraints at 0 s for people who have been seen for 0.4 s, walking as now.

    With ``perceived``, perception is up to date in every update, whatever the tracks say.
    """
    adapter = NavAdapter(AwarenessPolicy() if policy is None else policy, robot)
    now = robot_at() if state is None else state
    for ago_s in (0.4, 0.3, 0.2, 0.1, 0.0):
        earlier = [
            replace(
                track,
                stamp_s=track.stamp_s - ago_s,
                position_odom_m=track.position_odom_m - ago_s * track.velocity_odom_mps,
            )
            for track in tracks
        ]
        then = replace(now, stamp_s=now.stamp_s - ago_s)
        perceived_s = -ago_s if perceived else None
        constraints = adapter.update(earlier, then, -ago_s, perception_stamp_s=perceived_s)
    return constraints


def rotation(angle_rad: float) -> FloatArray:
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[cos, -sin], [sin, cos]])


def moved_person(
    track: PersonTrack, angle_rad: float, shift_m: FloatArray, *, mirrored: bool = False
) -> PersonTrack:
    """Return somebody in a world that is mirrored about x, turned and shifted."""
    R = rotation(angle_rad) @ np.diag([1.0, -1.0 if mirrored else 1.0])
    both = np.kron(np.eye(2), R)
    covariance = both @ track.covariance_odom @ both.T
    return replace(
        track,
        position_odom_m=R @ track.position_odom_m + shift_m,
        velocity_odom_mps=R @ track.velocity_odom_mps,
        covariance_odom=0.5 * (covariance + covariance.T),
    )


def moved_robot(
    state: RobotState, angle_rad: float, shift_m: FloatArray, *, mirrored: bool = False
) -> RobotState:
    sign = -1.0 if mirrored else 1.0
    return replace(
        state,
        position_odom_m=rotation(angle_rad) @ (state.position_odom_m * [1.0, sign]) + shift_m,
        heading_odom_rad=sign * state.heading_odom_rad + angle_rad,
        yaw_rate_radps=sign * state.yaw_rate_radps,
    )


def numbers(constraints: NavConstraints) -> tuple[object, ...]:
    """Return all values of the constraints, in comparable form."""
    return (
        constraints.stamp_s,
        constraints.speed_limit_mps,
        constraints.reachable_speed_limit_mps,
        constraints.limited_by,
        constraints.stale,
        tuple(
            (
                o.track_id,
                *o.center_odom_m,
                *o.velocity_odom_mps,
                o.radius_m,
                o.height_m,
                o.awareness_lower,
                o.polygon.wkb,
            )
            for o in constraints.obstacles
        ),
    )


def field_mps(constraints: NavConstraints, state: RobotState) -> float:
    """Return the field's limit of a robot in this state, now."""
    limits = speed_limit_at(
        constraints,
        [[state.position_odom_m]],
        [[state.heading_odom_rad]],
        dt_s=0.1,
        speeds_mps=[[[state.speed_mps, state.lateral_mps]]],
        yaw_rates_radps=[[state.yaw_rate_radps]],
    )
    return float(limits[0, 0])


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


@st.composite
def covariances(draw: st.DrawFn) -> FloatArray:
    """Any covariance (4, 4), from its lower triangular root."""
    root = np.zeros((4, 4))
    root[np.tril_indices(4)] = draw(st.lists(finite(-0.6, 0.6), min_size=10, max_size=10))
    return root @ root.T


@st.composite
def crowds(draw: st.DrawFn, stamp_s: float = 0.0, max_size: int = 4) -> tuple[PersonTrack, ...]:
    """People of every status, some seen and some not, some standing, with distinct ids."""
    ids = draw(st.lists(st.integers(0, 30), max_size=max_size, unique=True))
    calm = [draw(st.sampled_from([1.0, 0.05])) for _ in ids]
    return tuple(
        PersonTrack(
            id=track_id,
            stamp_s=stamp_s - draw(finite(0.0, 0.6)),
            status=draw(st.sampled_from(["tentative", "confirmed", "coasting"])),
            position_odom_m=draw(st.tuples(finite(-6, 6), finite(-6, 6))),
            velocity_odom_mps=share * np.array(draw(st.tuples(finite(-2, 2), finite(-2, 2)))),
            covariance_odom=share**2 * draw(covariances()),
            awareness=0.5,
            awareness_std=0.1,
            awareness_lower=draw(finite(0, 1)),
            height_m=1.7,
            time_since_seen_s=draw(st.sampled_from([0.0, 0.05, 0.4])),
        )
        for track_id, share in zip(ids, calm, strict=True)
    )


#: x, y, vx, vy, radius.
Circle = tuple[float, float, float, float, float]


def constraints_of(*circles: Circle) -> NavConstraints:
    """Return constraints made of circles, for the exporters."""
    obstacles = tuple(
        PersonObstacle(
            track_id=index,
            center_odom_m=(x, y),
            velocity_odom_mps=(vx, vy),
            radius_m=radius,
            height_m=1.7,
            awareness_lower=0.0,
            polygon=Point(x, y).buffer(1.01 * radius),
        )
        for index, (x, y, vx, vy, radius) in enumerate(circles)
    )
    return NavConstraints(0.0, obstacles, 1.0, "robot maximum", False)


def some_circles(
    min_size: int = 0, max_size: int = 4, reach_m: float = 6.0
) -> st.SearchStrategy[list[Circle]]:
    place, velocity = finite(-reach_m, reach_m), finite(-2, 2)
    one = st.tuples(place, place, velocity, velocity, finite(0.3, 1.5))
    return st.lists(one, min_size=min_size, max_size=max_size)


#: Of a camera on the robot's mast, looking along odom x: optical z forward, x right, y down.
T_ODOM_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)


def observed(
    stamp_s: float, place_m: tuple[float, float], awareness: float | None = None
) -> PersonObservation:
    """Return somebody at (x, y) in odom, seen by that camera."""
    x, y = place_m
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.array([-y, 0.2, x]),
        position_covariance_m2=np.diag([0.03, 0.03, 0.08]) ** 2,
        gaze_camera=None,
        awareness=awareness,
        awareness_std=None if awareness is None else 0.05,
        score=0.9,
    )
