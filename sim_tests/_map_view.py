"""What a robot that knows its hall expects to see: its camera's view less what racks hide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from perception.arrays import FloatArray
from tracking import View

from ._line_of_sight import crosses_boxes
from ._warehouse import Warehouse

# Lower things hide legs at most.
_HIDING_HEIGHT_M = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class MapView:
    """A view for the tracker: in the camera's field, in range, and with no rack in between.

    Attributes:
        camera: field and range of the camera; None looks all around and as far as may be.
        boxes_odom_m: (N, 4) what is high enough to hide a person.
    """

    camera: View | None
    boxes_odom_m: FloatArray

    @classmethod
    def of(cls, warehouse: Warehouse, camera: View | None = None) -> MapView:
        """The view in a hall whose racks and walls the robot knows."""
        high = warehouse.layout.obstacle_heights_m >= _HIDING_HEIGHT_M
        return cls(camera, warehouse.obstacle_boxes_odom[high])

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return (N,) in [0, 1]; see :class:`tracking.View`."""
        hidden = crosses_boxes(self.boxes_odom_m, T_odom_camera[:2, 3], positions_odom_m)
        if self.camera is None:
            return np.where(hidden, 0.0, 1.0)
        return np.where(hidden, 0.0, self.camera.visibility(positions_odom_m, T_odom_camera))
