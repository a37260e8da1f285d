"""Times and turns between this library and messages."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray, finite_number

from .._errors import NavError
from .messages.builtin_interfaces import Time
from .messages.geometry_msgs import Quaternion
from .messages.std_msgs import Header

# builtin_interfaces/Time counts whole seconds in 32 bits.
_LATEST_S = 2**31 - 1
# A robot farther from its odom frame than the earth is round is lost.
_FARTHEST_M = 1e6


def to_time(stamp_s: float) -> Time:
    """A stamp as a message, to the nanosecond.

    Raises:
        NavError: it is not finite or outside 0 to 2³¹ − 1 s.
    """
    stamp = finite_number("stamp_s", stamp_s, NavError, minimum=0.0, maximum=_LATEST_S - 1.0)
    # Apart, since a float holds today's seconds to a quarter of a microsecond only.
    sec = math.floor(stamp)
    more, nanosec = divmod(round((stamp - sec) * 1e9), 1_000_000_000)
    return Time(sec + more, nanosec)


def to_seconds(time: Time) -> float:
    """A message's stamp in seconds."""
    return time.sec + 1e-9 * time.nanosec


def header(stamp_s: float, frame_id: str) -> Header:
    """A header with time and frame."""
    return Header(to_time(stamp_s), frame_id)


def yaw_quaternion(yaw_rad: float) -> Quaternion:
    """A turn about z."""
    return Quaternion(z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad))


def pose_matrix(position_m: tuple[float, float, float], turn: Quaternion) -> FloatArray:
    """(4, 4) of a position and a quaternion, which is normalised.

    Raises:
        NavError: a number is not finite, a place beyond 10⁶ m, or a quaternion without length.
    """
    numbers = np.array([turn.x, turn.y, turn.z, turn.w])
    length = math.hypot(*numbers)  # infinite without a warning
    # Written this way round so that NaN is refused.
    if not (np.abs(position_m).max() <= _FARTHEST_M and 0.5 < length < 2.0):
        raise NavError(
            f"a pose must have a finite place within {_FARTHEST_M:g} m and a quaternion of length "
            f"1, got {position_m} m and {numbers.tolist()}"
        )
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(numbers / length).as_matrix()
    pose[:3, 3] = position_m
    return pose
