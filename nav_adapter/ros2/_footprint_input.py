"""The footprint of a robot that takes and leaves loads, from a topic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from shapely.geometry import MultiPoint

from perception.arrays import FloatArray, finite_array

from .._errors import NavError
from .._robot import RobotProfile
from ._shared import Input, Shared
from .conversions import to_seconds
from .messages.geometry_msgs import PolygonStamped

# A sender in odom turns the same outline with the pose of each message: one that grows by less than
# the first or shrinks by less than the second has no new load.
_GROWN_M: Final = 0.001
_SHRUNK_M: Final = 0.01


class FootprintInput(Input):
    """The outline of the robot with its load, as Nav2's local costmap publishes it.

    What counts is the hull of it and of the profile's own footprint, so that an error of a pose
    never makes the robot smaller than it is without a load.

    Attributes:
        bare: the profile without a load.

    Args:
        shared: of the bridge.
        robot: returns the present profile.
        go_on_with: takes each new one.
    """

    def __init__(
        self,
        shared: Shared,
        robot: Callable[[], RobotProfile],
        go_on_with: Callable[[RobotProfile], None],
    ) -> None:
        super().__init__(shared, "footprint")
        self.bare = robot()
        self._load_m: FloatArray | None = None
        self._robot, self._go_on_with = robot, go_on_with

    def loaded(self, bare: RobotProfile) -> RobotProfile:
        """Return another profile with the last load, which the robot keeps until a message."""
        self.bare = bare
        return bare if self._load_m is None else self._hull(bare, self._load_m)

    def _hull(self, bare: RobotProfile, load_m: FloatArray) -> RobotProfile:
        return replace(bare, footprint_m=np.vstack([bare.footprint_m, load_m]))

    def _use(self, message: PolygonStamped, now_s: float) -> bool:
        points = [(each.x, each.y, each.z, 1.0) for each in message.polygon.points]
        with self._shared.lock:
            poses = self._shared.poses
            if poses.state is None:
                return False  # the robot stands for want of odometry, which is told
            try:
                # Before they are turned: 0 times infinity is no corner, and NumPy warns of it.
                corners = finite_array(
                    "footprint_m", np.reshape(points, (-1, 4)), ("M", 4), NavError
                )
                stamp_s = to_seconds(message.header.stamp)
                in_base = poses.in_base(message.header.frame_id, stamp_s)
                outline = (corners @ in_base.T)[:, :2]
                alone = replace(self.bare, footprint_m=outline)
                loaded = self._hull(self.bare, alone.footprint_m)
            except NavError as problem:
                raise NavError(f"{problem}; the last one is kept") from problem
        self._load_m = alone.footprint_m
        before, after = (
            MultiPoint(each.footprint_m).convex_hull for each in (self._robot(), loaded)
        )
        grown = not before.buffer(_GROWN_M).covers(after)
        if grown or not after.buffer(_SHRUNK_M).covers(before):
            self._go_on_with(loaded)
        self.used += 1
        return True
