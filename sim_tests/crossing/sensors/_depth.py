"""A camera that measures depth as well: an RGB-D camera."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from perception.arrays import FloatArray

from ...scenario import CameraSpec
from ...world.camera import CameraRenderer
from ._keypoints import Keypoints
from ._sensor import SensorSetup, World

# Random streams of the depth are separate from all others of an episode.
_STREAM: Final = 0xDE97
# The depth has one pixel where the image has this many a side, as it is aligned with the image.
_DIVISOR: Final = 4
# What a stereo camera with a baseline of 12 cm measures: from 0.3 m to 15 m, with a standard
# deviation that grows with the square of the distance (2.4 cm at 4 m, from a tenth of a pixel of
# disparity), and nothing in a tenth of its pixels.
_RANGE_M: Final = (0.3, 15.0)
_STD_PER_M: Final = 0.0015
_HOLES: Final = 0.1


class Depth(Keypoints, name="depth"):
    """A keypoint camera whose people also have the range of a rendered depth picture."""

    costly = True

    @staticmethod
    def scale(spec: CameraSpec) -> float:
        """Return a half: such cameras have few pixels."""
        return 0.5

    def __init__(self, setup: SensorSetup) -> None:
        super().__init__(setup)
        self._depth_rng = np.random.default_rng([_STREAM, setup.seed])
        self._renderer = CameraRenderer(setup.stage.warehouse)
        spec = setup.stage.scenario.camera
        self._coarse = spec.camera(self.scale(spec) / _DIVISOR)

    def depth_m(self, world: World) -> FloatArray:
        """Return the depth (H, W) as measured, 0 in its holes."""
        seen_m = self._renderer.render(self._coarse, world.T_odom_camera).depth_m
        least_m, most_m = _RANGE_M
        hole = ~((seen_m >= least_m) & (seen_m <= most_m))
        hole |= self._depth_rng.random(seen_m.shape) < _HOLES
        true_m = np.where(hole, 0.0, seen_m)
        noise = self._depth_rng.standard_normal(seen_m.shape)
        measured_m = true_m + _STD_PER_M * true_m**2 * noise
        size = self.camera.width_px, self.camera.height_px
        return np.asarray(cv2.resize(measured_m, size, interpolation=cv2.INTER_NEAREST), np.float64)
