"""The awareness pipeline: from an RGB image to one observation per person."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Final

import numpy as np

from . import layouts as kp
from ._attention import AttentionCone
from ._camera import Camera
from ._depth_image import checked_depth
from ._floor import FloorPlane
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from ._metric_scale import DEFAULT_MIN_SCORE
from ._observation import AwarenessReason, PersonObservation
from ._placement import place_people
from ._pnp import PnpHeadPoseEstimator
from ._protocols import HeadPoseEstimator, PersonDetector, PoseEstimator
from .arrays import FloatArray, ImageRgb, finite_array, finite_number
from .awareness import AwarenessEstimate, estimate_awareness
from .body import BodyPlacement, place_bodies
from .errors import PerceptionError
from .evidence import FaceEvidence, judge_face
from .networks import NETWORK_TIME, OnnxSettings
from .ownership import disowned_keypoints, without_disowned
from .shipped import (
    shipped_detector,
    shipped_head_pose_estimator,
    shipped_pose_estimator,
)

_CAMERA_CENTRE: Final = np.zeros((1, 3))
# Hip of each leg, and the keypoints that tell where its shank is: the knee if the image ends above
# the foot.
_LEG_ROWS: Final = (
    (kp.LEFT_HIP, kp.LEFT_ANKLE, kp.LEFT_KNEE),
    (kp.RIGHT_HIP, kp.RIGHT_ANKLE, kp.RIGHT_KNEE),
)
#: Standard deviations of the eyes in the head, sideways and up and down. Sideways as recorded of
#: four pedestrians before a driverless shuttle in virtual reality. Real people differ widely in how
#: far they turn their eyes before they turn their head (Thumser and Stahl 2009,
#: doi:10.1007/s00221-009-1803-8); replace them if you know better values.
DEFAULT_EYE_IN_HEAD_STD_RAD: Final = (math.radians(11.3), math.radians(3.4))


@dataclass(frozen=True, slots=True)
class StageTimings:
    """Wall-clock times of the stages of one frame.

    Attributes:
        detector_s: time of the detector, including the preparation of its input and the reading of
            its output.
        pose_s: the same for the pose estimator.
        head_pose_s: the same for the head pose estimator.
        rest_s: time of everything else: checks, positions, face evidence, awareness.
        networks_s: the part of all this in runs of ONNX networks. Networks that do not run in ONNX
            Runtime are not included.
    """

    detector_s: float = 0.0
    pose_s: float = 0.0
    head_pose_s: float = 0.0
    rest_s: float = 0.0
    networks_s: float = 0.0

    @property
    def total_s(self) -> float:
        """Time of the whole frame."""
        return self.detector_s + self.pose_s + self.head_pose_s + self.rest_s

    @property
    def outside_s(self) -> float:
        """Time of the whole frame without the runs of ONNX networks."""
        return self.total_s - self.networks_s


class AwarenessPipeline:
    """Detection, keypoints, head pose and awareness of every person in a frame.

    Args:
        camera: the robot's camera.
        detector: finds people; default the shipped network.
        pose_estimator: finds their keypoints; default the shipped network.
        head_pose_estimator: finds their head poses; default the shipped network if the pose
            estimator is the shipped one too, else :class:`PnpHeadPoseEstimator`. The shipped
            networks are made for the simulator and are only used on real images on request.
        cone: the attention cone; default half-angle 60°.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame. A person who sees
            any of them sees the robot. Default the camera's centre, as in the paper.
        keypoint_std_px: standard deviation of the keypoint noise, for the body's position.
        min_score: keypoints with a lower score count as not seen.
        floor: the floor in the camera frame, if it is known and constant; the feet then improve
            the range of people.
        eye_in_head_std_rad: standard deviations of the eyes relative to the head's direction,
            sideways and up and down, or one number for both. They are part of α's standard
            deviation.
        onnx_settings: providers and threads of the shipped networks.

    Raises:
        PerceptionError: for an invalid value, or a shipped network that cannot be loaded.
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
        floor: FloorPlane | None = None,
        eye_in_head_std_rad: Any = DEFAULT_EYE_IN_HEAD_STD_RAD,
        onnx_settings: OnnxSettings | None = None,
    ) -> None:
        if not isinstance(camera, Camera):
            raise PerceptionError(f"camera must be a Camera, got {type(camera).__name__}")
        self.camera = camera
        self.cone = AttentionCone() if cone is None else cone
        points = _CAMERA_CENTRE if robot_points_camera_m is None else robot_points_camera_m
        self._robot_points = finite_array("robot_points_camera_m", points, ("M", 3))
        if not len(self._robot_points):
            raise PerceptionError("robot_points_camera_m must hold at least one point, got none")
        self._std_px = finite_number(
            "keypoint_std_px", keypoint_std_px, minimum=0.0, exclusive_minimum=True
        )
        self._min_score = finite_number("min_score", min_score, minimum=0.0, maximum=1.0)
        self._floor = _checked_floor(floor)
        self._eye_std_rad = _checked_eye_std(eye_in_head_std_rad)
        shipped_pose = pose_estimator is None
        if detector is None or pose_estimator is None:
            if detector is None:
                detector = shipped_detector(onnx_settings, camera)
            if pose_estimator is None:
                pose_estimator = shipped_pose_estimator(onnx_settings)
        if head_pose_estimator is None:
            head_pose_estimator = PnpHeadPoseEstimator(self._std_px, self._min_score)
            if shipped_pose:
                head_pose_estimator = shipped_head_pose_estimator(onnx_settings)
        self._detector: PersonDetector = detector
        self._pose_estimator: PoseEstimator = pose_estimator
        self._head_pose_estimator: HeadPoseEstimator = head_pose_estimator
        self._timings = StageTimings()

    @property
    def last_timings(self) -> StageTimings:
        """Times of the stages of the last processed frame; zeros before the first."""
        return self._timings

    def process(
        self,
        image_rgb: ImageRgb,
        stamp_s: float,
        floor: FloorPlane | None = None,
        *,
        depth_m: Any | None = None,
        depth_stamp_s: float | None = None,
    ) -> tuple[PersonObservation, ...]:
        """Return one observation per detected person.

        If the keypoints do not determine the position, it comes from the box, with a larger
        covariance. A person without a usable head pose has awareness None.

        Args:
            image_rgb: (H, W, 3) uint8 of the camera's size.
            stamp_s: time of the frame.
            floor: the floor in the camera frame of this image, for a camera that moves relative to
                the floor; default the constructor's.
            depth_m: (H, W) depth along the optical axis, aligned with the image to a few pixels: of
                an RGB-D or stereo camera. Floating-point metres, or uint16 millimetres; 0, NaN and
                infinity are holes. It improves the range of people, of children and seated people
                above all.
            depth_stamp_s: time of the depth image, within 0.05 s; default that of the image.

        Raises:
            PerceptionError: for an image of another size or type, a non-finite stamp, a depth image
                of another size, type, unit or time, and an estimator that does not return one
                result per person.
        """
        began, run_before_s = perf_counter(), NETWORK_TIME.elapsed_s
        stamp_s = finite_number("stamp_s", stamp_s)
        floor = self._floor if floor is None else _checked_floor(floor)
        self._check_image(image_rgb)
        if depth_m is not None:
            shape = self.camera.height_px, self.camera.width_px
            depth_m = checked_depth(depth_m, shape, stamp_s, depth_stamp_s)
        elif depth_stamp_s is not None:
            raise PerceptionError("depth_stamp_s needs depth_m, got None")
        ready = perf_counter()
        detections = tuple(self._detector.detect(image_rgb))
        detected = perf_counter()
        if not detections:
            self._timings = StageTimings(
                detected - ready,
                rest_s=ready - began,
                networks_s=NETWORK_TIME.elapsed_s - run_before_s,
            )
            return ()
        people = tuple(self._pose_estimator.estimate(image_rgb, detections))
        _check_count("pose_estimator", len(people), len(detections))
        disowned = disowned_keypoints(self.camera, detections, people, self._min_score)
        people = tuple(map(without_disowned, people, disowned))
        posed = perf_counter()
        heads = tuple(self._head_pose_estimator.estimate(image_rgb, self.camera, people))
        _check_count("head_pose_estimator", len(heads), len(people))
        headed = perf_counter()
        places = place_people(
            self.camera, detections, people, heads, floor, self._std_px, self._min_score, depth_m
        )
        # The same call as for the places, which is remembered.
        bodies = place_bodies(self.camera, people, self._std_px, self._min_score)
        estimates, reasons = self._awareness(people, heads, disowned)
        observations = tuple(
            PersonObservation(
                stamp_s=stamp_s,
                position_camera_m=place[0],
                position_covariance_m2=place[1],
                gaze_camera=None if head is None or estimate is None else head.gaze_camera,
                awareness=None if estimate is None else estimate.awareness,
                awareness_std=None if estimate is None else estimate.awareness_std,
                score=detection.score,
                box_xyxy_px=detection.box_xyxy_px,
                legs_camera_m=_legs(person, body, place[0], self._min_score),
                awareness_reason=reason,
            )
            for detection, place, head, estimate, reason, person, body in zip(
                detections, places, heads, estimates, reasons, people, bodies, strict=True
            )
            if place is not None
        )
        rest = ready - began + perf_counter() - headed
        self._timings = StageTimings(
            detected - ready,
            posed - detected,
            headed - posed,
            rest,
            NETWORK_TIME.elapsed_s - run_before_s,
        )
        return observations

    def _awareness(
        self,
        people: tuple[PersonKeypoints, ...],
        heads: tuple[HeadPose | None, ...],
        reasons: Sequence[AwarenessReason | None],
    ) -> tuple[list[AwarenessEstimate | None], list[AwarenessReason | None]]:
        """Return the awareness of each person, or None and why there is no evidence.

        There is none of somebody whose keypoints or head are not their own, for a reason.
        """
        estimates: list[AwarenessEstimate | None] = [None] * len(people)
        missing = list(reasons)
        faces = []
        for row, (person, head) in enumerate(zip(people, heads, strict=True)):
            if missing[row] is not None:
                continue
            if head is None:
                missing[row] = "no head pose"
                continue
            evidence = judge_face(self.camera, person, head, self._min_score, self._std_px)
            if isinstance(evidence, FaceEvidence):
                faces.append((row, head, evidence))
            else:
                missing[row] = evidence
        face_estimates = estimate_awareness(
            self.cone,
            [head for _, head, _ in faces],
            self._robot_points,
            extra_std_rad=np.array([evidence.extra_std_rad for *_, evidence in faces]),
            eye_in_head_std_rad=self._eye_std_rad,
            face_seen=np.array([evidence.seen for *_, evidence in faces]),
        )
        for (row, *_), estimate in zip(faces, face_estimates, strict=True):
            estimates[row] = estimate
        return estimates, missing

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


