"""The speed map as the mask of Nav2's speed filter."""

from __future__ import annotations

from typing import Final

from ..exporters import SpeedMap
from .conversions import header, to_time
from .messages.geometry_msgs import Point, Pose
from .messages.nav2_msgs import CostmapFilterInfo
from .messages.nav_msgs import MapMetaData, OccupancyGrid

# nav2_costmap_2d/costmap_filters/filter_values.hpp: SPEED_FILTER_PERCENT
_PERCENT: Final = 1


def speed_mask(
    speed_map: SpeedMap, mask_topic: str = "/awarenav/speed_mask", *, frame_id: str = "odom"
) -> tuple[OccupancyGrid, CostmapFilterInfo]:
    """Return the mask and the filter info that Nav2's speed filter reads.

    Nav2 reads a limit in per cent of the controller's maximum: ``base + multiplier × value``, and
    no limit where the value is 0. A stop is 1 %, since the filter cannot stop a robot; the stop
    polygon (:func:`collision_polygons`) does.

    Args:
        speed_map: the limits.
        mask_topic: on which the mask is published.
        frame_id: of the map.
    """
    rows, columns = speed_map.limits_mps.shape
    x, y = speed_map.origin_odom_m.tolist()
    top = header(speed_map.stamp_s, frame_id)
    mask = OccupancyGrid(
        top,
        MapMetaData(
            to_time(speed_map.stamp_s),
            speed_map.resolution_m,
            columns,
            rows,
            Pose(Point(x, y, 0.0)),
        ),
        speed_map.percent.tobytes(),
    )
    return mask, CostmapFilterInfo(top, _PERCENT, mask_topic, 0.0, 1.0)
