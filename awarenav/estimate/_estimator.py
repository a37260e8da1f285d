"""What one picture says about the people in it, with what it was concluded from.

Listens to a pose estimator, so that its keypoints can be drawn and written.

The whole of the perception package on pictures of any size, with a tracker behind it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception import (
    AwarenessPipeline,
    Camera,
    FloorPlane,
    HeadPoseEstimator,
    PersonDetection,
    PersonDetector,
    PersonKeypoints,
    PersonObservation,
    PoseEstimator,
)
from perception.arrays import FloatArray
from tracking import CameraView, PersonTrack, PersonTracker

from ._camera import CameraChoice, fixed_camera_pose
from ._source import SourceFrame


@dataclass(frozen=True, slots=True, eq=False)
class FrameEstimate:
    """The estimate of one frame.

    Attributes:
        frame: the picture.
        camera: that took it.
        T_odom_camera: (4, 4) the pose that was used, or None when none was needed.
        observations: one a person.
        keypoints: of each observation's person; None where they are not known.
        tracks: everybody who is followed, or None when nobody is followed.
        track_ids: of each observation, the track that took it; None when nobody is followed.
    """

    frame: SourceFrame
    camera: Camera
    T_odom_camera: FloatArray | None
    observations: tuple[PersonObservation, ...]
    keypoints: tuple[PersonKeypoints | None, ...]
    tracks: tuple[PersonTrack, ...] | None
    track_ids: tuple[int | None, ...]


class RecordingPoseEstimator:
    """A :class:`~perception.PoseEstimator` that passes another's answers on and remembers them.

    Args:
        estimator: the one that works.
    """

    def __init__(self, estimator: PoseEstimator) -> None:
        self._estimator = estimator
        self._last: dict[bytes, PersonKeypoints] = {}

    def estimate(
        self, image_rgb: NDArray[np.uint8], detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return what the other estimator returns."""
        people = tuple(self._estimator.estimate(image_rgb, detections))
        self._last = {
            detection.box_xyxy_px.tobytes(): person
            for detection, person in zip(detections, people, strict=False)
        }
        return people

    def forget(self) -> None:
        """Forget the last picture; without a detection the estimator is not even asked."""
        self._last = {}

    def keypoints_of(self, observation: PersonObservation) -> PersonKeypoints | None:
        """The keypoints behind an observation of the last picture, known by its box."""
        box = observation.box_xyxy_px
        return None if box is None else self._last.get(box.tobytes())


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
        self._tap = RecordingPoseEstimator(networks.pose_estimator)
        self._pipelines: dict[Camera, AwarenessPipeline] = {}
        self._track = track
        self._tracker: PersonTracker | None = None

    def estimate(self, frame: SourceFrame) -> FrameEstimate:
        """Estimate the people of a frame that has a picture.

        Raises:
            AwarenavError: for a picture that the calibrated camera cannot have taken.
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
            pose = fixed_camera_pose() if pose is None else pose
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
