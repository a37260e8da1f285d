"""Vectors and unit quaternions (x, y, z, w) as tuples of floats.

A posture takes about twenty of them 60 times per second, and NumPy is slow on three numbers.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from perception.arrays import FloatArray

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)


def add(first: Vector, second: Vector) -> Vector:
    """Return ``first + second``."""
    return (first[0] + second[0], first[1] + second[1], first[2] + second[2])


def subtract(first: Vector, second: Vector) -> Vector:
    """Return ``first - second``."""
    return (first[0] - second[0], first[1] - second[1], first[2] - second[2])


def add_scaled(first: Vector, second: Vector, scale: float) -> Vector:
    """Return ``first + scale * second``."""
    return (
        first[0] + scale * second[0],
        first[1] + scale * second[1],
        first[2] + scale * second[2],
    )


def dot(first: Vector, second: Vector) -> float:
    """Return the scalar product."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def cross(first: Vector, second: Vector) -> Vector:
    """Return the vector product."""
    return (
        first[1] * second[2] - first[2] * second[1],
        first[2] * second[0] - first[0] * second[2],
        first[0] * second[1] - first[1] * second[0],
    )


def unit(vector: Vector) -> Vector:
    """Return the vector at length 1."""
    length = math.sqrt(dot(vector, vector))
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def rotation_x(angle_rad: float) -> Quaternion:
    """Return the rotation about x."""
    return (math.sin(0.5 * angle_rad), 0.0, 0.0, math.cos(0.5 * angle_rad))


def rotation_y(angle_rad: float) -> Quaternion:
    """Return the rotation about y; a positive angle turns x down."""
    return (0.0, math.sin(0.5 * angle_rad), 0.0, math.cos(0.5 * angle_rad))


def rotation_z(angle_rad: float) -> Quaternion:
    """Return the rotation about z; a positive angle turns x to the left."""
    return (0.0, 0.0, math.sin(0.5 * angle_rad), math.cos(0.5 * angle_rad))


def rotation_zy(yaw_rad: float, pitch_rad: float) -> Quaternion:
    """Return the rotation about y by the pitch, and afterwards about z by the yaw."""
    sin_yaw, cos_yaw = math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad)
    sin_pitch, cos_pitch = math.sin(0.5 * pitch_rad), math.cos(0.5 * pitch_rad)
    return (-sin_yaw * sin_pitch, cos_yaw * sin_pitch, sin_yaw * cos_pitch, cos_yaw * cos_pitch)


def axis_angle(axis: Vector, angle_rad: float) -> Quaternion:
    """Return the rotation about a unit axis."""
    sin = math.sin(0.5 * angle_rad)
    return (axis[0] * sin, axis[1] * sin, axis[2] * sin, math.cos(0.5 * angle_rad))


def from_axes(x_axis: Vector, y_axis: Vector, z_axis: Vector) -> Quaternion:
    """Return the rotation that takes the unit axes to these three.

    Of the four forms of the conversion it takes the one with the largest divisor.
    """
    m00, m10, m20 = x_axis
    m01, m11, m21 = y_axis
    m02, m12, m22 = z_axis
    for_x, for_y, for_z, for_w = m00 - m11 - m22, m11 - m00 - m22, m22 - m00 - m11, m00 + m11 + m22
    largest = max(for_x, for_y, for_z, for_w)
    root = math.sqrt(max(1.0 + largest, 0.0))
    rest = 0.5 / root
    if for_x == largest:
        return (0.5 * root, (m01 + m10) * rest, (m02 + m20) * rest, (m21 - m12) * rest)
    if for_y == largest:
        return ((m01 + m10) * rest, 0.5 * root, (m12 + m21) * rest, (m02 - m20) * rest)
    if for_z == largest:
        return ((m02 + m20) * rest, (m12 + m21) * rest, 0.5 * root, (m10 - m01) * rest)
    return ((m21 - m12) * rest, (m02 - m20) * rest, (m10 - m01) * rest, 0.5 * root)


def aligned(x_axis: Vector, towards: Vector) -> Quaternion:
    """Return the rotation that takes x to the unit ``x_axis`` and y near to ``towards``."""
    # Written out: every placing of a body takes four of them.
    ax, ay, az = x_axis
    tx, ty, tz = towards
    back = -(ax * tx + ay * ty + az * tz)
    bx, by, bz = tx + back * ax, ty + back * ay, tz + back * az
    length = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / length, by / length, bz / length
    z_axis = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return from_axes(x_axis, (bx, by, bz), z_axis)


def multiply(first: Quaternion, then: Quaternion) -> Quaternion:
    """Return ``first ∘ then``, which rotates a vector by ``then`` and afterwards by ``first``."""
    ax, ay, az, aw = first
    bx, by, bz, bw = then
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse(q: Quaternion) -> Quaternion:
    """Return the opposite rotation."""
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return ``v`` rotated by ``q``."""
    x, y, z, w = q
    vx, vy, vz = v
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def slerp(first: Quaternion, second: Quaternion, share: float) -> Quaternion:
    """Interpolate from ``first`` at share 0 to ``second`` at share 1, the short way."""
    x, y, z = rotation_vector(multiply(inverse(first), second))
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return first
    return multiply(first, axis_angle((x / angle, y / angle, z / angle), share * angle))


def rotation_vector(q: Quaternion) -> Vector:
    """Return axis times angle, the angle in [0, π]."""
    x, y, z, w = q if q[3] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sin = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sin < 1e-9 else 2.0 * math.atan2(sin, w) / sin
    return (x * scale, y * scale, z * scale)


def rotation_matrix(q: Quaternion) -> FloatArray:
    """Return the (3, 3) matrix."""
    x, y, z, w = q
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
