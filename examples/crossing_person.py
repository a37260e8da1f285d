"""A robot drives eight metres, and a person walks across its path.

The other examples drive in this world: the robot is a disc on wheels with 360° cameras, without
physics (``examples/planners`` has physics). The person looks elsewhere for two seconds and then at
the robot. Run by itself, this file shows a planner that obeys the speed limit and drives straight.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import time_cost
from perception import PersonObservation
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTracker, TrackerConfig

DT_S = 0.1
GOAL_ODOM_M = np.array([8.0, 0.0])
ROBOT_RADIUS_M = 0.45
MAX_YAW_RATE_RADPS = 1.5
ROBOT = RobotProfile(
    footprint_m=np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)
# Straight ways that start at these angles off the goal, ties to the right.
_OFF_RAD = np.radians([0, *(side * angle for angle in range(10, 61, 10) for side in (-1, 1))])
_WAY_M = np.linspace(0.0, 3.0, 16)
#: Planner: speed (m/s) and yaw rate (rad/s) from state and constraints.
Plan = Callable[[RobotState, NavConstraints], tuple[float, float]]


def drive(plan: Plan) -> None:
    """Drive with a planner; print one line per second, and a summary at the end."""
    policy = AwarenessPolicy.preset("balanced")
    tracker = PersonTracker(TrackerConfig.for_policy(policy))
    adapter = NavAdapter(policy, ROBOT)
    state = RobotState(0.0, np.zeros(2), 0.0, 0.0, 0.0)
    least_gap_m, most_excess_mps = math.inf, -math.inf
    for tick in range(400):
        now = tick * DT_S
        T_odom_camera = _camera_pose(state, now)
        tracks = tracker.update(_observed(T_odom_camera, now), now, T_odom_camera)
        constraints = adapter.update(tracks, state, now, perception_stamp_s=now)
        command = plan(state, constraints)
        if tick % 10 == 0:
            radii = ", ".join(f"{o.radius_m:.2f} m" for o in constraints.obstacles) or "nobody"
            print(
                f"{now:4.1f} s  at ({state.position_odom_m[0]:4.2f}, "
                f"{state.position_odom_m[1]:5.2f}) m with {state.speed_mps:4.2f} m/s, limit "
                f"{constraints.speed_limit_mps:4.2f} m/s, radius {radii}"
            )
        state = _moved(state, command)
        most_excess_mps = max(
            most_excess_mps, state.speed_mps - constraints.reachable_speed_limit_mps
        )
        person = _person_odom_m(now + DT_S) - state.position_odom_m
        apart_m = float(np.hypot(*person))
        c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
        # This person walks on, also into a robot that stands, or leaves with them behind it.
        if state.speed_mps > 0.03 and c * person[0] + s * person[1] > 0.0:
            least_gap_m = min(least_gap_m, apart_m - BODY_RADIUS_M - ROBOT_RADIUS_M)
        if np.hypot(*(GOAL_ODOM_M - state.position_odom_m)) < 0.3:
            break
    print(
        f"goal {'reached' if tick < 399 else 'not reached'} after {now:.1f} s, least gap to a "
        f"person ahead {least_gap_m:.2f} m, over the limit by at most {most_excess_mps:.2f} m/s"
    )


def towards_goal(state: RobotState) -> tuple[float, float]:
    """Return distance (m) and bearing (rad, from the heading) of the goal."""
    dx, dy = GOAL_ODOM_M - state.position_odom_m
    off = math.atan2(dy, dx) - state.heading_odom_rad
    return math.hypot(dx, dy), math.atan2(math.sin(off), math.cos(off))


def desired_velocity(state: RobotState, constraints: NavConstraints) -> np.ndarray:
    """Return the velocity (2,) of the way to the goal that the limit lets end soonest.

    For planners that choose one velocity and see no farther. Each way leads straight for 3 m, as
    fast as the limit allows there and then, and on to the goal.
    """
    to_goal = GOAL_ODOM_M - state.position_odom_m
    distance_m = float(np.hypot(*to_goal))
    bearings = math.atan2(to_goal[1], to_goal[0]) + _OFF_RAD
    ahead = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    along_m = np.minimum(_WAY_M, distance_m)
    ways = state.position_odom_m + along_m[:, None] * ahead[:, None]
    dt_s = _WAY_M[1] / max(constraints.speed_limit_mps, 0.3)
    headings = np.tile(bearings[:, None], len(_WAY_M))
    seconds = time_cost(constraints, ways, headings, dt_s=dt_s)
    seconds += np.hypot(*(GOAL_ODOM_M - ways[:, -1]).T) / ROBOT.max_speed_mps
    speed = min(constraints.speed_limit_mps, distance_m)
    return np.asarray(speed * ahead[int(seconds.argmin())])


def follow_velocity(state: RobotState, velocity_odom_mps: np.ndarray) -> tuple[float, float]:
    """Return speed and yaw rate with which a wheeled robot approaches a velocity."""
    vx, vy = velocity_odom_mps
    off = math.atan2(vy, vx) - state.heading_odom_rad
    off = math.atan2(math.sin(off), math.cos(off))
    speed = math.hypot(vx, vy)
    # Turn first: now the robot can only move along its heading.
    return speed * max(math.cos(off), 0.0), (2.0 * off if speed > 0.02 else 0.0)


def _person_odom_m(now: float) -> np.ndarray:
    """Return the person's position (2,)."""
    return np.array([5.0, -3.0 + 0.7 * now])


def _observed(T_odom_camera: np.ndarray, now: float) -> tuple[PersonObservation, ...]:
    """Return the observations of one frame."""
    position = (np.linalg.inv(T_odom_camera) @ [*_person_odom_m(now), 1.2, 1.0])[:3]
    return (
        PersonObservation(
            stamp_s=now,
            position_camera_m=position,
            position_covariance_m2=np.diag([0.03, 0.03, 0.08]) ** 2,
            gaze_camera=None,
            awareness=0.85 if now > 2.0 else 0.0,
            awareness_std=0.05,
            score=0.9,
        ),
    )


def _camera_pose(state: RobotState, now: float) -> np.ndarray:
    """Return T_odom_camera of the camera that faces the person, 1.4 m above the base."""
    x, y = state.position_odom_m
    dx, dy = _person_odom_m(now) - state.position_odom_m
    c, s = dx / math.hypot(dx, dy), dy / math.hypot(dx, dy)
    return np.array([[s, 0, c, x], [-c, 0, s, y], [0, -1, 0, 1.4], [0, 0, 0, 1]], dtype=float)


def _moved(state: RobotState, command: tuple[float, float]) -> RobotState:
    """Return the robot's state after a cycle, with limited acceleration and yaw rate."""
    speed, yaw_rate = command
    speed = max(speed, state.speed_mps - ROBOT.max_deceleration_mps2 * DT_S, 0.0)
    speed = min(speed, state.speed_mps + ROBOT.max_acceleration_mps2 * DT_S)
    yaw_rate = min(max(yaw_rate, -MAX_YAW_RATE_RADPS), MAX_YAW_RATE_RADPS)
    heading = state.heading_odom_rad + yaw_rate * DT_S
    way = speed * DT_S * np.array([math.cos(heading), math.sin(heading)])
    return RobotState(state.stamp_s + DT_S, state.position_odom_m + way, heading, speed, yaw_rate)


def straight_on(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Obey the limit and steer to the goal."""
    distance_m, bearing_rad = towards_goal(state)
    return min(constraints.speed_limit_mps, distance_m), bearing_rad


if __name__ == "__main__":
    drive(straight_on)
