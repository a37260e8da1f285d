"""The speed limit as a message that Nav2's controllers do not misread."""

from __future__ import annotations

import math
from typing import Final

from perception.arrays import finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from .._robot import RobotProfile, RobotState
from .conversions import header
from .messages.nav2_msgs import SpeedLimit

#: The lowest limit that is sent: 0.0 would remove every limit (nav2_costmap_2d NO_SPEED_LIMIT).
SLOWEST_MPS: Final = 0.01
# DWB keeps its previous limit if it gets an absolute one at or above its maximum.
_BELOW_MAXIMUM: Final = 0.999
# Of a robot whose profile has none: the fastest default among Nav2's controllers (MPPI, wz_max).
_YAW_RATE_RADPS: Final = 1.9
# A slower robot has no curve that it keeps.
_ON_A_CURVE_MPS: Final = 0.1


def controller_limit_mps(constraints: NavConstraints, state: RobotState | None = None) -> float:
    """Return the limit of the base, per axis, with which no point of the robot is too fast.

    It is the lower of the speed limit and of ``fastest_point_limit_mps`` divided by
    :func:`fastest_point_per_axis`. Constraints without ``robot`` have only the former.
    """
    if constraints.robot is None:
        return constraints.speed_limit_mps
    assert constraints.fastest_point_limit_mps is not None
    per_axis = fastest_point_per_axis(constraints.robot, state)
    return min(constraints.speed_limit_mps, constraints.fastest_point_limit_mps / per_axis)


def fastest_point_per_axis(robot: RobotProfile, state: RobotState | None = None) -> float:
    """Return how much faster than a limit per axis the fastest point of the robot can be, ≥ 1.

    Nav2's controllers keep a limit L for x and y each, and scale the yaw rate with it: on the
    diagonal √2 L + R ω L / v, with the circumscribed radius R, ω = ``max_yaw_rate_radps`` (1.9
    rad/s if it is not given) and v = ``max_speed_mps``. A robot whose ``drive`` cannot move
    sideways has L instead of √2 L, and one that steers at most L / ``min_turning_radius_m`` of yaw
    rate. One that ``brakes_on_curve`` keeps the curve of its present motion ``state``, if that is
    given, while it moves.
    """
    turning = (robot.max_yaw_rate_radps or _YAW_RATE_RADPS) / robot.max_speed_mps
    if robot.min_turning_radius_m is not None:
        turning = min(turning, 1.0 / robot.min_turning_radius_m)
    if robot.brakes_on_curve and state is not None and state.travel_mps >= _ON_A_CURVE_MPS:
        turning = min(turning, abs(state.yaw_rate_radps) / state.travel_mps)
    straight = 1.0 if robot.moves_sideways is False else math.sqrt(2.0)
    return straight + robot.circumscribed_radius_m * turning


def speed_limit(
    constraints: NavConstraints,
    max_speed_mps: float,
    *,
    percentage: bool = False,
    frame_id: str = "",
    state: RobotState | None = None,
) -> SpeedLimit:
    """Return ``nav2_msgs/SpeedLimit``, in m/s or in per cent.

    Nav2's controllers keep it for the base, per axis, and the limit of the constraints is for the
    fastest point of the robot. So the value is lower (``docs/nav2.md``), if the constraints have
    their ``robot``, as those of ``NavAdapter.update`` do.

    The value is never 0.0, which Nav2 reads as "no limit". A stop becomes 0.01 m/s, and the stop
    polygon (:func:`collision_polygons`) makes the collision monitor stop the robot. The value is
    never above 99.9 % of the maximum: MPPI and RPP would raise their maximum to it, and DWB would
    ignore it and keep an old limit.

    Args:
        constraints: the limit and its stamp.
        max_speed_mps: of the robot, > 0.01; with ``percentage`` it must be the maximum that the
            controller is configured with (``vx_max``, ``desired_linear_vel``, ``max_speed_xy``).
        percentage: send per cent of the maximum instead of m/s.
        frame_id: of the header; Nav2 does not use it.
        state: the robot's, whose curve counts if it ``brakes_on_curve``.

    Raises:
        NavError: for a maximum that is not finite or at most 0.01 m/s.
    """
    maximum = finite_number(
        "max_speed_mps", max_speed_mps, NavError, minimum=SLOWEST_MPS, exclusive_minimum=True
    )
    highest_mps = _BELOW_MAXIMUM * maximum
    limit = max(SLOWEST_MPS, min(controller_limit_mps(constraints, state), highest_mps))
    return SpeedLimit(
        header(constraints.stamp_s, frame_id),
        percentage,
        100.0 * limit / maximum if percentage else limit,
    )
