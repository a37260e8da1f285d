"""The field of view of a robot that knows the racks and walls of its hall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from tracking import RangedView, View

from ...world import Warehouse, crosses_boxes

# Boxes lower than this hide at most the legs of a person.
_HIDING_HEIGHT_M: Final = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class MapView:
    """A :class:`tracking.View` in which racks and walls hide people.

    Attributes:
        camera: field of view and range of the camera; None for all directions, without limit.
        boxes_odom_m: (N, 4) boxes that are high enough to hide a person.
    """

    camera: View | None
    boxes_odom_m: FloatArray

    @classmethod
    def of(cls, warehouse: Warehouse, camera: View | None = None) -> MapView:
        """Make the view of a robot in this hall."""
        high = warehouse.layout.obstacle_heights_m >= _HIDING_HEIGHT_M
        return cls(camera, warehouse.obstacle_boxes_odom[high])

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return the visibility (N,) in [0, 1]; see :class:`tracking.View`."""
        hidden = crosses_boxes(self.boxes_odom_m, T_odom_camera[:2, 3], positions_odom_m)
        if self.camera is None:
            return np.where(hidden, 0.0, 1.0)
        return np.where(hidden, 0.0, self.camera.visibility(positions_odom_m, T_odom_camera))

    def passed(
        self, positions_odom_m: FloatArray, radii_m: FloatArray, T_odom_camera: FloatArray
    ) -> NDArray[np.bool_]:
        """Return (N,) whether each place was seen empty; see :class:`tracking.RangedView`."""
        if not isinstance(self.camera, RangedView):
            return np.zeros(len(positions_odom_m), dtype=np.bool_)
        return np.asarray(self.camera.passed(positions_odom_m, radii_m, T_odom_camera))
