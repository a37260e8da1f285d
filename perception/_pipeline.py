"""The awareness pipeline: one RGB frame in, one observation a person out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ._attention import AttentionCone
from ._awareness import awareness_of
from ._body import place_body, place_box
from ._camera import Camera
from ._detection import PersonDetection
from ._errors import PerceptionError
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from ._metric_scale import DEFAULT_MIN_SCORE
from ._observation import PersonObservation
from ._pnp import PnpHeadPoseEstimator
from ._protocols import HeadPoseEstimator, ImageRgb, PersonDetector, PoseEstimator
from .arrays import FloatArray, finite_array, finite_number

_CAMERA_CENTRE: Final = np.zeros((1, 3))


class AwarenessPipeline:
    """Detection, keypoints, head pose and awareness for every person in a frame.

    Args:
        camera: the robot's camera.
        detector: finds people.
        pose_estimator: finds their keypoints.
        head_pose_estimator: finds their head poses; default :class:`PnpHeadPoseEstimator`.
        cone: the attention cone; default half-angle 60°.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame, of which seeing any
            one counts as seeing the robot; default the camera's centre, as in the paper.
        keypoint_std_px: noise of the keypoints assumed for the body's position.
        min_score: keypoints scored below this count as not seen.

    Raises:
        PerceptionError: when detector or pose estimator is missing, or a value is not valid.
    """

    def __init__(
        self,
        camera: Camera,
        detector: PersonDetector | None = None,
        pose_estimator: PoseEstimator | None = None,
        head_pose_estimator: HeadPoseEstimator | None = None,
        cone: AttentionCone | None = None,
        robot_points_camera_m: Any | None = None,
        *,
        keypoint_std_px: float = 1.0,
        min_score: float = DEFAULT_MIN_SCORE,
    ) -> None:
        if not isinstance(camera, Camera):
            raise PerceptionError(f"camera must be a Camera, got {type(camera).__name__}")
        if detector is None or pose_estimator is None:
            missing = "detector" if detector is None else "pose_estimator"
            raise PerceptionError(
                f"{missing} must be given: this version ships no person detector and no pose "
                "network. Pass any object with the methods of perception.PersonDetector and "
                "perception.PoseEstimator."
            )
        self.camera = camera
        self.cone = AttentionCone() if cone is None else cone
        self._detector = detector
        self._pose_estimator = pose_estimator
        self._head_pose_estimator: HeadPoseEstimator = (
            PnpHeadPoseEstimator(keypoint_std_px, min_score)
            if head_pose_estimator is None
            else head_pose_estimator
        )
        points = _CAMERA_CENTRE if robot_points_camera_m is None else robot_points_camera_m
        self._robot_points = finite_array("robot_points_camera_m", points, ("M", 3))
        if not len(self._robot_points):
            raise PerceptionError("robot_points_camera_m must hold at least one point, got none")
        self._std_px = finite_number(
            "keypoint_std_px", keypoint_std_px, minimum=0.0, exclusive_minimum=True
        )
        self._min_score = finite_number("min_score", min_score, minimum=0.0, maximum=1.0)

    def process(self, image_rgb: ImageRgb, stamp_s: float) -> tuple[PersonObservation, ...]:
        """Return one observation a detected person.

        A person whose keypoints cannot place the body is placed by the box, with a covariance to
        match; a person without a usable head has awareness None.

        Args:
            image_rgb: (H, W, 3) uint8 of the camera's size.
            stamp_s: time of the frame.

        Raises:
            PerceptionError: for an image of another size or type, a non-finite stamp, or an
                estimator that returns a different number of people than it was given.
        """
        stamp_s = finite_number("stamp_s", stamp_s)
        self._check_image(image_rgb)
        detections = tuple(self._detector.detect(image_rgb))
        if not detections:
            return ()
        people = tuple(self._pose_estimator.estimate(image_rgb, detections))
        _same_count("pose_estimator", len(people), len(detections))
        heads = tuple(self._head_pose_estimator.estimate(image_rgb, self.camera, people))
        _same_count("head_pose_estimator", len(heads), len(people))
        observations = (
            self._observe(detection, person, head, stamp_s)
            for detection, person, head in zip(detections, people, heads, strict=True)
        )
        return tuple(seen for seen in observations if seen is not None)

    def _observe(
        self,
        detection: PersonDetection,
        person: PersonKeypoints,
        head: HeadPose | None,
        stamp_s: float,
    ) -> PersonObservation | None:
        position, covariance = self._place(detection, person)
        if position is None or covariance is None:
            return None
        alpha, std = None, None
        if head is not None:
            alpha, std = awareness_of(self.cone, head, self._robot_points)
        return PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=position,
            position_covariance_m2=covariance,
            gaze_camera=None if head is None else head.gaze_camera,
            awareness=alpha,
            awareness_std=std,
            score=detection.score,
            box_xyxy_px=detection.box_xyxy_px,
        )

    def _place(
        self, detection: PersonDetection, person: PersonKeypoints
    ) -> tuple[FloatArray | None, FloatArray | None]:
        body = place_body(self.camera, person, self._std_px, self._min_score)
        boxed = place_box(self.camera, detection.box_xyxy_px)
        if body is not None:
            placed = body.position_camera_m, body.position_covariance_m2
            # An arm at the image border says less about the range than the height of its box.
            if boxed is None or np.trace(placed[1]) <= np.trace(boxed[1]):
                return placed
        return (None, None) if boxed is None else boxed

    def _check_image(self, image_rgb: Any) -> None:
        wanted = (self.camera.height_px, self.camera.width_px, 3)
        if not isinstance(image_rgb, np.ndarray):
            raise PerceptionError(
                f"image_rgb must be a uint8 array of shape {wanted}, got {type(image_rgb).__name__}"
            )
        if image_rgb.dtype != np.uint8 or image_rgb.shape != wanted:
            raise PerceptionError(
                f"image_rgb must be uint8 RGB of the camera's shape {wanted}, got "
                f"{image_rgb.dtype} of shape {image_rgb.shape}"
            )


def _same_count(name: str, got: int, wanted: int) -> None:
    if got != wanted:
        raise PerceptionError(f"{name} must return one result a person ({wanted}), got {got}")
