"""From head poses to α and its standard deviation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._attention import AttentionCone
from ._head_pose import HeadPose
from .anthropometry import EYES_HEAD_M
from .arrays import FloatArray

# A standard normal in two dimensions on a regular grid (trapezoidal rule). The score has kinks, on
# the axis and at the edge of the cone, where a linear propagation fails and a Gauss–Hermite rule is
# coarse; the grid is finest in the plane of gaze and robot, where the edge is crossed.
_IN_PLANE: Final = np.linspace(-4.0, 4.0, 25)
_OUT_OF_PLANE: Final = np.linspace(-3.5, 3.5, 15)
_NODES: Final = np.stack(
    [axis.ravel() for axis in np.meshgrid(_OUT_OF_PLANE, _IN_PLANE, indexing="ij")], axis=0
)
_DENSITY: Final = np.exp(-0.5 * np.sum(_NODES**2, axis=0))
_WEIGHTS: Final = _DENSITY / _DENSITY.sum()
_NEAREST_M: Final = 0.1
# Of the components of a cross product: x from y and z, and so on.
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_TURNING_SIGNS: Final = np.array([[-1.0], [1.0]])


@dataclass(frozen=True, slots=True)
class AwarenessEstimate:
    """α of one person and its standard deviation."""

    awareness: float
    awareness_std: float


def awareness_of(
    cone: AttentionCone, head: HeadPose, robot_points_camera_m: FloatArray
) -> tuple[float, float]:
    """Return α of the robot's best visible point and the standard deviation of that measurement.

    α is eqs. (1)–(3) with the cone's apex at the midpoint of the eyes. Its standard deviation, that
    of α over repeated measurements of the same head, comes from the 6×6 covariance of the head
    pose: both errors that matter, those of the gaze and of the apex across the line of sight, are
    angles across the gaze; their joint normal is integrated over the score numerically.

    Args:
        cone: the attention cone.
        head: pose in the camera frame.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame.
    """
    sights = _Sights((head,), robot_points_camera_m)
    nominal = float(cone_scores(cone, sights.cosines).max())
    mean, square = _moments(cone, sights, sights.pose_covariance())
    return nominal, float(np.sqrt(max(square[0] - mean[0] ** 2, 0.0)))


def estimate_awareness(
    cone: AttentionCone,
    heads: Sequence[HeadPose],
    robot_points_camera_m: FloatArray,
    *,
    extra_std_rad: FloatArray,
    eye_in_head_std_rad: tuple[float, float],
    face_seen: FloatArray,
) -> tuple[AwarenessEstimate, ...]:
    """Return what may be believed about the awareness of each of N people.

    * α is the score of the head's direction, or its expected value over the errors of the head pose
      where that is lower (near the axis): doubt lowers α and never raises it.
    * Its standard deviation is the root mean square distance of the person's own score from it,
      over the errors of the head pose and over where the eyes may point within the head.
    * With probability 1 − ``face_seen`` the camera sees no face. Who shows no face to the camera
      has no view of it: then the score is 0, whatever the head pose says. α and its standard
      deviation are the moments of both cases together.

    Args:
        cone: the attention cone.
        heads: N poses in the camera frame.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame.
        extra_std_rad: (N,) error of either angle of the gaze beyond the covariance of the pose.
        eye_in_head_std_rad: spread of the eyes in the head sideways and up and down.
        face_seen: (N,) probability that a face is seen.
    """
    if not heads:
        return ()
    sights = _Sights(tuple(heads), robot_points_camera_m)
    nominal = cone_scores(cone, sights.cosines.max(axis=1))
    posed = sights.pose_covariance() + (extra_std_rad**2)[:, None, None] * np.eye(2)
    looked = posed + sights.eye_covariance(eye_in_head_std_rad)
    means, squares = _moments(cone, sights, np.array([posed, looked]))
    mean, (whole_mean, whole_square) = means[0], (means[1], squares[1])
    alpha = face_seen * np.minimum(nominal, mean)
    variance = face_seen * (whole_square - 2.0 * alpha * whole_mean) + alpha**2
    std = np.sqrt(np.maximum(variance, 0.0))
    return tuple(
        AwarenessEstimate(*pair) for pair in zip(alpha.tolist(), std.tolist(), strict=True)
    )


def cone_scores(cone: AttentionCone, cosines: FloatArray) -> FloatArray:
    """α for the cosine of the angle between gaze and robot: eq. (3) in terms of that angle."""
    edge = math.cos(cone.half_angle_rad)
    inside = np.minimum(np.maximum(cosines, edge), 1.0)
    tangent = np.sqrt(1.0 - inside * inside) / inside
    return np.asarray(np.maximum(1.0 - tangent / math.tan(cone.half_angle_rad), 0.0))


class _Sights:
    """Lines of sight from the eyes of N heads to M points, and small turns across the gaze.

    Each gaze can turn about two axes; ``normal`` and ``across`` (N, 3) are the directions in which
    it then moves, out of and in the plane that it spans with the best line of sight.
    """

    def __init__(self, heads: tuple[HeadPose, ...], points: FloatArray) -> None:
        self._rotation = np.array([head.rotation_camera_head for head in heads])
        self._covariance = np.array([head.covariance for head in heads])
        gaze = self._rotation[:, :, 1]
        self._arm = self._rotation @ EYES_HEAD_M
        apex = self._arm + np.array([head.position_camera_m for head in heads])
        offset = points - apex[:, None]
        distance = np.maximum(np.sqrt((offset * offset).sum(axis=2)), 1e-9)
        sight = offset / distance[..., None]
        #: (N, M) of the angles between gaze and lines of sight
        self.cosines = (sight @ gaze[:, :, None])[..., 0]
        rows, best = np.arange(len(heads)), self.cosines.argmax(axis=1)
        self._distance = np.maximum(distance[rows, best], _NEAREST_M)
        nearest = sight[rows, best]
        normal = _cross(gaze, nearest)
        sine = np.sqrt((normal * normal).sum(axis=1))[:, None]
        # Looking straight at the robot (or away): any plane through the gaze will do.
        straight = sine < 1e-9
        normal = np.where(straight, self._rotation[:, :, 0], normal / np.maximum(sine, 1e-9))
        #: (N, 2, 3) normal and across
        self._axes = np.empty((len(heads), 2, 3))
        self._axes[:, 0], self._axes[:, 1] = normal, _cross(normal, gaze)
        self._sight_axes = np.empty_like(self._axes)
        self._sight_axes[:, 0], self._sight_axes[:, 1] = normal, _cross(normal, nearest)
        #: (N, 2, 3): how a small rotation vector moves the gaze along normal and across: since
        #: normal · (δ × gaze) = −across · δ and across · (δ × gaze) = normal · δ.
        self._turning = self._axes[:, ::-1] * _TURNING_SIGNS
        #: (N, 2, M) components of the lines of sight along normal and across
        self.components = self._axes @ sight.swapaxes(1, 2)

    def pose_covariance(self) -> FloatArray:
        """(N, 2, 2) of the gaze against the line of sight, from the covariance of the head pose."""
        # A small turn δ moves the gaze by δ × g and the apex by δ × arm; a shift of the apex turns
        # the line of sight the other way.
        jacobian = np.empty((len(self._arm), 2, 6))
        sight = self._sight_axes / self._distance[:, None, None]
        jacobian[..., 3:] = sight
        jacobian[..., :3] = self._turning - _cross(sight, self._arm[:, None])
        return np.asarray(jacobian @ self._covariance @ jacobian.swapaxes(1, 2))

    def eye_covariance(self, std_rad: tuple[float, float]) -> FloatArray:
        """(N, 2, 2) from eyes that turn sideways about the head's x axis and up about its z."""
        axes = self._turning @ (self._rotation[:, :, ::2] * std_rad)
        return np.asarray(axes @ axes.swapaxes(1, 2))


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """(…, 3) cross products; several times faster than ``np.cross`` on a handful of rows."""
    return np.asarray(
        first[..., _NEXT] * second[..., _LAST] - first[..., _LAST] * second[..., _NEXT]
    )


def _moments(
    cone: AttentionCone, sights: _Sights, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(…, N) mean and mean square of the best score over normal turns of the gaze (…, N, 2, 2)."""
    first = np.sqrt(np.maximum(covariance[..., 0, 0], 0.0))
    shared = covariance[..., 1, 0] / np.where(first > 0.0, first, 1.0)
    second = np.sqrt(np.maximum(covariance[..., 1, 1] - shared**2, 0.0))
    out = first[..., None] * _NODES[0]
    within = shared[..., None] * _NODES[0] + second[..., None] * _NODES[1]
    angle = np.maximum(np.sqrt(out * out + within * within), 1e-12)
    cosine, slope = np.cos(angle), np.sin(angle) / angle
    highest = None
    for point in range(sights.cosines.shape[1]):
        aside = sights.components[:, :, point, None]
        towards = cosine * sights.cosines[:, point, None]
        towards += slope * (out * aside[:, 0] + within * aside[:, 1])
        highest = towards if highest is None else np.maximum(highest, towards)
    scores = cone_scores(cone, highest) if highest is not None else np.zeros_like(out)
    return scores @ _WEIGHTS, (scores * scores) @ _WEIGHTS
