"""Constant-velocity motion on the floor plane, driven by white acceleration in continuous time.

State order x, y, vx, vy. Because the noise is continuous, both matrices compose exactly: two steps
of dt/2 are one step of dt, so the frame rate does not matter. Source: Bar-Shalom, Li, Kirubarajan,
*Estimation with Applications to Tracking and Navigation* (2001), section 6.2.
"""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

# The 2 × 2 patterns of one axis, spread over x and y.
_POSITION = np.kron(np.diag([1.0, 0.0]), np.eye(2))
_VELOCITY = np.kron(np.diag([0.0, 1.0]), np.eye(2))
_POSITION_FROM_VELOCITY = np.kron([[0.0, 1.0], [0.0, 0.0]], np.eye(2))
_CROSS = _POSITION_FROM_VELOCITY + _POSITION_FROM_VELOCITY.T
_IDENTITY = np.eye(4)


def transition(dt_s: float) -> FloatArray:
    """Return F (4, 4): where constant velocity carries the state in ``dt_s`` ≥ 0."""
    return _IDENTITY + dt_s * _POSITION_FROM_VELOCITY


def process_noise(dt_s: float, acceleration_density_m2ps3: float) -> FloatArray:
    """Return Q (4, 4): the covariance that white acceleration adds over ``dt_s`` ≥ 0."""
    pattern = dt_s**3 / 3.0 * _POSITION + dt_s**2 / 2.0 * _CROSS + dt_s * _VELOCITY
    return np.asarray(acceleration_density_m2ps3 * pattern)
