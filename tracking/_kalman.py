"""The measurement update of many Kalman filters at once: measured position, constant velocity.

The equations of ``filterpy.kalman.KalmanFilter.update`` with H = [I 0], in Joseph form, which keeps
P positive definite. Tests compare the result with filterpy's to 1e-9.
"""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import inverse_2x2

_IDENTITY = np.eye(4)


def correct(
    states: FloatArray, covariances: FloatArray, measured_m: FloatArray, noises_m2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return N states and covariances after one measured position each.

    Args:
        states: (N, 4) x, y, vx, vy.
        covariances: (N, 4, 4), positive definite.
        measured_m: (N, 2) measured positions.
        noises_m2: (N, 2, 2) of the measured positions, positive definite.
    """
    inverse = inverse_2x2(covariances[:, :2, :2] + noises_m2)
    gain = covariances[:, :, :2] @ inverse
    innovation = measured_m - states[:, :2]
    corrected = states + (gain @ innovation[:, :, None])[:, :, 0]
    remainder = np.repeat(_IDENTITY[None], len(states), axis=0)
    remainder[:, :, :2] -= gain
    joseph = remainder @ covariances @ remainder.transpose(0, 2, 1)
    joseph += gain @ noises_m2 @ gain.transpose(0, 2, 1)
    # Rounding leaves the covariance asymmetric in the last digit.
    return corrected, 0.5 * (joseph + joseph.transpose(0, 2, 1))
