"""Person candidates of laser scans as the observations that a tracker takes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from .._observation import PersonObservation
from ..arrays import finite_number, rigid_transform
from ..errors import PerceptionError
from ._candidate import PersonCandidate

# Height above the floor of the point that represents a body, and its spread among adults.
_CHEST_M: Final = 1.3
_CHEST_STD_M: Final = 0.2
# Standard deviation of a person's speed along each axis, for candidates of another instant.
_WALK_STD_MPS: Final = 1.0


def observations_of(
    candidates: Iterable[PersonCandidate], T_odom_scanner: Any, stamp_s: float | None = None
) -> tuple[PersonObservation, ...]:
    """Return person candidates as observations in the frame of a scanner, without awareness.

    They are for ``PersonTracker.update(observations, stamp_s, T_odom_scanner, sensor=…)``: the
    "camera" frame of these observations is the scanner's, whose pose the tracker's view needs. The
    floor is at z = 0 in odom.

    Args:
        candidates: of one scan, or of several scanners after :func:`merge_candidates`.
        T_odom_scanner: (4, 4) pose of the scanner at the time of the scan.
        stamp_s: time of the frame; None for each candidate's own, which is the same for all
            candidates of one scan. Candidates of another time get it too, and a variance for the
            way that people walk in between.

    Raises:
        PerceptionError: for something that is no candidate, a pose that is not rigid, or a stamp
            that is not finite.
    """
    T = rigid_transform("T_odom_scanner", T_odom_scanner)
    frame_s = None if stamp_s is None else finite_number("stamp_s", stamp_s)
    made = []
    for index, each in enumerate(candidates):
        if not isinstance(each, PersonCandidate):
            raise PerceptionError(
                f"candidates[{index}] must be a PersonCandidate, got {type(each).__name__}"
            )
        stamp = each.stamp_s if frame_s is None else frame_s
        walked_m = _WALK_STD_MPS * (stamp - each.stamp_s)
        covariance = np.diag([walked_m**2, walked_m**2, _CHEST_STD_M**2])
        covariance[:2, :2] += each.covariance_m2
        covariance = T[:3, :3].T @ covariance @ T[:3, :3]
        made.append(
            PersonObservation(
                stamp_s=stamp,
                position_camera_m=T[:3, :3].T
                @ (np.append(each.position_odom_m, _CHEST_M) - T[:3, 3]),
                position_covariance_m2=0.5 * (covariance + covariance.T),
                gaze_camera=None,
                awareness=None,
                awareness_std=None,
                score=each.score,
            )
        )
    return tuple(made)
