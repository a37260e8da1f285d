"""Whether a face is seen at all, and how much a head pose of that size can say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._camera import Camera
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from .anthropometry import HEAD_TEMPLATE_M

# Ear to ear.
_FACE_WIDTH_M: Final = 0.156
# A face of fewer pixels carries no direction; one of twelve is a weak measurement whatever its
# estimator says, since none is trained or tested on so few.
_SMALLEST_FACE_PX: Final = 5.0
_WEAK_FACE_PX: Final = 12.0
_WEAK_FACE_STD_RAD: Final = math.radians(20.0)
_SIZE_POWER: Final = 4.0
# Keypoints off the template by more than this part of the face's width speak against the pose.
_CONSISTENT_ERROR: Final = 0.15
_ERROR_SCALE: Final = 0.15
# Without any evidence either way a face is as likely seen as not.
_UNKNOWN: Final = 0.5
_LOWEST_SCORE: Final = 0.05
# How far a lens's distortion may move the picture's edge, generously.
_BENT_PX: Final = 200.0


@dataclass(frozen=True, slots=True)
class FaceEvidence:
    """What the image says about the face of one person.

    Attributes:
        seen: probability that the camera sees the face.
        width_px: ear to ear, at the head's distance.
        extra_std_rad: error of either angle of the gaze that a face so small adds.
    """

    seen: float
    width_px: float
    extra_std_rad: float


def judge_face(
    camera: Camera, person: PersonKeypoints, head: HeadPose, min_score: float
) -> FaceEvidence | None:
    """Judge the evidence for a head pose, or return None where there is too little of it.

    Three things count. That nose and eyes are seen: two of the three, by the head estimator's own
    word where it gives one, else by the scores of the keypoints (0 at half of ``min_score``, 1 at
    one and a half); a pose model whose scores say nothing about it (``face_evidence`` False) leaves
    it open. That nose, eyes and ears lie where such a head has them: a root mean square distance of
    more than 15 % of the face's width speaks against it. And that there are pixels enough: below
    twelve pixels of width the gaze is hardly known, below five not at all. A nose or an eye beyond
    the picture's edge is not hidden; whether it would be seen stays open. Where no keypoint of the
    head is seen and the estimator does not vouch for the face either, there is no evidence.

    Args:
        camera: that saw the person.
        person: the keypoints that the pose was made from or found with.
        head: the pose.
        min_score: keypoints scored below this count as not seen.
    """
    depth = max(float(head.position_camera_m[2]), 0.05)
    width_px = _FACE_WIDTH_M * math.sqrt(camera.fx_px * camera.fy_px) / depth
    if width_px < _SMALLEST_FACE_PX or head.position_camera_m[2] <= 0.0:
        return None
    beyond = _beyond_the_edge(camera, head, width_px)
    if head.face_seen is not None:
        seen = max(head.face_seen, _UNKNOWN) if sum(beyond) > 1 else head.face_seen
    elif not (person.scores[:5] >= min_score).any():
        return None
    elif person.face_evidence:
        scale = max(min_score, _LOWEST_SCORE)
        shown = np.clip((person.scores[:3] - 0.5 * scale) / scale, 0.0, 1.0)
        open_or_shown = np.where(beyond, np.maximum(shown, _UNKNOWN), shown)
        seen = float(np.sort(open_or_shown)[1])
    else:
        seen = _UNKNOWN
    excess = head.reprojection_error_px / width_px - _CONSISTENT_ERROR
    if excess > 0.0:
        seen *= math.exp(-0.5 * (excess / _ERROR_SCALE) ** 2)
    extra = _WEAK_FACE_STD_RAD * (_WEAK_FACE_PX / width_px) ** _SIZE_POWER
    return FaceEvidence(seen, width_px, extra)


def _beyond_the_edge(camera: Camera, head: HeadPose, width_px: float) -> tuple[bool, bool, bool]:
    """Whether nose, left and right eye of such a head lie outside the picture."""
    x, y, z = head.position_camera_m.tolist()
    u, v = camera.fx_px * x / z + camera.cx_px, camera.fy_px * y / z + camera.cy_px
    margin = width_px + _BENT_PX * (camera.distortion is not None)
    within_u = margin < u < camera.width_px - margin
    if within_u and margin < v < camera.height_px - margin:
        return False, False, False
    points = head.position_camera_m + HEAD_TEMPLATE_M[:3] @ head.rotation_camera_head.T
    pixels = camera.project(points)
    inside = (pixels > -0.5) & (pixels < (camera.width_px - 0.5, camera.height_px - 0.5))
    return not inside[0].all(), not inside[1].all(), not inside[2].all()
