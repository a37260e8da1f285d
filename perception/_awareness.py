"""From a head pose to α and its standard deviation."""

from __future__ import annotations

from typing import Final

import numpy as np

from ._attention import AttentionCone
from ._head_pose import HeadPose
from ._pose_refinement import skew
from .anthropometry import EYES_HEAD_M
from .arrays import FloatArray

# A standard normal in two dimensions on a regular grid (trapezoidal rule). The score has kinks, on
# the axis and at the edge of the cone, where a linear propagation fails and a Gauss–Hermite rule is
# coarse; the grid is finest in the plane of gaze and robot, where the edge is crossed.
_IN_PLANE: Final = np.linspace(-4.0, 4.0, 33)
_OUT_OF_PLANE: Final = np.linspace(-3.5, 3.5, 15)
_NODES: Final = np.stack(
    [axis.ravel() for axis in np.meshgrid(_OUT_OF_PLANE, _IN_PLANE, indexing="ij")], axis=1
)
_DENSITY: Final = np.exp(-0.5 * np.sum(_NODES**2, axis=1))
_WEIGHTS: Final = _DENSITY / _DENSITY.sum()


def awareness_of(
    cone: AttentionCone, head: HeadPose, robot_points_camera_m: FloatArray
) -> tuple[float, float]:
    """Return α of the robot's best visible point and its standard deviation.

    α is eqs. (1)–(3) with the cone's apex at the midpoint of the eyes. Its standard deviation comes
    from the 6×6 covariance of the head pose: both errors that matter, those of the gaze and of the
    apex across the line of sight, are angles across the gaze; their joint normal is integrated over
    the score numerically.

    Args:
        cone: the attention cone.
        head: pose in the camera frame.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame.
    """
    gaze = head.gaze_camera
    arm = head.rotation_camera_head @ EYES_HEAD_M
    apex = arm + head.position_camera_m
    offset = robot_points_camera_m - apex
    alpha = cone.scores(np.zeros(3), gaze, offset)
    best = int(np.argmax(alpha))
    distance = max(float(np.linalg.norm(offset[best])), 0.1)
    normal, across_gaze, across_sight = _across(gaze, offset[best] / distance, head)
    # Two directions across the gaze and, turned along with it, across the line of sight.
    across = np.stack([normal, across_gaze])
    sight = np.stack([normal, across_sight]) / distance
    # A small turn δ moves the gaze by δ × g and the apex by δ × arm; a shift of the apex turns the
    # line of sight the other way.
    jacobian = np.concatenate([-across @ skew(gaze) - sight @ skew(arm), sight], axis=1)
    covariance = jacobian @ head.covariance @ jacobian.T
    tilt = _NODES @ _factor(covariance).T
    angle = np.linalg.norm(tilt, axis=1)
    direction = (tilt / np.maximum(angle, 1e-12)[:, None]) @ across
    gazes = np.cos(angle)[:, None] * gaze + np.sin(angle)[:, None] * direction
    scores = cone.scores(np.zeros(3), gazes[:, None], offset).max(axis=1)
    mean = float(_WEIGHTS @ scores)
    variance = max(float(_WEIGHTS @ (scores - mean) ** 2), 0.0)
    return float(alpha[best]), float(np.sqrt(variance))


def _across(
    gaze: FloatArray, sight: FloatArray, head: HeadPose
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The normal of the plane of gaze and line of sight, and in it the directions across either."""
    normal = skew(gaze) @ sight
    sine = float(np.linalg.norm(normal))
    # Looking straight at the robot (or away): any plane through the gaze will do.
    normal = head.rotation_camera_head[:, 0] if sine < 1e-9 else normal / sine
    turn = skew(normal)
    return normal, turn @ gaze, turn @ sight


def _factor(covariance: FloatArray) -> FloatArray:
    """Lower Cholesky factor of a (2, 2) covariance that may be singular."""
    first = float(np.sqrt(max(covariance[0, 0], 0.0)))
    shared = float(covariance[1, 0]) / first if first > 0.0 else 0.0
    second = float(np.sqrt(max(covariance[1, 1] - shared**2, 0.0)))
    return np.array([[first, 0.0], [shared, second]])
