"""The awareness pipeline: from an RGB image to one observation per person."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from ._camera import Camera
from ._floor import FloorPlane
from ._observation import PersonObservation
from ._people_finder import PeopleFinder
from ._placement import PersonPlace, place_people
from ._pnp import PnpHeadPoseEstimator
from ._stages import (
    HeadPose,
    HeadPoseEstimator,
    PersonDetector,
    PersonKeypoints,
    PoseEstimator,
    check_count,
)
from .anthropometry import UNUSUAL_SIZE_PROBABILITY
from .arrays import (
    FloatArray,
    ImageRgb,
    check_image,
    finite_array,
    finite_number,
    rotation_matrix,
    unit_vector,
)
from .awareness import AttentionCone, AwarenessEstimate, estimate_awareness
from .body import DEFAULT_MIN_SCORE
from .confirmation import KeypointConfirmation
from .depth_image import checked_depth
from .errors import PerceptionError
from .evidence import AwarenessReason, FaceEvidence, judge_face
from .eyes import EyeEstimator, EyeGaze, known_eyes
from .named import Networks, default_networks
from .networks import OnnxSettings
from .ownership import DISOWNED, FoundPerson, own_heads
from .turn import QuarterTurn

_CAMERA_CENTRE: Final = np.zeros((1, 3))
#: Standard deviations of the eyes in the head, sideways and up and down. Sideways as recorded of
#: four pedestrians before a driverless shuttle in virtual reality. Real people differ widely in how
#: far they turn their eyes before they turn their head (Thumser and Stahl 2009,
#: doi:10.1007/s00221-009-1803-8); replace them if you know better values.
DEFAULT_EYE_IN_HEAD_STD_RAD: Final = (math.radians(11.3), math.radians(3.4))


class _Look(NamedTuple):
    """The evidence that the face of one person gives.

    Attributes:
        estimate: their awareness; None without evidence.
        gaze_camera: (3,) unit vector; None where the head's direction says nothing.
        missing: why there is no evidence; None with an estimate.
        eyes_seen: True if the eyes were measured.
    """

    estimate: AwarenessEstimate | None = None
    gaze_camera: FloatArray | None = None
    missing: AwarenessReason | None = None
    eyes_seen: bool = False


class AwarenessPipeline:
    """Detection, keypoints, head pose and awareness of every person in a frame.

    Examples:
        >>> import numpy as np
        >>> from perception import AwarenessPipeline, Camera
        >>> camera = Camera.from_fov(640, 480, np.radians(90.0))
        >>> pipeline = AwarenessPipeline(camera, simulator_networks=True)  # False for your camera
        >>> image_rgb = np.full((480, 640, 3), 120, np.uint8)  # here its image
        >>> pipeline.process(image_rgb, stamp_s=0.0)  # one observation for each person
        ()

    Args:
        camera: the robot's camera.
        detector: finds people, or makes what finds them for a camera. Default, with the pose
            estimator: the networks that ``awarenav models fetch real`` has downloaded.
        pose_estimator: finds their keypoints; given with the detector, or neither.
        head_pose_estimator: finds their head poses; default that of the default networks, else
            :class:`PnpHeadPoseEstimator`.
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
        simulator_networks: the default networks are those that come with the package, which have
            seen renders only. They are refused without it.
        onnx_settings: providers and threads of the default networks.
        detect_every_s: longest time between two looks of the detector, in [0, 0.2]; 0 is every
            image. In between, boxes follow the keypoints, which like the heads come from every
            image. The detector also looks where something has changed outside the boxes, where
            people overlap, and at once where the pose network finds a person no more. Images must
            then follow each other; a jump in time needs the detector. Each camera needs a
            pipeline of its own (:meth:`for_another_view`): one for two may find nobody.
        eye_estimator: measures the eyes of near people, for instance
            :class:`~perception.networks.faces.FaceMeshEyeEstimator`; default that of the default
            networks, else none: then the gaze is the head's direction.
        unusual_size_probability: probability in [0, 0.9] that a person has not the size of an adult
            who stands: a child, somebody bent or seated. 0 where only adults walk and stand: then
            5 % of range are left of unknown stature, which count as noise of each image.
        confirmation: lets the scores of the keypoints confirm or refute detections; the detector
            must then report its candidates. Default that of the default networks, else none.

    Raises:
        PerceptionError: for an invalid value, a network that cannot be loaded, and without networks
            where none but the shipped ones are there and ``simulator_networks`` is False.
    """

    def __init__(
        self,
        camera: Camera,
        detector: PersonDetector | Callable[[Camera], PersonDetector] | None = None,
        pose_estimator: PoseEstimator | None = None,
        head_pose_estimator: HeadPoseEstimator | None = None,
        cone: AttentionCone | None = None,
        robot_points_camera_m: Any | None = None,
        *,
        keypoint_std_px: float = 1.0,
        min_score: float = DEFAULT_MIN_SCORE,
        floor: FloorPlane | None = None,
        eye_in_head_std_rad: Any = DEFAULT_EYE_IN_HEAD_STD_RAD,
        simulator_networks: bool = False,
        onnx_settings: OnnxSettings | None = None,
        detect_every_s: float = 0.0,
        unusual_size_probability: float = UNUSUAL_SIZE_PROBABILITY,
        eye_estimator: EyeEstimator | None = None,
        confirmation: KeypointConfirmation | None = None,
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
        self._unusual_size = finite_number(
            "unusual_size_probability", unusual_size_probability, minimum=0.0, maximum=0.9
        )
        self._floor = _checked_floor(floor)
        self._eye_std_rad = _checked_eye_std(eye_in_head_std_rad)
        if detector is None and pose_estimator is None:
            networks = default_networks(
                simulator_networks=simulator_networks, settings=onnx_settings
            )
            detector, pose_estimator = networks.make_detector, networks.pose_estimator
            head_pose_estimator = head_pose_estimator or networks.head_pose_estimator
            confirmation = confirmation or networks.settings.get("confirmation")
            eye_estimator = eye_estimator or networks.settings.get("eye_estimator")
        elif detector is None or pose_estimator is None:
            missing = "detector" if detector is None else "pose_estimator"
            raise PerceptionError(
                f"detector and pose_estimator must be given both, or neither: {missing} is missing"
            )
        self._make_detector = None if isinstance(detector, PersonDetector) else detector
        if head_pose_estimator is None:
            head_pose_estimator = PnpHeadPoseEstimator(self._std_px, self._min_score)
        self._people = PeopleFinder(
            camera,
            detector if isinstance(detector, PersonDetector) else detector(camera),
            pose_estimator,
            self._min_score,
            confirmation,
            detect_every_s,
        )
        self._head_pose_estimator: HeadPoseEstimator = head_pose_estimator
        if eye_estimator is not None and not isinstance(eye_estimator, EyeEstimator):
            raise PerceptionError(
                "eye_estimator must have the method estimate(image_rgb, camera, heads, people), "
                f"got {type(eye_estimator).__name__}"
            )
        self._eye_estimator = eye_estimator
        self._turned: dict[QuarterTurn, AwarenessPipeline] = {}

    @classmethod
    def of(cls, networks: Networks, camera: Camera) -> AwarenessPipeline:
        """Return a pipeline with networks that :mod:`perception.named` has loaded."""
        return cls(
            camera,
            networks.make_detector,
            networks.pose_estimator,
            networks.head_pose_estimator,
            **networks.settings,
        )

    def for_another_view(self, rotation_camera_view: Any | None = None) -> AwarenessPipeline:
        """Return a pipeline with the same camera, networks and settings that has seen no image.

        With ``detect_every_s``, a pipeline keeps people from one image to the
        next. Each of several cameras, or views of one, therefore needs its own; this one shares
        the networks.

        Args:
            rotation_camera_view: (3, 3) from the frame of the view to the camera's, in which the
                points of the robot and the constant floor are given; None for the same frame.
        """
        R = np.eye(3)
        if rotation_camera_view is not None:
            R = rotation_matrix("rotation_camera_view", rotation_camera_view)
        return self._for_view(self.camera, R)

    def _for_view(self, camera: Camera, R: FloatArray) -> AwarenessPipeline:
        other = copy.copy(self)
        detector = None
        if camera is not self.camera and self._make_detector is not None:
            detector = self._make_detector(camera)
        other.camera, other._people = camera, self._people.for_another_view(camera, detector)
        other._robot_points = self._robot_points @ R
        other._floor = None if self._floor is None else self._floor.in_view(R)
        other._turned = {}
        return other

    def _turned_by(self, turn: QuarterTurn) -> AwarenessPipeline:
        """Return the pipeline of the turned picture."""
        if not turn.quarters:
            return self
        if turn not in self._turned:
            camera = turn.camera(self.camera)
            self._turned[turn] = self._for_view(camera, turn.rotation_camera_view)
        return self._turned[turn]

    def process(
        self,
        image_rgb: ImageRgb,
        stamp_s: float,
        floor: FloorPlane | None = None,
        *,
        depth_m: Any | None = None,
        depth_stamp_s: float | None = None,
        up_camera: Any | None = None,
    ) -> tuple[PersonObservation, ...]:
        """Return one observation per detected person.

        The picture of a camera that is rolled is turned to the nearest quarter turn, since networks
        know upright people. Observations are of the camera as it is.

        If the keypoints do not determine the position, it comes from the box, with a larger
        covariance. A person without a usable head pose has awareness None. Somebody who turns the
        back of a blurred head has an awareness of 0 and no gaze. Black, one-coloured and repeated
        pictures are no views: leave them out (:func:`~perception.no_view.why_no_view`).

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
            up_camera: (3,) direction up in the camera frame; default that of the floor. Where
                neither is known, the picture counts as upright.

        Raises:
            DepthImageError: for a depth image of another size, type, unit or time; no network has
                run then.
            PerceptionError: for an image of another size or type, a non-finite stamp, and an
                estimator that does not return one result per person.
        """
        stamp_s = finite_number("stamp_s", stamp_s)
        floor = self._floor if floor is None else _checked_floor(floor)
        check_image(image_rgb, self.camera.height_px, self.camera.width_px)
        if depth_m is not None:
            shape = self.camera.height_px, self.camera.width_px
            depth_m = checked_depth(depth_m, shape, stamp_s, depth_stamp_s)
        elif depth_stamp_s is not None:
            raise PerceptionError("depth_stamp_s needs depth_m, got None")
        if up_camera is not None:
            up_camera = unit_vector("up_camera", up_camera)
        elif floor is not None:
            up_camera = floor.normal_camera
        turn = QuarterTurn.upright(up_camera)
        observations = self._turned_by(turn)._seen_upright(
            turn.picture(image_rgb),
            stamp_s,
            None if floor is None else floor.in_view(turn.rotation_camera_view),
            None if depth_m is None else turn.picture(depth_m),
        )
        return tuple(turn.in_camera(each, self.camera) for each in observations)

    def _seen_upright(
        self,
        image_rgb: ImageRgb,
        stamp_s: float,
        floor: FloorPlane | None,
        depth_m: FloatArray | None,
    ) -> tuple[PersonObservation, ...]:
        """Return the people of a picture that is about upright."""
        found = self._people.find(image_rgb, stamp_s)
        observations: tuple[PersonObservation, ...] = ()
        if found:
            people = tuple(one.keypoints for one in found)
            heads = tuple(self._head_pose_estimator.estimate(image_rgb, self.camera, people))
            check_count("head_pose_estimator", len(heads), len(people))
            found, heads = own_heads(self.camera, found, heads, self._min_score)
            people = tuple(one.keypoints for one in found)
            eyes = self._eyes(image_rgb, heads, people)
            places = place_people(
                self.camera,
                tuple(one.detection for one in found),
                people,
                heads,
                floor,
                self._std_px,
                self._min_score,
                depth_m,
                self._unusual_size,
            )
            looks = self._looks(found, heads, eyes)
            observations = tuple(
                self._observation(stamp_s, one, place, look)
                for one, place, look in zip(found, places, looks, strict=True)
                if place is not None
            )
        return observations

    def _observation(
        self, stamp_s: float, one: FoundPerson, place: PersonPlace, look: _Look
    ) -> PersonObservation:
        detection, estimate = one.detection, look.estimate
        return PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=place.position_camera_m,
            position_covariance_m2=place.covariance_m2,
            gaze_camera=look.gaze_camera,
            awareness=None if estimate is None else estimate.awareness,
            awareness_std=None if estimate is None else estimate.awareness_std,
            score=detection.score,
            box_xyxy_px=detection.box_xyxy_px,
            awareness_reason=look.missing,
            **self._sizes(place),
            eyes_seen=look.eyes_seen,
            keypoints=one.keypoints if one.disowned in (None, DISOWNED[-1]) else None,
        )

    def _sizes(self, place: PersonPlace) -> dict[str, Any]:
        """Return what an observation says of the person's unknown size: nothing of adults."""
        if self._unusual_size == 0.0:
            return {}
        return {
            "range_lasting_relative_std": place.lasting_relative_std,
            "size_range_m": place.size_range_m,
            "size_range_relative_std": place.size_range_relative_std,
        }

    def _eyes(
        self,
        image_rgb: ImageRgb,
        heads: tuple[HeadPose | None, ...],
        people: tuple[PersonKeypoints, ...],
    ) -> tuple[EyeGaze | None, ...]:
        """Return the eyes in each head, combined with how eyes turn; None where not known."""
        if self._eye_estimator is None:
            return (None,) * len(heads)
        measured = tuple(self._eye_estimator.estimate(image_rgb, self.camera, heads, people))
        check_count("eye_estimator", len(measured), len(heads))
        return known_eyes(measured, self._eye_std_rad)

    def _looks(
        self,
        found: Sequence[FoundPerson],
        heads: Sequence[HeadPose | None],
        eyes: Sequence[EyeGaze | None],
    ) -> list[_Look]:
        """Return awareness and gaze of each person, or why there is no evidence.

        There is none of somebody whose keypoints or head are not their own.
        """
        looks = [_Look(missing=one.disowned or self._without_head(one)) for one in found]
        faces = []
        for row, (one, head) in enumerate(zip(found, heads, strict=True)):
            if one.disowned is not None or head is None:
                continue
            evidence = judge_face(self.camera, one.keypoints, head, self._min_score, self._std_px)
            if isinstance(evidence, FaceEvidence):
                faces.append((row, head, evidence))
            else:
                looks[row] = _Look(missing=evidence)
        estimates = estimate_awareness(
            self.cone,
            [head for _, head, _ in faces],
            self._robot_points,
            extra_std_rad=np.array([evidence.extra_std_rad for *_, evidence in faces]),
            eye_in_head_std_rad=self._eye_std_rad,
            face_seen=np.array([evidence.seen for *_, evidence in faces]),
            eyes=[eyes[row] for row, *_ in faces],
        )
        for (row, head, evidence), estimate in zip(faces, estimates, strict=True):
            gaze = _gaze(head, eyes[row]) if evidence.direction_known else None
            looks[row] = _Look(estimate, gaze, eyes_seen=eyes[row] is not None)
        return looks

    def _without_head(self, one: FoundPerson) -> AwarenessReason:
        seen = (one.keypoints.scores >= self._min_score).any()
        return "no head pose" if seen else "no skeleton"


def _gaze(head: HeadPose, eyes: EyeGaze | None) -> FloatArray:
    """Return the unit vector (3,) of the gaze: of the eyes if they are known, else of the head."""
    if eyes is None:
        return head.gaze_camera
    return np.asarray(head.rotation_camera_head @ eyes.rotation_head_eyes[:, 1])


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
