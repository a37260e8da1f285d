"""The head frame from 3-D head keypoints, by the paper's printed formula.

The frame is the paper's: origin at the nose, y forward (gaze), z to the right ear, x = y × z
(downwards).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from .arrays import FloatArray, finite_array
from .errors import PerceptionError

# Below this sine two directions count as parallel and span no frame.
_PARALLEL_SINE: Final = 1e-3


def printed_head_rotation(head_points_m: ArrayLike, neck_m: ArrayLike) -> FloatArray:
    """Return the head frame according to the paper's printed cross product.

    The gaze is (left ear − right ear) × (nose − neck), normalised. It is perpendicular to the line
    from neck to nose, so for an average adult who looks straight ahead it points about 36° below
    the horizontal.

    Args:
        head_points_m: (5, 3) nose, left eye, right eye, left ear, right ear in any frame F.
        neck_m: (3,) midpoint of the shoulders in F.

    Returns:
        (3, 3) rotation from the head frame to F.

    Raises:
        PerceptionError: if ears, nose and neck do not span a frame.
    """
    points = finite_array("head_points_m", head_points_m, (5, 3))
    neck = finite_array("neck_m", neck_m, (3,))
    ears, nose_line = points[3] - points[4], points[0] - neck
    gaze = np.cross(ears, nose_line)
    scale = float(np.linalg.norm(ears) * np.linalg.norm(nose_line))
    length = float(np.linalg.norm(gaze))
    if length <= _PARALLEL_SINE * scale or scale == 0.0:
        raise PerceptionError(
            "ears, nose and neck must span a frame; the ear axis and the neck-nose line are "
            "parallel or of length 0"
        )
    forward = gaze / length
    right = -ears / np.linalg.norm(ears)
    return np.stack([np.cross(forward, right), forward, right], axis=1)


def lifted_head_model(head_points_m: ArrayLike, neck_m: ArrayLike) -> FloatArray:
    """Return a person's own head points (5, 3) in the paper's head frame, nose at the origin.

    These are the object points of the paper's PnP: lifted keypoints in the frame of
    :func:`printed_head_rotation`.

    Args:
        head_points_m: (5, 3) nose, left eye, right eye, left ear, right ear in any frame F.
        neck_m: (3,) midpoint of the shoulders in F.

    Raises:
        PerceptionError: if ears, nose and neck do not span a frame.
    """
    points = finite_array("head_points_m", head_points_m, (5, 3))
    return np.asarray((points - points[0]) @ printed_head_rotation(points, neck_m))
