"""The speed limit in a form that Nav2's controllers read as what it is."""

from __future__ import annotations

from typing import Final

from perception.arrays import finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._stamps import header
from .messages.nav2_msgs import SpeedLimit

#: The slowest limit that is sent: 0.0 would lift every limit (nav2_costmap_2d NO_SPEED_LIMIT).
SLOWEST_MPS: Final = 0.01
# DWB keeps its previous limit when it gets an absolute one at or above its maximum.
_BELOW_MAXIMUM: Final = 0.999


def speed_limit(
    constraints: NavConstraints,
    max_speed_mps: float,
    *,
    percentage: bool = False,
    frame_id: str = "",
) -> SpeedLimit:
    """``nav2_msgs/SpeedLimit``, in m/s or in per cent.

    What is sent is never 0.0, which Nav2 reads as "no limit": a stop becomes 0.01 m/s here, and the
    stop polygon (:func:`collision_polygons`) makes the collision monitor stand still. It is never
    above 99.9 % of the maximum: MPPI and RPP would raise their maximum to it, and DWB would ignore
    it and keep an old one. A limit is rounded toward neither side otherwise.

    Args:
        constraints: the limit, and when.
        max_speed_mps: of the robot, > 0.01; with ``percentage`` it must be the maximum that the
            controller is configured with (``vx_max``, ``desired_linear_vel``, ``max_speed_xy``).
        percentage: send per cent of that instead of m/s.
        frame_id: of the header; Nav2 does not look at it.

    Raises:
        NavError: a maximum that is not finite or no more than 0.01 m/s.
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
