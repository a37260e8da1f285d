"""The speed limit as a message that Nav2's controllers do not misread."""

from __future__ import annotations

from typing import Final

from perception.arrays import finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from .conversions import header
from .messages.nav2_msgs import SpeedLimit

#: The lowest limit that is sent: 0.0 would remove every limit (nav2_costmap_2d NO_SPEED_LIMIT).
SLOWEST_MPS: Final = 0.01
# DWB keeps its previous limit if it gets an absolute one at or above its maximum.
_BELOW_MAXIMUM: Final = 0.999


def speed_limit(
    constraints: NavConstraints,
    max_speed_mps: float,
    *,
    percentage: bool = False,
    frame_id: str = "",
) -> SpeedLimit:
    """Return ``nav2_msgs/SpeedLimit``, in m/s or in per cent.

    The value is never 0.0, which Nav2 reads as "no limit". A stop becomes 0.01 m/s, and the stop
    polygon (:func:`collision_polygons`) makes the collision monitor stop the robot. The value is
    never above 99.9 % of the maximum: MPPI and RPP would raise their maximum to it, and DWB would
    ignore it and keep an old limit. Other limits are not rounded.

    Args:
        constraints: the limit and its stamp.
        max_speed_mps: of the robot, > 0.01; with ``percentage`` it must be the maximum that the
            controller is configured with (``vx_max``, ``desired_linear_vel``, ``max_speed_xy``).
        percentage: send per cent of the maximum instead of m/s.
        frame_id: of the header; Nav2 does not use it.

    Raises:
        NavError: for a maximum that is not finite or at most 0.01 m/s.
    """
    maximum = finite_number(
        "max_speed_mps", max_speed_mps, NavError, minimum=SLOWEST_MPS, exclusive_minimum=True
    )
    limit = max(SLOWEST_MPS, min(constraints.speed_limit_mps, _BELOW_MAXIMUM * maximum))
    return SpeedLimit(
        header(constraints.stamp_s, frame_id),
        percentage,
        100.0 * limit / maximum if percentage else limit,
    )
