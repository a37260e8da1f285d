"""Smoothed tracks: the best estimate of each state from the whole recording.

A filter knows the past alone, a smoother the future too. Its path is the reference for what the
tracker reported and predicted. The smoother is filterpy's backward pass of Rauch, Tung and Striebel
(AIAA Journal 3, 1965, 1445-1450), over the states that the tracker reported. It is not for a robot
at work, and filterpy takes a second to import, so the first call imports it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from perception.arrays import FloatArray, finite_array
from tracking import TrackerConfig, TrackingError


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
        TrackingError: for arrays of a wrong shape or not finite, or stamps that do not increase.
    """
    from filterpy.common import Q_continuous_white_noise  # noqa: PLC0415 - as above
    from filterpy.kalman import KalmanFilter  # noqa: PLC0415

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
        [np.eye(4) + step_s * np.eye(4, k=2) for step_s in steps_s],
        [
            Q_continuous_white_noise(2, step_s, density_m2ps3, block_size=2, order_by_dim=False)
            for step_s in steps_s
        ],
    )
    # Rounding leaves the covariances asymmetric in the last digit.
    narrowed = 0.5 * (narrowed + narrowed.transpose(0, 2, 1))
    return SmoothedPath(stamps, np.asarray(smoothed), narrowed)
