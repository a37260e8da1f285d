"""The camera of the bridge: from images, and depth images of their time, to tracks."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception import AwarenessPipeline, Camera, FloorPlane, PersonObservation
from perception.arrays import FloatArray
from perception.depth_image import MOST_APART_S
from perception.errors import DepthImageError
from perception.no_view import FROZEN, LastFrames, why_no_view
from perception.picture_notes import picture_notes
from tracking import PersonTrack

from .._errors import NavError
from ..rules import CREEPING_MPS
from ._images import camera_of, depth_of, picture_of
from ._poses import PoseSpread
from ._shared import Input, Shared
from .conversions import pose_matrix, to_seconds, yaw_quaternion
from .messages.geometry_msgs import Point
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image

# Uncertainty of the height and the tilt of a camera on a driving robot.
_HEIGHT_STD_M = 0.05
_TILT_STD_RAD = math.radians(2.0)
_NEEDS_NOISE: Final = " (frozen? a simulated camera needs noise)"
_SAME: Final = (
    f"the picture is {FROZEN}{_NEEDS_NOISE}: nobody counts as aware, and the robot may creep until "
    "it has moved, and stops if the picture is still the same"
)
# Depth images that are kept: a quarter of a second at 30 Hz.
_KEPT: Final = 8


class StampedDepth(NamedTuple):
    """A depth image (H, W), uint16 millimetres or float32 metres, and its time."""

    stamp_s: float
    depth: NDArray[Any]


class DepthInput(Input):
    """The latest depth images, of which each picture is given the one nearest to it in time.

    Where one cannot be used, the picture is seen without. Only one that perception has used counts
    as heard.
    """

    def __init__(self, shared: Shared) -> None:
        super().__init__(shared, "depth image")
        self._kept: deque[StampedDepth] = deque(maxlen=_KEPT)
        self._refuses = False

    def nearest(self, stamp_s: float) -> StampedDepth | None:
        """Return the depth image of a picture; None if none is near enough in time."""
        with self._shared.lock:
            found = min(self._kept, key=lambda each: abs(each.stamp_s - stamp_s), default=None)
            if found is None or abs(apart_s := found.stamp_s - stamp_s) <= MOST_APART_S:
                return found
            side = "before" if apart_s < 0.0 else "after"
            apart = (
                f"none that has come is within {MOST_APART_S:g} s of its picture, the nearest is "
                f"{abs(apart_s):.3f} s {side} it; the driver must send both at one rate and of one "
                "time (enable_sync or the like)"
            )
            self._shared.watch.depth_unused("they are refused" if self._refuses else apart)
        return None

    def refuse(self, problem: str, now_s: float) -> None:
        self._refuses = True
        super().refuse(problem, now_s)

    def note_used(self, depth: StampedDepth) -> None:
        """Note a depth image that perception has used; called with the lock."""
        self.used += 1
        self._shared.watch.saw_depth(depth.stamp_s)

    def forget(self) -> None:
        super().forget()
        self._kept.clear()

    def _use(self, message: Image, now_s: float) -> bool:
        stamp_s, depth = to_seconds(message.header.stamp), depth_of(message)
        with self._shared.lock:
            self._shared.clock.check("depth_images", stamp_s, now_s, "its")
            if self._last.repeats(depth):
                raise NavError(f"it is the same depth image as before{_NEEDS_NOISE}")
            self._kept.append(StampedDepth(stamp_s, depth))
            self._refuses = False
        return True


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
        repeats: whether the picture is the same as before; nobody then has an awareness.
    """

    stamp_s: float
    tracks: tuple[PersonTrack, ...]
    image: NDArray[np.uint8]
    observations: tuple[PersonObservation, ...]
    T_odom_camera: FloatArray
    depth: StampedDepth | None = None
    depth_problem: str = ""
    repeats: bool = False


