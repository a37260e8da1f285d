"""Parts that the planners here share: walls, circles, ways around, and limits."""

from __future__ import annotations

import math

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import people_cost, time_cost
from nav_adapter.motion import clip_twists_ahead
from perception.arrays import FloatArray

# A detour leads past a point this far ahead, and this far to either side of the straight way.
_VIA_AHEAD_M = (1.5, 3.0, 4.5)
_VIA_ASIDE_M = np.linspace(-1.8, 1.8, 13)
_WAY_STEPS = 40
# A pose whose gap to a wall is smaller than this is near it.
_NEAR_WALL_M = 0.1
# A detour must save this much time, so that a planner does not waver between two ways.
_WORTH_S = 0.3


def no_boxes(boxes_odom_m: FloatArray | None) -> FloatArray:
    """Return boxes as (N, 4), none for None."""
    return np.zeros((0, 4)) if boxes_odom_m is None else np.asarray(boxes_odom_m, dtype=float)


def gap_to_boxes_m(positions_odom_m: FloatArray, boxes_odom_m: FloatArray) -> FloatArray:
    """Return the distance (…) from points (…, 2) to the nearest box; 0 inside, infinite without."""
    gap = np.full(positions_odom_m.shape[:-1], np.inf)
    for box in boxes_odom_m:
        outside = np.maximum(box[:2] - positions_odom_m, positions_odom_m - box[2:])
        gap = np.minimum(gap, np.hypot(*np.moveaxis(np.maximum(outside, 0.0), -1, 0)))
    return gap


