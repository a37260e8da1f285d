"""Keypoint layouts: names and order of the keypoints in arrays.

The first 17 keypoints of COCO-WholeBody are those of COCO, so the indices below hold for both. The
neck is not a keypoint of either; it is the midpoint of the shoulders.
"""

from __future__ import annotations

from typing import Final

from .errors import PerceptionError

COCO_NAMES: Final[tuple[str, ...]] = (
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
)  # fmt: skip
FOOT_NAMES: Final[tuple[str, ...]] = (
    "left_big_toe",
    "left_small_toe",
    "left_heel",
    "right_big_toe",
    "right_small_toe",
    "right_heel",
)
#: Number of keypoints of each layout.
KEYPOINTS: Final[dict[str, int]] = {"coco": 17, "coco_wholebody": 133}

NOSE, LEFT_EYE, RIGHT_EYE, LEFT_EAR, RIGHT_EAR = range(5)
LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_ELBOW, RIGHT_ELBOW, LEFT_WRIST, RIGHT_WRIST = range(5, 11)
LEFT_HIP, RIGHT_HIP, LEFT_KNEE, RIGHT_KNEE, LEFT_ANKLE, RIGHT_ANKLE = range(11, 17)

#: Rows of the head (nose, eyes, ears) and of COCO's 17 keypoints.
HEAD: Final = slice(NOSE, RIGHT_EAR + 1)
BODY: Final = slice(NOSE, RIGHT_ANKLE + 1)
#: Rows of pairs, the left one first.
SHOULDERS: Final = slice(LEFT_SHOULDER, RIGHT_SHOULDER + 1)
HIPS: Final = slice(LEFT_HIP, RIGHT_HIP + 1)
ANKLES: Final = slice(LEFT_ANKLE, RIGHT_ANKLE + 1)


def keypoint_count(layout: str) -> int:
    """Return the number of keypoints of a layout: ``"coco"`` (17) or ``"coco_wholebody"`` (133).

    Raises:
        PerceptionError: for another name.
    """
    try:
        return KEYPOINTS[layout]
    except (KeyError, TypeError):
        raise PerceptionError(
            f"layout must be one of {', '.join(map(repr, KEYPOINTS))}, got {layout!r}"
        ) from None
