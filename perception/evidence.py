"""Evidence of a face: the probability that it is seen, and the accuracy that its size allows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from . import layouts as kp
from ._camera import Camera
from ._stages import HeadPose, PersonKeypoints
from .anthropometry import HEAD_TEMPLATE_M, HEAD_WIDTH_M

#: Why there is no evidence of awareness.
AwarenessReason = Literal[
    "skeleton of another person",
    "keypoints outside the box",
    "no body has such limbs",
    "head of another person",
    "no skeleton",
    "no head pose",
    "face too small",
    "no face found",
    "face missed",
    "face cut by the border",
    "no keypoint of the head",
    "eyes covered by lids",
    "head direction unknown",
]
AWARENESS_REASONS: Final[tuple[AwarenessReason, ...]] = get_args(AwarenessReason)

# A face with a width of less than 5 pixels carries no direction. At 12 pixels the gaze is uncertain
# by 20°, whatever the estimator says: no estimator is trained or tested on such small faces.
_MIN_FACE_PX: Final = 5.0
_WEAK_FACE_PX: Final = 12.0
_WEAK_FACE_STD_RAD: Final = math.radians(20.0)
_SIZE_POWER: Final = 4.0
# Beyond this standard deviation a network's direction of a head is no evidence: of its largest
# errors, some of half a turn, a network knows too little.
_MAX_DIRECTION_STD_RAD: Final = math.radians(15.0)
# Up to this probability of a face, somebody does not see the robot whatever their head's direction.
_NO_FACE_SEEN: Final = 0.2
# Errors of keypoints that agree with a pose: up to so many standard deviations of the noise, with a
# share of the face's width for the head's own shape; in small faces up to a share alone. Beyond it,
# the same again is the standard deviation of a Gaussian that lowers the probability.
_CONSISTENT_STD: Final = 3.5
_CONSISTENT_SHARE: Final = 0.05
_SMALL_FACE_SHARE: Final = 0.15
_ERROR_SCALE: Final = 0.5
# No head is wider than this share of the extent of its own body, even if no more than the shoulders
# is seen of it: those of photographs have up to 0.21.
_LARGEST_SHARE: Final = 0.7
# Probability of a face without evidence for or against it.
_UNKNOWN: Final = 0.5
# The same if a network that looks for faces found none: on labelled photographs it misses a quarter
# of the faces that show nose and eyes, and finds none on the backs of heads (0.25 : 1). Of faces
# with fewer pixels of width it misses more, so that nothing follows.
_NO_FACE_FOUND: Final = 0.2
_FACE_TO_FIND_PX: Final = 20.0
# Of a head that is turned less than this away from the camera, it should have found one.
_FACE_TO_FIND_RAD: Final = math.radians(50.0)
_MIN_SCORE_SCALE: Final = 0.05
# Generous bound on the shift of a point near the image's border by lens distortion.
_MAX_DISTORTION_PX: Final = 200.0


@dataclass(frozen=True, slots=True)
class FaceEvidence:
    """Evidence of one person's face in the image.

    Attributes:
        seen: probability that the camera sees the face.
        width_px: width of the face, ear to ear.
        extra_std_rad: standard deviation that the small size of the face adds to each of the two
            angles of the gaze.
        direction_known: False if the head's direction says nothing; then no face is seen.
    """

    seen: float
    width_px: float
    extra_std_rad: float
    direction_known: bool = True


def judge_face(
    camera: Camera,
    person: PersonKeypoints,
    head: HeadPose,
    min_score: float,
    keypoint_std_px: float = 1.0,
) -> FaceEvidence | AwarenessReason:
    """Return the evidence of a face for a head pose, or why there is too little of it.

    Three things count:

    * Two of nose and eyes are seen, according to ``head.face_seen``, or else to the scores of the
      keypoints (probability 0 at half of ``min_score``, 1 at one and a half). If these scores are
      no evidence of a face (``face_evidence`` False), the probability is 0.2. There is no evidence
      then for a head that faces the camera by its keypoints, and below 20 pixels of width. Of a
      skeleton without depth, one of nose and eyes alone counts half: sunglasses, a hand or a cup
      may cover the others of a face that looks here. A nose or an eye outside the image counts as
      seen with a probability of at least 0.5: it is cut off, not turned away. If two of them are
      outside, a lower ``head.face_seen`` also counts as 0.5.
    * Nose, eyes and ears lie where a head in this pose has them. A root mean square error of more
      than 3.5 standard deviations of the noise together with 5 % of the face's width (the head's
      own shape), or of more than 15 % of the width, lowers the probability.
    * The face is large enough. Below 12 pixels of width the gaze is very uncertain; below 5 pixels
      there is no evidence.

    There is also no evidence if no keypoint of the head is seen and ``head.face_seen`` is None, if
    lids cover the irises (``person.eyes_open`` False), if the head is larger than the body can
    carry, or if nose or eyes are missing from a head at the border of the image: what the border
    cuts off is missing from the pose too, and so the pose may be far off.

    The direction is unknown if a network that gives ``head.face_seen`` is unsure of it by more than
    15°: of a head that is blurred, dark or small. Then there is no evidence, unless a face is seen
    with a probability of at most 0.2. Somebody without a face sees nothing, wherever they look.

    Args:
        camera: camera that saw the person.
        person: keypoints from which the pose was computed, or with which the head was found.
        head: the pose.
        min_score: keypoints with a lower score count as not seen.
        keypoint_std_px: standard deviation of the keypoint noise.
    """
    depth = max(float(head.position_camera_m[2]), 0.05)
    width_px = HEAD_WIDTH_M * math.sqrt(camera.fx_px * camera.fy_px) / depth
    if reason := _unseen(person, head, width_px):
        return reason
    if head.face_seen is None and _is_cut(camera, person, width_px, min_score):
        return "face cut by the border"
    if _is_too_large(person, width_px, min_score):
        return "no body has such limbs"
    outside = _outside_image(camera, head, width_px)
    if head.face_seen is not None:
        seen = max(head.face_seen, _UNKNOWN) if sum(outside) > 1 else head.face_seen
    elif not (person.scores[kp.HEAD] >= min_score).any():
        return "no keypoint of the head"
    elif person.face_evidence:
        scale = max(min_score, _MIN_SCORE_SCALE)
        shown = np.clip((person.scores[:3] - 0.5 * scale) / scale, 0.0, 1.0)
        possible = np.where(outside, np.maximum(shown, _UNKNOWN), shown)
        second, first = np.sort(possible)[1:].tolist()
        seen = second if person.lifted else max(second, _UNKNOWN * first)
    else:
        seen = _NO_FACE_FOUND
    consistent_px = min(
        math.hypot(_CONSISTENT_STD * keypoint_std_px, _CONSISTENT_SHARE * width_px),
        _SMALL_FACE_SHARE * width_px,
    )
    excess = head.reprojection_error_px / consistent_px - 1.0
    if excess > 0.0:
        seen *= math.exp(-0.5 * (excess / _ERROR_SCALE) ** 2)
    known = head.face_seen is None or _direction_std_rad(head) <= _MAX_DIRECTION_STD_RAD
    if not known and seen > _NO_FACE_SEEN:
        return "head direction unknown"
    extra = _WEAK_FACE_STD_RAD * (_WEAK_FACE_PX / width_px) ** _SIZE_POWER
    return FaceEvidence(seen, width_px, extra, known)


def _unseen(person: PersonKeypoints, head: HeadPose, width_px: float) -> AwarenessReason | None:
    """Return why a face of this width (px) shows no eyes that could be judged; None if it may."""
    if width_px < _MIN_FACE_PX or head.position_camera_m[2] <= 0.0:
        return "face too small"
    if head.face_seen is None and not person.face_evidence:
        # The keypoints and the network of faces contradict each other.
        if head.off_camera_rad <= _FACE_TO_FIND_RAD:
            return "face missed"
        if width_px < _FACE_TO_FIND_PX:
            return "no face found"
    return None if person.eyes_open else "eyes covered by lids"


def _is_too_large(person: PersonKeypoints, width_px: float, min_score: float) -> bool:
    """Return whether a head of this width (px) is too large for the body that is seen of it."""
    seen = person.scores[kp.BODY] >= min_score
    if not seen[len(HEAD_TEMPLATE_M) :].any():
        return False
    extent_px = float(np.ptp(person.keypoints_px[kp.BODY][seen], axis=0).max())
    return width_px > _LARGEST_SHARE * extent_px


def _direction_std_rad(head: HeadPose) -> float:
    """Return the standard deviation of the head's direction where it is largest."""
    across = head.rotation_camera_head[:, ::2]
    largest = float(np.linalg.eigvalsh(across.T @ head.covariance[:3, :3] @ across)[-1])
    return math.sqrt(max(largest, 0.0))