def wall_shares(gaps_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (K,) how near each way is to walls, in [0, 1], and the share of it within one.

    Args:
        gaps_m: (K, T) between the robot's disc and the nearest wall.
    """
    near = np.clip(1.0 - gaps_m / _NEAR_WALL_M, 0.0, 1.0).mean(axis=1)
    return np.asarray(near), np.asarray((gaps_m < 0.0).mean(axis=1))


def circle_costs(
    constraints: NavConstraints, positions_odom_m: FloatArray, dt_s: float, radius_m: float
) -> FloatArray:
    """Return (K,) the mean cost of the circles along each way, for planners without the field.

    Args:
        constraints: of the present cycle.
        positions_odom_m: (K, T, 2) of each way, ``dt_s`` apart.
        dt_s: > 0.
        radius_m: of the robot's disc.
    """
    cost = people_cost(
        constraints,
        positions_odom_m,
        dt_s,
        robot_radius_m=radius_m,
        inside_cost=2.0,
        near_cost=0.5,
    )
    return np.asarray(cost.mean(axis=1))


def direction_to_goal(
    constraints: NavConstraints,
    robot_state: RobotState,
    goal_odom_m: FloatArray,
    boxes_odom_m: FloatArray,
    radius_m: float,
    *,
    use_speed_field: bool,
) -> FloatArray:
    """Return the unit vector (2,) of the goal or, with the field, of the fastest way to it.

    Ways are the straight one and detours past one point beside it. Each takes the time that the
    speed field allows along it. For planners that choose one velocity and see no farther.

    Args:
        constraints: of the present cycle.
        robot_state: the latest.
        goal_odom_m: (2,).
        boxes_odom_m: (N, 4) racks and walls.
        radius_m: of the robot's disc, which keeps out of the boxes.
        use_speed_field: choose among ways.
    """
    start = robot_state.position_odom_m
    to_goal = goal_odom_m - start
    distance_m = float(np.hypot(*to_goal))
    if not use_speed_field:
        return np.asarray(to_goal / max(distance_m, 1e-9))
    if distance_m < 1e-6:
        return np.array([1.0, 0.0])
    ahead = to_goal / distance_m
    left = np.array([-ahead[1], ahead[0]])
    vias = [
        start + min(along, 0.6 * distance_m) * ahead + aside * left
        for along in _VIA_AHEAD_M
        for aside in _VIA_ASIDE_M
    ]
    corners = np.array([[start, via, goal_odom_m] for via in [start + 0.5 * to_goal, *vias]])
    ways = np.array([_along(way) for way in corners])
    free = (gap_to_boxes_m(ways[:, 1:-1], boxes_odom_m) >= radius_m).all(axis=1)
    free[0] |= not free.any()
    # People move while the robot is under way, about as fast as it may drive now.
    pace_mps = max(constraints.speed_limit_mps, 0.3)
    dt_s = distance_m / pace_mps / _WAY_STEPS
    seconds = np.where(free, time_cost(constraints, ways, dt_s=dt_s), np.inf)
    seconds[0] -= _WORTH_S
    towards = corners[int(np.argmin(seconds)), 1] - start
    return np.asarray(towards / max(float(np.hypot(*towards)), 1e-9))


def obeying(
    constraints: NavConstraints, robot_state: RobotState, twist: tuple[float, float], dt_s: float
) -> tuple[float, float]:
    """Return a speed and yaw rate on the same curve that keep the limits of the next cycles.

    The last line of every planner here.
    """
    speed, yaw_rate = clip_twists_ahead(constraints, robot_state, twist, dt_s).tolist()
    return speed, yaw_rate


def follow_curvature(
    robot_state: RobotState, curvatures_1pm: FloatArray, step_m: float
) -> tuple[FloatArray, FloatArray]:
    """Return positions (K, T + 1, 2) and headings (K, T + 1) of ways that begin at the robot.

    Args:
        robot_state: the latest.
        curvatures_1pm: (K, T) curvature of each step, left positive, 1/m.
        step_m: length of a step.
    """
    turned = np.cumsum(curvatures_1pm * step_m, axis=1)
    turned = np.concatenate([np.zeros_like(turned[:, :1]), turned], axis=1)
    headings = robot_state.heading_odom_rad + turned
    middle = 0.5 * (headings[:, 1:] + headings[:, :-1])
    moved = np.cumsum(step_m * np.stack([np.cos(middle), np.sin(middle)], axis=-1), axis=1)
    moved = np.concatenate([np.zeros_like(moved[:, :1]), moved], axis=1)
    return robot_state.position_odom_m + moved, headings


def speed_to_stop_at_mps(robot: RobotProfile, distance_m: float) -> float:
    """Return the speed from which 60 % of the robot's deceleration stops it within a distance."""
    gentle = math.sqrt(1.2 * robot.max_deceleration_mps2 * max(distance_m, 0.0))
    return min(robot.max_speed_mps, gentle)


def stop_distance_m(robot: RobotProfile, speed_mps: float) -> float:
    """Return the distance in which 60 % of the robot's deceleration stops it."""
    return speed_mps**2 / (1.2 * robot.max_deceleration_mps2)


def free_length_m(gaps_m: FloatArray, step_m: float) -> FloatArray:
    """Return (K,), how far each way leads before it touches a wall.

    A robot that already touches one may move along it or away.

    Args:
        gaps_m: (K, T) between the robot's disc and the nearest wall, from now on.
        step_m: length of a step of the way.
    """
    hits = gaps_m < np.minimum(0.0, gaps_m[:, :1] - 1e-3)
    steps = np.where(hits.any(axis=1), hits.argmax(axis=1) - 1, gaps_m.shape[1])
    return np.asarray(np.maximum(steps, 0) * step_m)


def bearing_rad(robot_state: RobotState, goal_odom_m: FloatArray) -> float:
    """Return the angle from the robot's heading to the goal, in [−π, π]."""
    x, y = (goal_odom_m - robot_state.position_odom_m).tolist()
    return math.remainder(math.atan2(y, x) - robot_state.heading_odom_rad, math.tau)


def _along(corners_odom_m: FloatArray) -> FloatArray:
    """Return points (``_WAY_STEPS`` + 1, 2) at equal distances along a polyline (M, 2)."""
    lengths = np.hypot(*np.diff(corners_odom_m, axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    along = np.linspace(0.0, at[-1], _WAY_STEPS + 1)
    return np.stack([np.interp(along, at, corners_odom_m[:, axis]) for axis in (0, 1)], axis=1)
