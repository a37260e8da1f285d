"""The pose of a camera that stands still, at a known height or an unknown one.

Which camera took the pictures: a calibrated one, or an assumed field of view.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray, finite_number

from ..errors import AwarenavError

# Optical axes (right, down, forward) in axes of the robot (forward, left, up).
_LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def fixed_camera_pose(height_m: Any = 0.0, pitch_down_deg: Any = 0.0) -> FloatArray:
    """T_odom_camera (4, 4) with odom on the floor under the camera, x along its horizontal view.

    Args:
        height_m: of the camera above the floor, 0 to 20 m.
        pitch_down_deg: how far it looks down from the horizontal, −90 to 90.

    Raises:
        AwarenavError: for a value outside these.
    """
    height = finite_number("camera height (m)", height_m, AwarenavError, minimum=0.0, maximum=20.0)
    pitch = math.radians(
        finite_number(
            "camera pitch (deg)", pitch_down_deg, AwarenavError, minimum=-90.0, maximum=90.0
        )
    )
    turn = np.array(
        [
            [math.cos(pitch), 0.0, math.sin(pitch)],
            [0.0, 1.0, 0.0],
            [-math.sin(pitch), 0.0, math.cos(pitch)],
        ]
    )
    pose = np.eye(4)
    pose[:3, :3] = turn @ _LEVEL
    pose[2, 3] = height
    return pose


#: Assumed where nothing is known; webcams and phones lie between 55 and 75 degrees.
ASSUMED_FOV_DEG: Final = 60.0
# A video that was scaled from the calibrated size is off by rounding to whole pixels.
_ROUNDING_PX: Final = 1.0


class CameraChoice:
    """The camera for pictures of any size.

    Args:
        calibrated: a calibration; pictures of its aspect ratio in another size are taken as scaled.
        fov_deg: else the horizontal field of view; None assumes :data:`ASSUMED_FOV_DEG`.
        say: told once for every assumption that is made.
    """

    def __init__(
        self, calibrated: Camera | None, fov_deg: float | None, say: Callable[[str], None]
    ) -> None:
        self._calibrated = calibrated
        self._fov_deg = fov_deg
        self._say = say
        self._cameras: dict[tuple[int, int], Camera] = {}

    @property
    def known(self) -> bool:
        """Whether the field of view was given, not assumed."""
        return self._calibrated is not None or self._fov_deg is not None

    def of_size(self, width_px: int, height_px: int) -> Camera:
        """The camera of a picture; raises AwarenavError where the calibration cannot be of it."""
        size = (width_px, height_px)
        if size not in self._cameras:
            self._cameras[size] = self._made(width_px, height_px)
        return self._cameras[size]

    def _made(self, width_px: int, height_px: int) -> Camera:
        camera = self._calibrated
        if camera is None:
            fov_deg = self._fov_deg
            if fov_deg is None:
                fov_deg = ASSUMED_FOV_DEG
                if not self._cameras:
                    self._say(
                        f"no calibration: a horizontal field of view of {fov_deg:g} degrees is "
                        "assumed, and distances are only as good as that; give --camera or "
                        "--fov-deg"
                    )
            return Camera.from_fov(width_px, height_px, math.radians(fov_deg))
        if (width_px, height_px) == (camera.width_px, camera.height_px):
            return camera
        scaled = scaled_camera(camera, width_px, height_px)
        self._say(
            f"the calibration is for {camera.width_px} x {camera.height_px} px and is scaled to "
            f"{width_px} x {height_px} px"
        )
        return scaled


def scaled_camera(camera: Camera, width_px: int, height_px: int) -> Camera:
    """The camera of pictures that were scaled to another size of the same aspect ratio.

    Pixel centres lie at whole numbers, so the principal point scales about (−0.5, −0.5); lens
    distortion acts on rays and stays as it is.

    Raises:
        AwarenavError: when the aspect ratio differs by more than rounding to whole pixels explains.
    """
    ratio = np.array([width_px / camera.width_px, height_px / camera.height_px])
    off_px = (
        abs(width_px - camera.width_px * ratio[1]),
        abs(height_px - camera.height_px * ratio[0]),
    )
    if min(off_px) > _ROUNDING_PX:
        raise AwarenavError(
            f"the camera is calibrated for {camera.width_px} x {camera.height_px} px, and a "
            f"picture of {width_px} x {height_px} px has another aspect ratio: it was "
            "cropped, or is of another camera"
        )
    return Camera(
        width_px,
        height_px,
        camera.fx_px * ratio[0],
        camera.fy_px * ratio[1],
        (camera.cx_px + 0.5) * ratio[0] - 0.5,
        (camera.cy_px + 0.5) * ratio[1] - 0.5,
        camera.distortion,
    )
