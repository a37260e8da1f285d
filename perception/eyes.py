"""Directions of the eyes in the head: from irises in the image, with their uncertainty.

The irises of a near face move against the corners of the eyes as the eyes turn. At 2 m a pixel of a
640 × 480 image with 60° of view is 3.6 mm there, or 20° of rotation, so the uncertainty of the
irises' place decides how much the eyes say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np

from ._camera import Camera
from ._stages import HeadPose, PersonKeypoints
from .arrays import FloatArray, ImageRgb, covariance_matrix, finite_array, set_fields
from .errors import PerceptionError
from .matrices import CHI2_999, mahalanobis2

#: Distance of the iris ahead of the eye's centre of rotation. The centre lies 13.5 mm behind the
#: front of the cornea (Fry and Hill 1962), the iris 3.6 mm.
IRIS_ARM_M: Final = 0.010
#: Relative standard deviation of this distance, with what a network's irises lag behind.
ARM_RELATIVE_STD: Final = 0.2
#: Iris of eyes that look straight ahead, from the midpoint of the corners of the eye, averaged over
#: both eyes: down and forward, and their standard deviations between people.
AHEAD_M: Final = np.array([-0.0004, 0.0015])
AHEAD_STD_M: Final = np.array([0.0007, 0.0015])
# Eyes do not turn farther in the head than this.
_MAX_TURN_RAD: Final = math.radians(50.0)


@dataclass(frozen=True, slots=True, eq=False)
class EyeGaze:
    """Rotation of both eyes in the head.

    Attributes:
        angles_rad: (2,) yaw, positive to the person's left, and pitch, positive up, from the head's
            forward axis.
        covariance_rad2: (2, 2) covariance of the angles.
    """

    angles_rad: FloatArray
    covariance_rad2: FloatArray

    def __post_init__(self) -> None:
        angles = finite_array("angles_rad", self.angles_rad, (2,))
        if np.abs(angles).max() > math.pi / 2.0:
            raise PerceptionError(
                f"angles_rad must lie within ±π/2, got yaw {angles[0]:g} and pitch {angles[1]:g}"
            )
        set_fields(
            self,
            angles_rad=angles,
            covariance_rad2=covariance_matrix("covariance_rad2", self.covariance_rad2, 2),
        )

    @property
    def rotation_head_eyes(self) -> FloatArray:
        """Rotation (3, 3) in the paper's head frame; its second column is the gaze in the head."""
        yaw, pitch = self.angles_rad.tolist()
        (cy, sy), (cp, sp) = (math.cos(yaw), math.sin(yaw)), (math.cos(pitch), math.sin(pitch))
        # Pitch about z (the right ear), then yaw about the head's up axis −x.
        return np.array([[cp, -sp, 0.0], [cy * sp, cy * cp, sy], [-sy * sp, -sy * cp, cy]])


@runtime_checkable
class EyeEstimator(Protocol):
    """Interface: finds how the eyes of people with known head poses are turned in the head."""

    def estimate(
        self,
        image_rgb: ImageRgb,
        camera: Camera,
        heads: tuple[HeadPose | None, ...],
        people: tuple[PersonKeypoints, ...],
    ) -> tuple[EyeGaze | None, ...]:
        """Return one measurement per head and person, in order; None where eyes are not seen."""
        ...


