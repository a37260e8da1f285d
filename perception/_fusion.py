"""Head poses from several estimators, combined by their uncertainties."""

from __future__ import annotations

from typing import Final

import numpy as np

from ._camera import Camera
from ._stages import HeadPose, HeadPoseEstimator, PersonKeypoints, check_count
from .arrays import FloatArray, ImageRgb
from .errors import PerceptionError
from .matrices import rotation_exp, rotation_log

# Limits that chance exceeds in 1 % of cases: χ² of three degrees of freedom for the rotation, of
# six for the whole pose.
_ROTATION_LIMIT_CHI2, _POSE_LIMIT_CHI2 = 11.3, 16.8
# Relative standard deviation of head sizes between adults. The covariance of a pose that assumes
# the average head does not include it.
_HEAD_SIZE_STD: Final = 0.04


class FusedHeadPoseEstimator:
    """Several head pose estimators combined, each weighted by its covariance.

    Poses that agree are combined in information form (rotations as small rotations relative to the
    first). Where they differ by more than their covariances explain on average, the covariance
    grows with the difference. Poses with a difference that chance produces in less than 1 % of
    cases are not averaged: the one with the smaller rotation covariance is returned, with a
    covariance that includes the other pose. A person for whom only one estimator gives a pose gets
    that pose.

    Args:
        estimators: two or more estimators; their errors are assumed to be independent.

    Raises:
        PerceptionError: for fewer than two estimators, or an object that is not one.
    """

    def __init__(self, *estimators: HeadPoseEstimator) -> None:
        if len(estimators) < 2:
            raise PerceptionError(f"fusion takes two or more estimators, got {len(estimators)}")
        for estimator in estimators:
            if not isinstance(estimator, HeadPoseEstimator):
                raise PerceptionError(
                    "an estimator must have the method estimate(image_rgb, camera, people), "
                    f"got {type(estimator).__name__}"
                )
        self.estimators = estimators

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose per person, or None where no estimator gives one.

        Raises:
            PerceptionError: if an estimator returns a different number of results.
        """
        fused: list[HeadPose | None] = [None] * len(people)
        for estimator in self.estimators:
            heads = tuple(estimator.estimate(image_rgb, camera, people))
            check_count(type(estimator).__name__, len(heads), len(people))
            for row, head in enumerate(heads):
                known = fused[row]
                fused[row] = head if known is None or head is None else fuse_heads(known, head)
                if head is None:
                    fused[row] = known
        return tuple(fused)


def fuse_heads(first: HeadPose, second: HeadPose) -> HeadPose:
    """Combine two poses of one head as :class:`FusedHeadPoseEstimator` does.

    ``face_seen`` is the lower of the values that are not None.
    """
    difference = np.concatenate(
        [
            rotation_log(second.rotation_camera_head @ first.rotation_camera_head.T),
            second.position_camera_m - first.position_camera_m,
        ]
    )
    one, two = _with_head_size_spread(first), _with_head_size_spread(second)
    both = one + two + 1e-12 * np.eye(6)
    pose_chi2 = float(difference @ np.linalg.solve(both, difference))
    rotation_chi2 = float(difference[:3] @ np.linalg.solve(both[:3, :3], difference[:3]))
    seen = [pose.face_seen for pose in (first, second) if pose.face_seen is not None]
    ranges = [p.range_relative_std for p in (first, second) if p.range_relative_std is not None]
    if rotation_chi2 > _ROTATION_LIMIT_CHI2 or pose_chi2 > _POSE_LIMIT_CHI2:
        surer = first if np.trace(one[:3, :3]) <= np.trace(two[:3, :3]) else second
        position, rotation = surer.position_camera_m, surer.rotation_camera_head
        covariance = (one if surer is first else two) + np.outer(difference, difference)
        if surer.range_relative_std is None:
            ranges = []
    else:
        gain = one @ np.linalg.inv(both)
        step = gain @ difference
        rotation = rotation_exp(step[:3]) @ first.rotation_camera_head
        position = first.position_camera_m + step[3:]
        # Joseph's form keeps the covariance positive definite.
        keep = np.eye(6) - gain
        covariance = keep @ one @ keep.T + gain @ two @ gain.T
        covariance = covariance * max(1.0, rotation_chi2 / 3.0, pose_chi2 / 6.0)
    return HeadPose(
        position,
        rotation,
        0.5 * (covariance + covariance.T),
        max(first.reprojection_error_px, second.reprojection_error_px),
        face_seen=min(seen) if seen else None,
        range_relative_std=min(ranges) if ranges else None,
    )


def _with_head_size_spread(head: HeadPose) -> FloatArray:
    """Return the covariance; without a measured range, with the spread of head sizes added."""
    covariance = np.array(head.covariance)
    if head.range_relative_std is None:
        covariance[3:, 3:] += _HEAD_SIZE_STD**2 * np.outer(
            head.position_camera_m, head.position_camera_m
        )
    return covariance