class ImageInput(Input):
    """The bridge's camera: from its images to tracks, from the first calibration on.

    One thread at a time is in :meth:`read` or :meth:`calibrate`; others wait. With ``creeps``, the
    robot creeps where no sensor has seen the way: so it does before pictures that only repeat,
    while it has not moved.

    Attributes:
        camera: None while it is unknown. The pipeline exists as soon as it is known.
        frame: the latest, or None before the first.
        depth: the depth images; None if there are none.
    """

    def __init__(
        self,
        shared: Shared,
        make_pipeline: Callable[[Camera], AwarenessPipeline],
        camera: Camera | None,
        *,
        rectified: bool = False,
        with_depth: bool = False,
        creeps: bool = True,
    ) -> None:
        super().__init__(shared, "image")
        # With the robot's pose at the first of equal pictures.
        self._stood, self._creeps = LastFrames(), creeps
        self._live_s = math.inf
        self._make_pipeline = make_pipeline
        self.frame: PerceivedFrame | None = None
        self.depth = DepthInput(shared) if with_depth else None
        self._busy = threading.Lock()
        self.camera: Camera | None = None
        self._info: CameraInfo | None = None
        self._rectified = rectified
        if camera is not None:
            self._start(camera)

    def calibrate(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; later ones are ignored.

        Raises:
            NavError, PerceptionError: for a calibration or networks that cannot be used.
        """
        with self._busy:
            if self.camera is None:
                self._start(camera_of(message, rectified=self._rectified))
                self._info = message

    def refuse(self, problem: str, now_s: float) -> None:
        """Report an image that cannot be used: each is, for none may come that can."""
        with self._shared.lock:
            self._shared.watch.image_unused(problem)
        self._shared.warn(f"image: {problem}")

    def forget(self) -> None:
        super().forget()
        self.frame, self._live_s = None, math.inf
        if self.depth is not None:
            self.depth.forget()

    def _use(self, message: Image | CompressedImage, now_s: float) -> bool:
        shared = self._shared
        stamp_s, frame_id = to_seconds(message.header.stamp), message.header.frame_id
        with shared.lock:
            if self.camera is None:
                raise NavError("no camera_info yet: the image cannot be used")
            shared.clock.check("images", stamp_s, now_s, "the image's")
            is_current = shared.still_current()
            T_odom_camera = shared.poses.T_odom_camera(frame_id, stamp_s)
            spread = shared.poses.spread(stamp_s, frame_id)
        depth = None if self.depth is None else self.depth.nearest(stamp_s)
        frame = self._process(message, stamp_s, T_odom_camera, is_current, spread, depth)
        with shared.lock:
            if frame is None or not is_current():
                return False
            self.frame = frame
            if frame.repeats:
                shared.watch.saw_same_image(stamp_s)
                self.refuse(_SAME, now_s)
                return False
            self.used += 1
            self._live_s = stamp_s
            if self.used == 1:
                for note in picture_notes(frame.image):
                    shared.warn(f"image: {note}")
            T_base_camera = shared.poses.camera_in_base(frame_id, stamp_s)
            shared.watch.saw_image(stamp_s, self.camera, T_base_camera)
            if self.depth is not None and frame.depth is not None:
                self.depth.note_used(frame.depth)
        if self.depth is not None and frame.depth_problem:
            self.depth.refuse(frame.depth_problem, now_s)
        return True

    def _process(
        self,
        message: Image | CompressedImage,
        stamp_s: float,
        T_odom_camera: FloatArray,
        is_current: Callable[[], bool],
        spread: PoseSpread,
        depth: StampedDepth | None,
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
            may_creep = self._may_creep(image, stamp_s)
            no_view = why_no_view(image, self._last)
            repeats = no_view == FROZEN and may_creep
            if no_view and not repeats:
                hint = _NEEDS_NOISE if no_view == FROZEN else ""
                raise NavError(f"the picture is no view: it is {no_view}{hint}")
            problem, seen = (
                "",
                partial(
                    self._pipeline.process,
                    image,
                    stamp_s,
                    _floor(T_odom_camera),
                    up_camera=T_odom_camera[2, :3],
                ),
            )
            try:
                given: dict[str, Any] = {}
                if depth is not None:
                    given = {"depth_m": depth.depth, "depth_stamp_s": depth.stamp_s}
                observations = seen(**given)
            except DepthImageError as cause:  # before any network has run
                depth, problem = None, str(cause)
                observations = seen()
            if repeats:  # places alone: an old look is no evidence
                observations = tuple(map(_without_look, observations))
            tracks = self._shared.tracker.update(
                observations, stamp_s, T_odom_camera, is_current, spread
            )
        if tracks is None:
            return None
        return PerceivedFrame(
            *(stamp_s, tracks, image, observations, T_odom_camera, depth, problem, repeats)
        )

    def _may_creep(self, image: NDArray[np.uint8], stamp_s: float) -> bool:
        """Return whether a picture, if it repeats, may be of a camera that lives.

        So it may while the robot is where it was at the first of the same, and no faster than it
        creeps, and no other picture has come for so long that it counts as lost. Each picture is
        asked.
        """
        with self._shared.lock:
            state, lost_s = self._shared.poses.state, self._shared.watch.lost_after_s
        if state is None:
            return False
        x, y = state.position_odom_m.tolist()
        T_odom_base = pose_matrix(Point(x, y), yaw_quaternion(state.heading_odom_rad))
        moved = self._stood.repeats(image, T_odom_base)
        late = stamp_s - self._live_s > lost_s
        return self._creeps and late and not moved and state.travel_mps <= CREEPING_MPS

    def _fit(self, width_px: int, height_px: int) -> None:
        """Make sure that the camera is that of images of this size.

        Raises:
            NavError: if the calibration is for other images.
        """
        camera, size_px = self.camera, (width_px, height_px)
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
        self._shared.tracker.use_camera(camera)
        self.camera = camera


def _without_look(observation: PersonObservation) -> PersonObservation:
    return replace(
        observation, gaze_camera=None, awareness=None, awareness_std=None, eyes_seen=False
    )


def _floor(T_odom_camera: FloatArray) -> FloorPlane | None:
    """Return the floor, z = 0 in odom, or None for a camera that is not above it."""
    if T_odom_camera[2, 3] <= 0.0:
        return None
    return FloorPlane.from_pose(
        T_odom_camera, height_std_m=_HEIGHT_STD_M, tilt_std_rad=_TILT_STD_RAD
    )