def eyes_from_irises(
    offset_m: FloatArray,
    rotation_camera_ray: FloatArray,
    head: HeadPose,
    *,
    iris_std_m: tuple[float, float],
) -> EyeGaze | None:
    """Return the rotation of the eyes from where the irises lie between the eyes' corners.

    A gaze g in head axes moves the iris by g times :data:`IRIS_ARM_M`. Seen along a ray, its offset
    from the midpoint of the corners is P (a + arm · (g − y)): P are the first two rows of the
    rotation from head to ray axes, and a is the offset of eyes that look along the head's axis y.
    The gaze
    is the unit vector towards the camera that fulfils this exactly.

    The covariance holds the errors of the irises' place, the spread of a and of the arm between
    people, and the error of the head's direction as far as it moves the expected iris.

    Args:
        offset_m: (2,) mean offset of both irises, along x and y of the ray axes.
        rotation_camera_ray: (3, 3) from ray axes (z from the camera to the face) to camera axes.
        head: pose of the head.
        iris_std_m: standard deviations of the offset, across the head and along its height.

    Returns:
        The rotation, or None if no eye turns so far.

    Raises:
        PerceptionError: for an offset that is not finite, or a standard deviation that is not
            positive.
    """
    offset = finite_array("offset_m", offset_m, (2,))
    arm = IRIS_ARM_M
    stds = finite_array("iris_std_m", iris_std_m, (2,))
    if stds.min() <= 0.0:
        raise PerceptionError(f"iris_std_m must be positive, got {stds.tolist()}")
    to_ray = rotation_camera_ray.T @ head.rotation_camera_head
    ahead = np.array([*AHEAD_M, 0.0])
    ahead[1] -= arm
    across = (offset - to_ray[:2] @ ahead) / arm
    towards = 1.0 - float(across @ across)
    if towards <= 0.0:
        return None
    gaze = to_ray.T @ np.array([*across, -math.sqrt(towards)])
    yaw, pitch = math.atan2(-gaze[2], gaze[1]), -math.asin(max(-1.0, min(1.0, float(gaze[0]))))
    if max(abs(yaw), abs(pitch)) > _MAX_TURN_RAD:
        return None
    angles = np.array([yaw, pitch])
    turn = EyeGaze(angles, np.eye(2)).rotation_head_eyes
    # Derivatives of the gaze by yaw and pitch, then of the offset.
    moves = np.column_stack([-math.cos(pitch) * turn[:, 2], -turn[:, 0]])
    jacobian = arm * to_ray[:2] @ moves
    if abs(float(np.linalg.det(jacobian))) < 1e-3 * arm * arm:
        return None
    inverse = np.linalg.inv(jacobian)
    # Errors of the irises' place: across the head along its z axis, and along its height.
    axes = to_ray[:2][:, [2, 0]]
    covariance = axes @ np.diag(stds**2) @ axes.T
    spread = to_ray[:2, :2] * AHEAD_STD_M
    covariance = covariance + spread @ spread.T
    covariance = inverse @ covariance @ inverse.T
    # The head's error moves the expected iris by a share of what it would move a turned eye.
    share = AHEAD_M[1] / arm
    # Yaw turns about −x of the head, pitch about z.
    lean = head.rotation_camera_head[:, [0, 2]] * [-1.0, 1.0]
    covariance += share**2 * lean.T @ head.covariance[:3, :3] @ lean
    covariance += ARM_RELATIVE_STD**2 * np.outer(angles, angles)
    return EyeGaze(angles, 0.5 * (covariance + covariance.T))


def known_eyes(
    eyes: Sequence[EyeGaze | None], eye_in_head_std_rad: tuple[float, float]
) -> tuple[EyeGaze | None, ...]:
    """Return :func:`fuse_with_prior` of each measurement; None where there is none."""
    return tuple(
        None if each is None else fuse_with_prior(each, eye_in_head_std_rad) for each in eyes
    )


def fuse_with_prior(eyes: EyeGaze, eye_in_head_std_rad: tuple[float, float]) -> EyeGaze | None:
    """Combine a measurement with how eyes turn in heads, by information (Kalman).

    Args:
        eyes: the measurement.
        eye_in_head_std_rad: standard deviations of eyes in the head, sideways and up and down.

    Returns:
        The mean and covariance of the eyes; None if so far a turn has a probability of less than 1
        in 1000, so that something else was measured.
    """
    prior = np.diag(np.square(eye_in_head_std_rad))
    both = prior + eyes.covariance_rad2
    if mahalanobis2(eyes.angles_rad, both) > CHI2_999:
        return None  # what lies so far off is something else than irises
    gain = prior @ np.linalg.inv(both)
    keep = np.eye(2) - gain
    covariance = keep @ prior @ keep.T + gain @ eyes.covariance_rad2 @ gain.T
    return EyeGaze(gain @ eyes.angles_rad, 0.5 * (covariance + covariance.T))
