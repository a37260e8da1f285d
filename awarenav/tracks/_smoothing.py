"""Smoothed tracks: the best estimate of each state from the whole recording.

A filter knows the past alone, a smoother the future too. Its path is the reference for what the
tracker reported and predicted. The smoother is filterpy's backward pass of Rauch, Tung and Striebel
(AIAA Journal 3, 1965, 1445-1450), over the states that the tracker reported. It is not for a robot
at work, so filterpy is imported by the first call only.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from perception.arrays import FloatArray, finite_array
from perception.installation import install_command
from tracking import TrackerConfig, TrackingError

# The 2 × 2 patterns of one axis, for both x and y.
_POSITION = np.kron(np.diag([1.0, 0.0]), np.eye(2))
_VELOCITY = np.kron(np.diag([0.0, 1.0]), np.eye(2))
_POSITION_FROM_VELOCITY = np.kron([[0.0, 1.0], [0.0, 0.0]], np.eye(2))
_CROSS = _POSITION_FROM_VELOCITY + _POSITION_FROM_VELOCITY.T


class SmoothedPath(NamedTuple):
    """A smoothed track.

    Attributes:
        stamps_s: (N,).
        states: (N, 4) x, y (m), vx, vy (m/s) in odom.
        covariances: (N, 4, 4) of the states.
    """

    stamps_s: FloatArray
    states: FloatArray
    covariances: FloatArray

    def places_m(self, stamps_s: FloatArray) -> FloatArray:
        """Return places (T, 2) at other times, linear in between; NaN outside the track."""
        places = np.column_stack(
            [np.interp(stamps_s, self.stamps_s, self.states[:, axis]) for axis in (0, 1)]
        )
        places[(stamps_s < self.stamps_s[0]) | (stamps_s > self.stamps_s[-1])] = np.nan
        return places


def smooth(
    stamps_s: Any, states: Any, covariances: Any, config: TrackerConfig | None = None
) -> SmoothedPath:
    """Smooth the states that a tracker reported of one person.

    Args:
        stamps_s: (N,) strictly increasing.
        states: (N, 4) x, y (m), vx, vy (m/s) of the track at the frames.
        covariances: (N, 4, 4) of the states.
        config: of the tracker, for its motion model; None for the defaults.

    Raises:
        TrackingError: for arrays of a wrong shape or not finite, stamps that do not increase, or
            without filterpy (extra ``smooth``).
    """
    try:
        # It takes seconds to import, and only recordings are smoothed.
        from filterpy.kalman import KalmanFilter  # noqa: PLC0415
    except ImportError as cause:
        raise TrackingError(
            "smoothing needs the package filterpy, which is not installed; it is the extra "
            f"'smooth': {install_command('smooth')}"
        ) from cause

    density_m2ps3 = (config or TrackerConfig()).acceleration_density_m2ps3
    stamps = finite_array("stamps_s", stamps_s, ("N",), TrackingError)
    means = finite_array("states", states, (len(stamps), 4), TrackingError)
    spreads = finite_array("covariances", covariances, (len(stamps), 4, 4), TrackingError)
    steps_s = np.diff(stamps, prepend=stamps[:1] - 1.0)
    if bool((steps_s <= 0.0).any()):
        raise TrackingError(f"stamps_s must increase, got a step of {steps_s.min():g} s")
    if len(stamps) < 2:
        return SmoothedPath(stamps, means, spreads)
    smoothed, narrowed, _, _ = KalmanFilter(dim_x=4, dim_z=2).rts_smoother(
        np.array(means),
        np.array(spreads),
        [_transition(step_s) for step_s in steps_s.tolist()],
        [_process_noise(step_s, density_m2ps3) for step_s in steps_s.tolist()],
    )
    # Rounding leaves the covariances asymmetric in the last digit.
    narrowed = 0.5 * (narrowed + narrowed.transpose(0, 2, 1))
    return SmoothedPath(stamps, np.asarray(smoothed), narrowed)


def _transition(dt_s: float) -> FloatArray:
    """Return F (4, 4) of a constant velocity over ``dt_s`` ≥ 0."""
    return np.asarray(np.eye(4) + dt_s * _POSITION_FROM_VELOCITY)


def _process_noise(dt_s: float, acceleration_density_m2ps3: float) -> FloatArray:
    """Return Q (4, 4), the covariance that white acceleration adds over ``dt_s`` ≥ 0."""
    pattern = dt_s**3 / 3.0 * _POSITION + dt_s**2 / 2.0 * _CROSS + dt_s * _VELOCITY
    return np.asarray(acceleration_density_m2ps3 * pattern)
