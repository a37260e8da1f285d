"""Cameras, observations and walkers for the tracking tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from perception import PersonObservation
from tracking import PersonTrack

FloatArray = NDArray[np.float64]

PERIOD_S = 0.05
CHEST_HEIGHT_M = 1.2

# Optical axes in a level camera that looks along x: z forward, x right, y down.
_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def camera_at(
    x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0, pitch_rad: float = 0.0
) -> FloatArray:
    """Return T_odom_camera of a camera 1.4 m up, turned left by yaw and then down by pitch."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    T = np.eye(4)
    T[:3, :3] = yaw @ pitch @ _OPTICAL
    T[:3, 3] = x_m, y_m, 1.4
    return T


CAMERA = camera_at()


def observe(
    position_odom_m: ArrayLike,
    stamp_s: float,
    *,
    T_odom_camera: FloatArray = CAMERA,
    covariance_odom_m2: ArrayLike = 0.01,
    awareness: float | None = None,
    awareness_std: float = 0.07,
) -> PersonObservation:
    """Return a camera's observation of a person at (x, y); the covariance is (2, 2) or a scalar."""
    point = np.array([*np.asarray(position_odom_m, dtype=float), CHEST_HEIGHT_M])
    covariance = np.eye(3) * 0.02
    covariance[:2, :2] = np.asarray(covariance_odom_m2) * (
        np.eye(2) if np.ndim(covariance_odom_m2) == 0 else 1.0
    )
    R, t = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
    turned = R.T @ covariance @ R
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=R.T @ (point - t),
        position_covariance_m2=0.5 * (turned + turned.T),
        gaze_camera=None,
        awareness=awareness,
        awareness_std=None if awareness is None else awareness_std,
        score=0.9,
    )


def as_bytes(tracks: Sequence[PersonTrack]) -> list[tuple[object, ...]]:
    """Return all values of the tracks, for comparison to the last bit."""
    return [
        tuple(
            value.tobytes() if isinstance(value, np.ndarray) else value
            for value in (getattr(track, name) for name in PersonTrack.__slots__)
        )
        for track in tracks
    ]


def nearest(tracks: Sequence[PersonTrack], position_odom_m: ArrayLike) -> PersonTrack:
    target = np.asarray(position_odom_m)
    return min(tracks, key=lambda track: float(np.linalg.norm(track.position_odom_m - target)))


@lru_cache(maxsize=64)
def white_acceleration(
    dt_s: float, density_m2ps3: float, decay_per_s: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return F and Q by Van Loan's matrix exponential, from the differential equation alone.

    The velocity dies away with ``decay_per_s``.
    """
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 2] = A[3, 3] = -decay_per_s
    W = np.diag([0.0, 0.0, density_m2ps3, density_m2ps3])
    block = expm(dt_s * np.block([[-A, W], [np.zeros((4, 4)), A.T]]))
    F = block[4:, 4:].T
    return F, F @ block[:4, 4:]


def track_of(
    *,
    position: ArrayLike = (0.0, 0.0),
    velocity: ArrayLike = (0.0, 0.0),
    covariance: ArrayLike | None = None,
) -> PersonTrack:
    """Return a confirmed track at stamp 0."""
    return PersonTrack(
        id=1,
        stamp_s=0.0,
        status="confirmed",
        position_odom_m=np.asarray(position, dtype=float),
        velocity_odom_mps=np.asarray(velocity, dtype=float),
        covariance_odom=0.01 * np.eye(4) if covariance is None else np.asarray(covariance),
        awareness=0.5,
        awareness_std=0.1,
        awareness_lower=0.3,
        height_m=1.75,
        time_since_seen_s=0.0,
    )