def _check_count(name: str, got: int, wanted: int) -> None:
    if got != wanted:
        raise PerceptionError(f"{name} must return one result per person ({wanted}), got {got}")


def _legs(
    person: PersonKeypoints, body: BodyPlacement | None, position_m: FloatArray, min_score: float
) -> FloatArray | None:
    """Return the middle (3,) of the shanks, from the body moved along its ray to its place.

    Each leg that is seen counts as far from the middle of the hips as its ankle, or its knee, is
    from its own hip.
    """
    if body is None or not person.lifted:
        return None
    points = body.keypoints_camera_m
    reaches = []
    for hip, *rows in _LEG_ROWS:
        seen = [row for row in rows if person.scores[row] >= min_score]
        if seen:
            reaches.append(points[seen[0]] - points[hip])
    if not reaches:
        return None
    legs = body.hips_camera_m + np.mean(reaches, axis=0)
    scale = float(np.linalg.norm(position_m) / np.linalg.norm(body.position_camera_m))
    return np.asarray(scale * legs)


def _checked_floor(floor: Any) -> FloorPlane | None:
    if floor is not None and not isinstance(floor, FloorPlane):
        raise PerceptionError(f"floor must be a FloorPlane or None, got {type(floor).__name__}")
    return floor


def _checked_eye_std(value: Any) -> tuple[float, float]:
    pair = np.broadcast_to(value, 2) if np.ndim(value) == 0 else value
    sideways, upwards = finite_array("eye_in_head_std_rad", pair, (2,)).tolist()
    for std in (sideways, upwards):
        finite_number("eye_in_head_std_rad", std, minimum=0.0, maximum=math.pi / 2.0)
    return sideways, upwards
