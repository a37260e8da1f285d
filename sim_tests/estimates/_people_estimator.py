"""The whole of the perception package on pictures of any size, with a tracker behind it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception import (
    AwarenessPipeline,
    Camera,
    FloorPlane,
    HeadPoseEstimator,
    PersonDetector,
    PersonObservation,
    PoseEstimator,
)
from perception.arrays import FloatArray
from tracking import CameraView, PersonTrack, PersonTracker

from ._camera_choice import CameraChoice
from ._frame_estimate import FrameEstimate
from ._keypoint_tap import KeypointTap
from ._source_frame import SourceFrame
from ._standing_camera import standing_pose

# An observation farther than this from a track was not taken by it.
_SAME_PERSON_M: Final = 1.5
# How well height and pitch of a mounted camera are known when somebody types them in.
_MEASURED_STD_M: Final = 0.05
_MEASURED_STD_RAD: Final = math.radians(2.0)


@dataclass(frozen=True, slots=True)
class Networks:
    """The estimators that work.

    ``detector`` may be a function that makes the one for a camera; ``head_pose_estimator`` None is
    the pipeline's default.
    """

    detector: PersonDetector | Callable[[Camera], PersonDetector]
    pose_estimator: PoseEstimator
    head_pose_estimator: HeadPoseEstimator | None = None
    #: More settings of :class:`~perception.AwarenessPipeline` by name.
    settings: dict[str, Any] = field(default_factory=dict)


class PeopleEstimator:
    """Estimates people in one picture after another.

    Args:
        networks: what finds people.
        cameras: of pictures of any size.
        standing_pose_odom_camera: (4, 4) T_odom_camera of a camera that stands still and whose
            height is known, for pictures that come without a pose; it gives the floor.
        track: follows people from frame to frame. Pictures without a pose are then taken by a
            camera that stands still.
    """

    def __init__(
        self,
        networks: Networks,
        cameras: CameraChoice,
        *,
        standing_pose_odom_camera: FloatArray | None = None,
        track: bool = False,
    ) -> None:
        self._networks = networks
        self._cameras = cameras
        self._standing_pose = standing_pose_odom_camera
        self._tap = KeypointTap(networks.pose_estimator)
        self._pipelines: dict[Camera, AwarenessPipeline] = {}
        self._track = track
        self._tracker: PersonTracker | None = None

    def estimate(self, frame: SourceFrame) -> FrameEstimate:
        """Estimate the people of a frame that has a picture.

        Raises:
            SimError: for a picture that the calibrated camera cannot have taken.
            PerceptionError: for a picture or a network's answer that cannot be used.
            TrackingError: for a stamp too far before that of the last frame, with ``track``.
        """
        assert frame.image_rgb is not None
        height, width = frame.image_rgb.shape[:2]
        camera = self._cameras.of_size(width, height)
        pose = self._standing_pose if frame.T_odom_camera is None else frame.T_odom_camera
        self._tap.forget()
        observations = self._process(camera, frame)
        tracks: tuple[PersonTrack, ...] | None = None
        track_ids: tuple[int | None, ...] = (None,) * len(observations)
        if self._track:
            pose = standing_pose() if pose is None else pose
            if self._tracker is None:
                # A field that was only assumed would drop or keep people wrongly.
                view = CameraView(camera) if self._cameras.known else None
                self._tracker = PersonTracker(view=view)
            tracks = self._tracker.update(observations, frame.stamp_s, pose)
            track_ids = track_of_each(observations, tracks, pose)
        return FrameEstimate(
            frame,
            camera,
            pose,
            observations,
            tuple(self._tap.keypoints_of(each) for each in observations),
            tracks,
            track_ids,
        )

    def _process(self, camera: Camera, frame: SourceFrame) -> tuple[PersonObservation, ...]:
        pipeline = self._pipelines.get(camera)
        if pipeline is None:
            detector = self._networks.detector
            pipeline = self._pipelines[camera] = AwarenessPipeline(
                camera,
                detector if isinstance(detector, PersonDetector) else detector(camera),
                self._tap,
                self._networks.head_pose_estimator,
                **self._networks.settings,
            )
        assert frame.image_rgb is not None
        return pipeline.process(frame.image_rgb, frame.stamp_s, floor=self._floor(frame))

    def _floor(self, frame: SourceFrame) -> FloorPlane | None:
        """The floor z = 0 of odom; a recorded pose is better known than one typed in."""
        if frame.T_odom_camera is not None:
            above = frame.T_odom_camera[2, 3] > 0.0
            return FloorPlane.from_pose(frame.T_odom_camera) if above else None
        if self._standing_pose is None:
            return None
        return FloorPlane.from_pose(
            self._standing_pose, height_std_m=_MEASURED_STD_M, tilt_std_rad=_MEASURED_STD_RAD
        )


def track_of_each(
    observations: Sequence[PersonObservation],
    tracks: Sequence[PersonTrack],
    T_odom_camera: FloatArray,
) -> tuple[int | None, ...]:
    """Id of the track that each observation of the latest frame went into.

    Every observation either continues a track or begins one, so those seen now are as many; the
    nearest in sum are each other's.
    """
    now = [track for track in tracks if track.time_since_seen_s == 0.0]
    ids: list[int | None] = [None] * len(observations)
    if not now or not observations:
        return tuple(ids)
    places = np.stack([each.position_camera_m for each in observations])
    places = (places @ T_odom_camera[:3, :3].T + T_odom_camera[:3, 3])[:, :2]
    theirs = np.stack([track.position_odom_m for track in now])
    distance = np.linalg.norm(places[:, None] - theirs[None], axis=2)
    for row, column in zip(*linear_sum_assignment(distance), strict=True):
        if distance[row, column] <= _SAME_PERSON_M:
            ids[row] = now[column].id
    return tuple(ids)
