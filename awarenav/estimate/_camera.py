"""The camera of the images: its calibration or an assumed one, and the pose of a fixed camera."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray, finite_number

from ..errors import AwarenavError
from ._sources import ImageSource

#: Assumed without a calibration, across the longer side; webcams and phones have 55 to 75 degrees.
ASSUMED_FOV_DEG: Final = 60.0

# Optical axes (right, down, forward) of a level camera in axes of the robot (forward, left, up).
_LEVEL: Final = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
# The size of a scaled video is rounded to whole pixels.
_ROUNDING_PX: Final = 1.0


def fixed_camera_pose(height_m: Any = 0.0, pitch_down_deg: Any = 0.0) -> FloatArray:
    """Return T_odom_camera (4, 4); odom is on the floor under the camera, x along its view.

    Args:
        height_m: of the camera above the floor, 0 to 20 m.
        pitch_down_deg: angle by which it looks down from the horizontal, −90 to 90 degrees.

    Raises:
        AwarenavError: for a value outside these limits.
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


class CameraChoice:
    """The camera for images of any size.

    Args:
        calibrated: a calibration, or the path of its file; an image of its aspect ratio in another
            size counts as scaled.
        fov_deg: horizontal field of view without a calibration; None takes that of the image's
            EXIF data, or assumes :data:`ASSUMED_FOV_DEG`.
        log: gets one message about every assumption.
        rectified: whether the images are rectified: P of the file counts.

    Raises:
        PerceptionError: for a file that cannot be used.
    """

    def __init__(
        self,
        calibrated: Camera | Path | None,
        fov_deg: float | None,
        log: Callable[[str], None],
        *,
        rectified: bool = False,
    ) -> None:
        if isinstance(calibrated, Path):
            Camera.from_yaml(calibrated, rectified=rectified)  # refused before any work
        self._calibrated, self._rectified = calibrated, rectified
        self._fov_deg = fov_deg
        self._log = log
        self._cameras: dict[tuple[int, int, float | None], Camera] = {}
        self._said: set[str] = set()

    @classmethod
    def of_options(
        cls,
        camera: Path | None,
        fov_deg: float | None,
        source: ImageSource,
        log: Callable[[str], None],
    ) -> CameraChoice:
        """Return the choice of ``--camera`` and ``--fov-deg``, else of the source.

        Without them only, the source's own calibration is read.

        Raises:
            AwarenavError: for a calibration that cannot be used.
        """
        own = source.camera if camera is None and fov_deg is None else None
        return cls(camera or own, fov_deg, log, rectified=source.rectified)

    @property
    def known(self) -> bool:
        """True if the field of view is known, False if it is assumed."""
        return self._calibrated is not None or self._fov_deg is not None

    @property
    def calibrated(self) -> bool:
        """True if there is a calibration, which is for pixels where the camera has them."""
        return self._calibrated is not None

    def of_size(self, width_px: int, height_px: int, focal_px: float | None = None) -> Camera:
        """Return the camera of images of this size.

        ``focal_px`` is their focal length by EXIF, which counts without a calibration.

        Raises:
            AwarenavError: if the calibrated camera cannot have taken them.
        """
        key = (width_px, height_px, None if self.known else focal_px)
        if key not in self._cameras:
            self._cameras[key] = self._make(*key)
        return self._cameras[key]

    def _make(self, width_px: int, height_px: int, focal_px: float | None) -> Camera:
        """Make the camera of images of this size; log what is assumed."""
        camera = self._calibrated
        if camera is None:
            if self._fov_deg is not None:
                return Camera.from_fov(width_px, height_px, math.radians(self._fov_deg))
            longer, words = max(width_px, height_px), "by its EXIF data"
            if focal_px is None:
                half_rad = 0.5 * math.radians(ASSUMED_FOV_DEG)
                focal_px, words = 0.5 * longer / math.tan(half_rad), "assumed"
            across_deg = math.degrees(2.0 * math.atan(0.5 * longer / focal_px))
            text = (
                f"no calibration: {across_deg:.0f} degrees across the longer side are {words}, and "
                "distances may be wrong; give --camera or --fov-deg"
            )
            if text not in self._said:
                self._said.add(text)
                self._log(text)
            middle = 0.5 * width_px, 0.5 * height_px
            return Camera(width_px, height_px, focal_px, focal_px, *middle)
        if isinstance(camera, Path):
            size_px = (width_px, height_px)
            camera = Camera.from_yaml(camera, rectified=self._rectified, image_size_px=size_px)
        if (width_px, height_px) == (camera.width_px, camera.height_px):
            return camera
        scaled = scaled_camera(camera, width_px, height_px)
        self._log(
            f"the calibration is for {camera.width_px} x {camera.height_px} px and is scaled to "
            f"{width_px} x {height_px} px"
        )
        return scaled


def scaled_camera(camera: Camera, width_px: int, height_px: int) -> Camera:
    """Return the camera of images that were scaled to another size of the same aspect ratio.

    Pixel centres are at whole numbers, so the principal point scales about (−0.5, −0.5). Lens
    distortion acts on rays and does not change.

    Raises:
        AwarenavError: if the aspect ratio differs by more than rounding to whole pixels.
    """
    ratio = np.array([width_px / camera.width_px, height_px / camera.height_px])
    off_px = (
        abs(width_px - camera.width_px * ratio[1]),
        abs(height_px - camera.height_px * ratio[0]),
    )
    if min(off_px) > _ROUNDING_PX:
        raise AwarenavError(
            f"the camera is calibrated for {camera.width_px} x {camera.height_px} px, but an image "
            f"of {width_px} x {height_px} px has another aspect ratio: it was cropped, or is from "
            "another camera"
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
