"""Motion model on the floor plane, driven by white acceleration in continuous time.

The state order is x, y, vx, vy. Because the noise is continuous, the matrices compose exactly: two
steps of dt/2 equal one step of dt, so the frame rate does not matter. Source: Bar-Shalom, Li,
Kirubarajan, *Estimation with Applications to Tracking and Navigation* (2001), sections 6.2
(constant velocity) and 8.2 (the damped form, there for acceleration).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._table import BoolArray

# The 2 × 2 patterns of one axis, for both x and y.
_POSITION = np.kron(np.diag([1.0, 0.0]), np.eye(2))
_VELOCITY = np.kron(np.diag([0.0, 1.0]), np.eye(2))
_POSITION_FROM_VELOCITY = np.kron([[0.0, 1.0], [0.0, 0.0]], np.eye(2))
_CROSS = _POSITION_FROM_VELOCITY + _POSITION_FROM_VELOCITY.T
_IDENTITY = np.eye(4)

# For steps below this share of the time constant, the closed form loses digits; use its series.
_SHORT_SHARE: Final = 1e-3


def transition(dt_s: float) -> FloatArray:
    """Return F (4, 4) of a constant velocity over ``dt_s`` ≥ 0."""
    return _IDENTITY + dt_s * _POSITION_FROM_VELOCITY


def process_noise(dt_s: float, acceleration_density_m2ps3: float) -> FloatArray:
    """Return Q (4, 4), the covariance that white acceleration adds over ``dt_s`` ≥ 0."""
    pattern = dt_s**3 / 3.0 * _POSITION + dt_s**2 / 2.0 * _CROSS + dt_s * _VELOCITY
    return np.asarray(acceleration_density_m2ps3 * pattern)


def damped_transition(dt_s: FloatArray, time_constant_s: float) -> FloatArray:
    """Return F (N, 4, 4) of a velocity that decays with ``time_constant_s``; ``dt_s`` (N,) ≥ 0."""
    decayed = -np.expm1(-dt_s / time_constant_s)[:, None, None]
    pattern = time_constant_s * _POSITION_FROM_VELOCITY - _VELOCITY
    return np.asarray(_IDENTITY + decayed * pattern)


def damped_process_noise(
    dt_s: FloatArray, time_constant_s: float, acceleration_density_m2ps3: float
) -> FloatArray:
    """Return Q (N, 4, 4), the covariance that white acceleration adds to a velocity that decays.

    The velocity is an Ornstein–Uhlenbeck process. Its variance never exceeds q τ / 2, and the
    variance of the position grows in proportion to time, not to its cube.
    """
    tau = time_constant_s
    share = dt_s / tau
    decayed, decayed2 = -np.expm1(-share), -np.expm1(-2.0 * share)
    position = np.where(
        share < _SHORT_SHARE,
        dt_s**3 * (1.0 / 3.0 - 0.25 * share),
        tau * tau * (dt_s - 2.0 * tau * decayed + 0.5 * tau * decayed2),
    )
    pattern = (
        position[:, None, None] * _POSITION
        + (0.5 * (tau * decayed) ** 2)[:, None, None] * _CROSS
        + (0.5 * tau * decayed2)[:, None, None] * _VELOCITY
    )
    return np.asarray(acceleration_density_m2ps3 * pattern)


def predict(
    states: FloatArray,
    covariances: FloatArray,
    dt_s: float,
    damped_s: FloatArray | None,
    time_constant_s: float,
    acceleration_density_m2ps3: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the states (N, 4) and covariances (N, 4, 4) predicted ``dt_s`` > 0 ahead.

    Args:
        states: (N, 4).
        covariances: (N, 4, 4).
        dt_s: the whole step.
        damped_s: (N,) the last part of the step, in which the velocity decays; None for no decay.
        time_constant_s: of that decay.
        acceleration_density_m2ps3: q of the white acceleration.
    """
    if damped_s is None:
        F, Q = transition(dt_s), process_noise(dt_s, acceleration_density_m2ps3)
        moved = F @ covariances @ F.T
        return states @ F.T, 0.5 * (moved + moved.transpose(0, 2, 1)) + Q
    q = acceleration_density_m2ps3
    states, covariances = states.copy(), covariances.copy()
    plain: BoolArray = damped_s <= 0.0
    if plain.any():
        states[plain], covariances[plain] = predict(
            states[plain], covariances[plain], dt_s, None, time_constant_s, q
        )
    rows = np.flatnonzero(~plain)
    for row, free_s in zip(rows.tolist(), (dt_s - damped_s[rows]).tolist(), strict=True):
        if free_s > 0.0:
            states[row : row + 1], covariances[row : row + 1] = predict(
                states[row : row + 1], covariances[row : row + 1], free_s, None, time_constant_s, q
            )
    damped = damped_s[rows]
    F = damped_transition(damped, time_constant_s)
    moved = F @ covariances[rows] @ F.transpose(0, 2, 1)
    moved = 0.5 * (moved + moved.transpose(0, 2, 1))
    states[rows] = (F @ states[rows][:, :, None])[:, :, 0]
    covariances[rows] = moved + damped_process_noise(damped, time_constant_s, q)
    return states, covariances
