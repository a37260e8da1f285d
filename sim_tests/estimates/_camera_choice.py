"""Which camera took the pictures: a calibrated one, or an assumed field of view."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from perception import Camera

from .._errors import SimError

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
        """The camera of a picture; raises SimError where the calibration cannot be of it."""
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
        SimError: when the aspect ratio differs by more than rounding to whole pixels explains.
    """
    ratio = np.array([width_px / camera.width_px, height_px / camera.height_px])
    off_px = (
        abs(width_px - camera.width_px * ratio[1]),
        abs(height_px - camera.height_px * ratio[0]),
    )
    if min(off_px) > _ROUNDING_PX:
        raise SimError(
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
