"""The speed map as the mask of Nav2's speed filter, and as a stream of masks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception.arrays import finite_number, set_fields

from .._constraints import NavConstraints
from .._errors import NavError
from .._robot import RobotState
from ..exporters import SpeedMap
from ._speed_limit import fastest_point_per_axis
from .conversions import grid_of
from .messages import Message
from .messages.nav2_msgs import CostmapFilterInfo
from .messages.nav_msgs import OccupancyGrid

# nav2_costmap_2d/costmap_filters/filter_values.hpp: SPEED_FILTER_PERCENT
_PERCENT: Final = 1
# Beyond this a mask takes longer to compute than to drive across.
_MOST_CELLS: Final = 1_000_000
# Rounding of stamps, in periods.
_ROUNDING: Final = 1e-6


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
    stamp_s, cell_m = speed_map.stamp_s, speed_map.resolution_m
    mask = grid_of(stamp_s, frame_id, speed_map.origin_odom_m, cell_m, speed_map.percent)
    return mask, CostmapFilterInfo(mask.header, _PERCENT, mask_topic, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class SpeedMaskSettings:
    """The settings of a published speed mask.

    Attributes:
        rate_hz: masks per second, 0.1 to 50; never more than there are publications.
        size_m: side of the square around the robot.
        resolution_m: side of a cell, at least 1 cm.
        topic: of the mask, as the filter info names it.

    Raises:
        NavError: for a number out of bounds, or over a million cells.
    """

    rate_hz: float = 2.0
    size_m: float = 10.0
    resolution_m: float = 0.1
    topic: str = "/awarenav/speed_mask"

    def __post_init__(self) -> None:
        rate = finite_number("the speed mask's rate_hz", self.rate_hz, NavError, minimum=0.1)
        if rate > 50.0:
            raise NavError(f"the speed mask's rate_hz must be at most 50, got {rate:g}")
        cell = finite_number(
            "the speed mask's resolution_m", self.resolution_m, NavError, minimum=0.01
        )
        size = finite_number("the speed mask's size_m", self.size_m, NavError, minimum=cell)
        if (size / cell) ** 2 > _MOST_CELLS:
            raise NavError(
                f"the speed mask must have at most {_MOST_CELLS} cells, got size_m {size:g} and "
                f"resolution_m {cell:g}"
            )
        set_fields(self, rate_hz=rate, size_m=size, resolution_m=cell)


class SpeedMaskStream:
    """Makes the messages of a speed mask, publication by publication.

    Nav2's filter subscribes to the mask at a filter info, and anew at every further one: the info
    is sent once, whether or not somebody reads the mask yet. A mask holds until the next one: the
    lower limit of its stamp and a period later counts. When constraints stop the robot for lack of
    data, the mask is a stop everywhere, at once.
    """

    def __init__(self, settings: SpeedMaskSettings, frame_id: str) -> None:
        self._settings, self._frame_id = settings, frame_id
        self._map: SpeedMap | None = None
        self._is_stop = self._info_sent = False

    def messages(
        self,
        constraints: NavConstraints,
        state: RobotState | None,
        wanted: Callable[[str], bool],
    ) -> Iterator[tuple[str, Message]]:
        """Yield topic key (:data:`~nav_adapter.ros2.MASK_TOPICS`) and message, if they are due.

        The mask is around the robot; without its state only a stop is sent.
        """
        if not (wanted("speed_mask") or wanted("speed_mask_info")):
            return
        stops = constraints.speed_basis is None or (
            constraints.stale and constraints.speed_limit_mps == 0.0
        )
        if not (stops and not self._is_stop) and not self._is_due(constraints.stamp_s):
            return
        chart = self._map  # a stop is where the latest mask is
        if chart is not None and stops:
            nothing = np.zeros_like(chart.limits_mps)
            chart = replace(chart, stamp_s=constraints.stamp_s, limits_mps=nothing)
        elif not stops:
            chart = self._map_of(constraints, state)
        if chart is None:
            return
        self._map, self._is_stop = chart, stops
        mask, info = speed_mask(chart, self._settings.topic, frame_id=self._frame_id)
        if not self._info_sent and wanted("speed_mask_info"):
            self._info_sent = True
            yield "speed_mask_info", info
        if wanted("speed_mask"):
            yield "speed_mask", mask

    def _is_due(self, stamp_s: float) -> bool:
        if self._map is None:
            return True
        periods = (stamp_s - self._map.stamp_s) * self._settings.rate_hz
        # A clock that was set back makes the latest mask one of the future.
        return periods >= 1.0 - _ROUNDING or periods < 0.0

    def _map_of(self, constraints: NavConstraints, state: RobotState | None) -> SpeedMap | None:
        if state is None:
            return None
        chart = SpeedMap.around(
            constraints,
            state.position_odom_m,
            size_m=self._settings.size_m,
            resolution_m=self._settings.resolution_m,
            times_s=(0.0, 1.0 / self._settings.rate_hz),
        )
        assert constraints.robot is not None
        limits = chart.limits_mps
        lower = limits / fastest_point_per_axis(constraints.robot)
        return replace(chart, limits_mps=np.where(limits < chart.max_speed_mps, lower, limits))
