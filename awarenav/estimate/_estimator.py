"""Estimates of the people in images of any size, with their keypoints and tracks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception import (
    AwarenessPipeline,
    Camera,
    FloorPlane,
    PersonObservation,
)
from perception.arrays import FloatArray
from perception.errors import DepthImageError
from perception.named import Networks
from perception.no_view import LastFrames, NoView, why_no_view
from perception.turn import QuarterTurn
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig

from ..errors import AwarenavError
from ._camera import CameraChoice, fixed_camera_pose
from ._depth_files import DepthFiles
from ._pictures import FIRST_TRANSPOSED, UPRIGHT
from ._sources import SourceFrame

# An observation farther than this from a track does not belong to it.
_SAME_PERSON_M: Final = 1.5
# Pictures may lie days apart, and nobody sets a recording's clock.
_OF_RECORDINGS: Final = TrackerConfig(max_pause_s=1e12, new_clock_after_s=1e5)
# Accuracy of the height and pitch of a fixed camera that the user types in.
_MEASURED_STD_M: Final = 0.05
_MEASURED_STD_RAD: Final = math.radians(2.0)


@dataclass(frozen=True, slots=True, eq=False)
class FrameEstimate:
    """The estimate of a frame.

    Attributes:
        frame: with the image.
        camera: of the image.
        T_odom_camera: (4, 4) pose that was used; None if none was needed.
        observations: one per person.
        tracks: all tracks; None without a tracker.
        track_ids: of each observation, the id of its track; None without a tracker.
        unfit: roles of the networks that have seen renders only, unless the image is one.
        no_view: why the image shows nothing; None if it does. The tracks are then those without it.
    """

    frame: SourceFrame
    camera: Camera
    T_odom_camera: FloatArray | None
    observations: tuple[PersonObservation, ...]
    tracks: tuple[PersonTrack, ...] | None
    track_ids: tuple[int | None, ...]
    unfit: tuple[str, ...] = ()
    no_view: NoView | None = None


class PeopleEstimator:
    """Estimates the people in one image after another.

    Args:
        networks: detector and estimators.
        cameras: give the camera of images of any size.
        fixed_pose_odom_camera: (4, 4) T_odom_camera of a fixed camera of known height, for images
            without a pose; it gives the floor.
        up_camera: (3,) direction up in the camera frame, for images without a pose; None where it
            is not known.
        track: tracks people from frame to frame. Images of a source without poses then count as
            those of a fixed camera. Where some images have a pose, the others find nobody's place.
        depth: the depth images of the frames; None without any.
        unfit: roles of the networks that are not made for such images; every estimate has them.
    """

    def __init__(
        self,
        networks: Networks,
        cameras: CameraChoice,
        *,
        fixed_pose_odom_camera: FloatArray | None = None,
        up_camera: FloatArray | None = None,
        track: bool = False,
        depth: DepthFiles | None = None,
        unfit: tuple[str, ...] = (),
    ) -> None:
        self._networks = networks
        self._cameras = cameras
        self._fixed_pose, self._up_camera = fixed_pose_odom_camera, up_camera
        self._pipelines: dict[Camera, AwarenessPipeline] = {}
        self._track, self._unfit, self._depth = track, unfit, depth
        self._tracker: PersonTracker | None = None
        self._last = LastFrames()
        self._moves = False

    def estimate(self, frame: SourceFrame) -> FrameEstimate:
        """Estimate the people in a frame that has an image.

        Raises:
            AwarenavError: for an image that the calibrated camera cannot have taken, or a depth
                image that is missing or cannot be used.
            PerceptionError: for an image, or the output of a network, that cannot be used.
            TrackingError: with ``track``, for a stamp too far before that of the last frame.
        """
        assert frame.image_rgb is not None
        height, width = frame.image_rgb.shape[:2]
        self._require_known_turn(frame)
        camera = self._cameras.of_size(width, height, frame.focal_px)
        pose = self._fixed_pose if frame.T_odom_camera is None else frame.T_odom_camera
        if frame.T_odom_camera is not None and not self._moves:
            self._moves, self._tracker = True, None  # earlier people were placed without poses
        no_view = why_no_view(frame.image_rgb, self._last)
        up_camera = self._up_camera if pose is None else pose[2, :3]
        observations = self._process(camera, frame, up_camera)
        tracks: tuple[PersonTrack, ...] | None = None
        track_ids: tuple[int | None, ...] = (None,) * len(observations)
        if self._moves and frame.T_odom_camera is None:
            pose = None  # a camera on a robot is nowhere else meanwhile
        if self._track:
            if pose is None and not self._moves:
                pose = fixed_camera_pose()
                pose[:3, :3] @= QuarterTurn.upright(up_camera).rotation_camera_view.T
            if self._tracker is None:
                # An assumed field of view would drop or keep people wrongly.
                view = CameraView(camera) if self._cameras.known else None
                self._tracker = PersonTracker(_OF_RECORDINGS, view=view)
            if no_view is None and pose is not None:
                tracks = self._tracker.update(observations, frame.stamp_s, pose)
            else:
                last_s = self._tracker.last_stamp_s
                now_s = frame.stamp_s if last_s is None else max(frame.stamp_s, last_s)
                tracks = self._tracker.predict(now_s)
            if pose is not None:
                track_ids = ids_of_tracks(observations, tracks, pose)
        return FrameEstimate(
            frame,
            camera,
            pose,
            observations,
            tracks,
            track_ids,
            self._unfit,
            no_view,
        )

    def pass_over(self, frame: SourceFrame) -> None:
        """Note a frame that is not estimated: the next one may be the same picture."""
        if frame.image_rgb is not None:
            self._last.repeats(frame.image_rgb)

    def _require_known_turn(self, frame: SourceFrame) -> None:
        """Refuse a picture that its file has turned where the pixels of the sensor count.

        Nothing says whether a calibration or depth image is for the picture as stored or as shown;
        only of a quarter turn, the size tells.
        """
        assert frame.image_rgb is not None
        orientation = frame.orientation
        height, width = frame.image_rgb.shape[:2]
        if orientation == UPRIGHT or not (self._cameras.calibrated or self._depth is not None):
            return
        if orientation >= FIRST_TRANSPOSED and height != width:
            with suppress(AwarenavError):
                self._cameras.of_size(width, height)
                return
        raise AwarenavError(
            f"the file turns the picture (EXIF orientation {orientation}), and the calibration or "
            "depth image may be for the pixels as stored: save the pixels upright, without an "
            "orientation in the file, or give --fov-deg and no --depth"
        )

    def _process(
        self, camera: Camera, frame: SourceFrame, up_camera: FloatArray | None
    ) -> tuple[PersonObservation, ...]:
        pipeline = self._pipelines.get(camera)
        if pipeline is None:
            pipeline = AwarenessPipeline.of(self._networks, camera)
            self._pipelines[camera] = pipeline
        assert frame.image_rgb is not None
        floor = self._floor(frame)
        seen = partial(
            pipeline.process, frame.image_rgb, frame.stamp_s, floor=floor, up_camera=up_camera
        )
        if self._depth is None:
            return seen()
        path, depth_m = self._depth.of(frame.name)
        try:
            return seen(depth_m=depth_m)
        except DepthImageError as cause:
            raise AwarenavError(f"{path}: {cause}") from cause

    def _floor(self, frame: SourceFrame) -> FloorPlane | None:
        """Return the floor z = 0 of odom: by an exact pose, else a typed one, else the robot's.

        A robot's odom may begin elsewhere, at the camera for example.
        """
        exact = frame.T_odom_camera is not None and not frame.on_robot
        pose = frame.T_odom_camera if exact or self._fixed_pose is None else self._fixed_pose
        if pose is None or pose[2, 3] <= 0.0:
            return None
        if exact:
            return FloorPlane.from_pose(pose)
        return FloorPlane.from_pose(
            pose, height_std_m=_MEASURED_STD_M, tilt_std_rad=_MEASURED_STD_RAD
        )


def ids_of_tracks(
    observations: Sequence[PersonObservation],
    tracks: Sequence[PersonTrack],
    T_odom_camera: FloatArray,
) -> tuple[int | None, ...]:
    """Return the id of the track of each observation of the latest frame; None if it is too far.

    Every observation continues a track or starts one, so there are as many tracks that are seen now
    as observations. They are matched by the least sum of distances.
    """
    seen = [track for track in tracks if track.time_since_seen_s == 0.0]
    ids: list[int | None] = [None] * len(observations)
    if not seen or not observations:
        return tuple(ids)
    observed = np.stack([each.position_camera_m for each in observations])
    observed = (observed @ T_odom_camera[:3, :3].T + T_odom_camera[:3, 3])[:, :2]
    tracked = np.stack([track.position_odom_m for track in seen])
    distance = np.linalg.norm(observed[:, None] - tracked[None], axis=2)
    for row, column in zip(*linear_sum_assignment(distance), strict=True):
        if distance[row, column] <= _SAME_PERSON_M:
            ids[row] = seen[column].id
    return tuple(ids)
