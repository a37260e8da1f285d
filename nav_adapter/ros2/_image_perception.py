"""The networks of the bridge: from an image to tracks."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from perception import AwarenessPipeline, Camera, FloorPlane, PersonObservation
from perception.arrays import FloatArray
from perception.errors import DepthImageError
from perception.no_view import FROZEN, NoView, why_no_view
from tracking import PersonTrack

from .._errors import NavError
from ._depth_reader import StampedDepth
from ._images import camera_of, picture_of
from ._shared_tracker import SharedTracker
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image

# Uncertainty of the height and the tilt of a camera on a driving robot.
_HEIGHT_STD_M = 0.05
_TILT_STD_RAD = math.radians(2.0)


@dataclass(frozen=True, eq=False)
class PerceivedFrame:
    """One frame: image, people and tracks. Immutable, so that threads can share it.

    Attributes:
        stamp_s: of the image.
        tracks: all tracks at that time, or at that of a later scan.
        image: (H, W, 3) uint8 RGB.
        observations: one per person seen.
        T_odom_camera: (4, 4) pose of the camera.
        depth: the depth image that was used; None without one.
        depth_problem: why a depth image was not used; empty if it was, or there was none.
    """

    stamp_s: float
    tracks: tuple[PersonTrack, ...]
    image: NDArray[np.uint8]
    observations: tuple[PersonObservation, ...]
    T_odom_camera: FloatArray
    depth: StampedDepth | None = None
    depth_problem: str = ""


class ImagePerception:
    """The pipeline, from the first calibration on.

    One thread at a time is in :meth:`process` or :meth:`calibrate`; others wait.

    Args:
        make_pipeline: makes the pipeline for a camera.
        tracker: takes the people of each image.
        camera: calibration; None until :meth:`calibrate`.
        rectified: whether the images are rectified: a calibration's P counts.
    """

    def __init__(
        self,
        make_pipeline: Callable[[Camera], AwarenessPipeline],
        tracker: SharedTracker,
        camera: Camera | None,
        rectified: bool = False,
    ) -> None:
        self._make_pipeline, self._tracker = make_pipeline, tracker
        self._busy = threading.Lock()
        self._camera: Camera | None = None
        self._info: CameraInfo | None = None
        self._rectified = rectified
        self._before: NDArray[np.uint8] | None = None
        self._has_had_view = False
        if camera is not None:
            self._start(camera)

    @property
    def camera(self) -> Camera | None:
        """The camera, or None while it is unknown. The pipeline exists as soon as it is known."""
        return self._camera

    def calibrate(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; later ones are ignored.

        Raises:
            NavError, PerceptionError: for a calibration or networks that cannot be used.
        """
        with self._busy:
            if self._camera is None:
                self._start(camera_of(message, rectified=self._rectified))
                self._info = message

    def process(
        self,
        message: Image | CompressedImage,
        stamp_s: float,
        T_odom_camera: FloatArray,
        is_current: Callable[[], bool],
        depth: StampedDepth | None = None,
    ) -> PerceivedFrame | None:
        """Return the frame of an image, or None if ``is_current`` says that it came too late.

        A depth image that does not fit is left out, and the frame says why.

        Raises:
            NavError, PerceptionError, TrackingError: for an image that cannot be used, or shows
                nothing (:func:`~perception.no_view.why_no_view`).
        """
        with self._busy:
            image = picture_of(message)
            self._fit(image.shape[1], image.shape[0])
            no_view, self._before = why_no_view(image, self._before), image
            if no_view and self._has_had_view:
                raise _refusal(no_view)
            self._has_had_view = no_view is None
            floor, problem = _floor(T_odom_camera), ""
            try:
                given = {} if depth is None else _given(depth)
                observations = self._pipeline.process(image, stamp_s, floor=floor, **given)
            except DepthImageError as cause:  # before any network has run
                depth, problem = None, str(cause)
                observations = self._pipeline.process(image, stamp_s, floor=floor)
            # Of a camera that has never had a view, such as a stand-in with blank pictures, people
            # who are found count; that nobody is found means nothing.
            if no_view and not observations:
                raise _refusal(no_view)
            tracks = self._tracker.update(observations, stamp_s, T_odom_camera, is_current)
        if tracks is None:
            return None
        return PerceivedFrame(stamp_s, tracks, image, observations, T_odom_camera, depth, problem)

    def _fit(self, width_px: int, height_px: int) -> None:
        """Make sure that the camera is that of images of this size.

        Raises:
            NavError: if the calibration is for other images.
        """
        camera, size_px = self._camera, (width_px, height_px)
        assert camera is not None
        if (camera.width_px, camera.height_px) == size_px:
            return
        if self._info is not None:  # the images may be the full ones in spite of roi and binning
            camera = camera_of(self._info, rectified=self._rectified, image_size_px=size_px)
        if (camera.width_px, camera.height_px) != size_px:
            raise NavError(
                f"the camera is calibrated for {camera.width_px} x {camera.height_px} px, but the "
                f"images have {width_px} x {height_px} px"
            )
        self._start(camera)

    def _start(self, camera: Camera) -> None:
        self._pipeline = self._make_pipeline(camera)
        self._tracker.use_camera(camera)
        self._camera = camera


def _refusal(no_view: NoView) -> NavError:
    hint = " (frozen? a simulated camera needs noise)" if no_view == FROZEN else ""
    return NavError(f"the picture is no view: it is {no_view}{hint}")


def _given(depth: StampedDepth) -> dict[str, Any]:
    return {"depth_m": depth.depth, "depth_stamp_s": depth.stamp_s}


def _floor(T_odom_camera: FloatArray) -> FloorPlane | None:
    """Return the floor, z = 0 in odom, or None for a camera that is not above it."""
    if T_odom_camera[2, 3] <= 0.0:
        return None
    return FloorPlane.from_pose(
        T_odom_camera, height_std_m=_HEIGHT_STD_M, tilt_std_rad=_TILT_STD_RAD
    )