def _is_cut(camera: Camera, person: PersonKeypoints, width_px: float, min_score: float) -> bool:
    """Return whether a head of this width (px) without nose or an eye touches the border."""
    shown = person.scores[kp.HEAD] >= min_score
    if not person.face_evidence or shown[:3].all() or not shown.any():
        return False
    pixels = person.keypoints_px[kp.HEAD][shown]
    far = np.array([camera.width_px, camera.height_px]) - pixels
    return bool(np.minimum(pixels, far).min() < width_px)


def _outside_image(camera: Camera, head: HeadPose, width_px: float) -> tuple[bool, bool, bool]:
    """Return True for each of nose, left eye and right eye that lies outside the image."""
    x, y, z = head.position_camera_m.tolist()
    u, v = camera.fx_px * x / z + camera.cx_px, camera.fy_px * y / z + camera.cy_px
    margin = width_px + _MAX_DISTORTION_PX * (camera.distortion is not None)
    within_u = margin < u < camera.width_px - margin
    if within_u and margin < v < camera.height_px - margin:
        return False, False, False
    points = head.position_camera_m + HEAD_TEMPLATE_M[:3] @ head.rotation_camera_head.T
    pixels = camera.project(points)
    inside = (pixels > -0.5) & (pixels < (camera.width_px - 0.5, camera.height_px - 0.5))
    return not inside[0].all(), not inside[1].all(), not inside[2].all()
