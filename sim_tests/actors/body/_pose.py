"""A worker's posture as data, and where it puts every link and every point of the skin.

Small vectors and quaternions (x, y, z, w) are tuples of floats here: a posture is made of some
twenty of them sixty times a second, and NumPy is slow on three numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._asset import JOINTS, PARENTS

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)

_PARENTS: Final = np.array(PARENTS)
# Rows of a cross product: y z − z y, z x − x z, x y − y x.
_NEXT: Final = np.array([1, 2, 0])
_AFTER: Final = np.array([2, 0, 1])


def _depth(joint: int) -> int:
    return 0 if PARENTS[joint] < 0 else 1 + _depth(PARENTS[joint])


def _generation(depth: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Joints so far from the pelvis, and the rows of them and their parents among links."""
    joints = np.array([joint for joint in range(len(JOINTS)) if _depth(joint) == depth])
    return joints, 1 + joints, 1 + _PARENTS[joints]


# Joints equally far from the pelvis turn in one pass; row 0 of a table of links is the pelvis.
_GENERATIONS: Final = tuple(map(_generation, range(1 + max(map(_depth, range(len(JOINTS)))))))


@dataclass(frozen=True, slots=True, eq=False)
class BodyPose:
    """Where a body is and how it is bent.

    Attributes:
        T_odom_body: (4, 4) rigid: the asset's body frame, its metres multiplied by ``scale``, to
            odom. It moves with the pelvis, so it rises, sways and turns a little in walking.
        scale: size of the body over that of its asset.
        joint_rotvecs: (16, 3) rotation vector of each joint, in axes parallel to the body frame at
            rest, in the order of :data:`JOINTS`.
    """

    T_odom_body: FloatArray
    scale: float
    joint_rotvecs: FloatArray


def link_transforms(joints_m: FloatArray, pose: BodyPose) -> FloatArray:
    """(17, 4, 4) from the scaled body at rest to odom: pelvis, then what lies beyond each joint.

    A point p of the asset (metres, body frame at rest) that follows joint j fully is in odom at
    ``links[1 + j] @ (scale * p, 1)``.

    Args:
        joints_m: (16, 3) of the asset.
        pose: the posture.
    """
    centres = joints_m * pose.scale
    turns = rotation_matrices(pose.joint_rotvecs)
    links = np.zeros((1 + len(JOINTS), 4, 4))
    links[:, 3, 3] = 1.0
    links[0] = pose.T_odom_body
    shifts = centres - np.einsum("nij,nj->ni", turns, centres)
    for joints, rows, parents in _GENERATIONS:
        before = links[parents]
        rotation = before[:, :3, :3]
        place = before[:, :3, 3] + np.einsum("nij,nj->ni", rotation, shifts[joints])
        before[:, :3, :3] = rotation @ turns[joints]
        before[:, :3, 3] = place
        links[rows] = before
    return links


def link_transform(
    joints_m: FloatArray,
    pose: BodyPose,
    joints: NDArray[np.int64],
    shares: FloatArray,
    links: FloatArray | None = None,
) -> FloatArray:
    """(N, 4, 4) of rigid pieces that follow only a share of a joint's rotation.

    Args:
        joints_m: (16, 3) of the asset.
        pose: the posture.
        joints: (N,) joint of each piece, −1 for the pelvis.
        shares: (N,) in [0, 1]: the piece turns by the joint's rotation to this power, and follows
            all joints before it fully. Of no meaning for the pelvis.
        links: of :func:`link_transforms` for this pose, if known.

    Returns:
        What takes the scaled body at rest to odom, as :func:`link_transforms` with share 1.
    """
    if links is None:
        links = link_transforms(joints_m, pose)
    parents = np.where(joints < 0, -1, _PARENTS[joints])
    before = links[1 + parents]
    turning = np.where(joints < 0, 0.0, shares)[:, None]
    turn = rotation_matrices(turning * pose.joint_rotvecs[joints])
    centre = joints_m[joints] * pose.scale
    pieces = np.array(before)
    pieces[:, :3, :3] = before[:, :3, :3] @ turn
    shift = centre - np.einsum("nij,nj->ni", turn, centre)
    pieces[:, :3, 3] += np.einsum("nij,nj->ni", before[:, :3, :3], shift)
    return pieces


class BentPoints:
    """Points of an asset, each bent by a share of every joint.

    Args:
        joints_m: (16, 3) of the asset.
        points_m: (N, 3) at rest, body frame, unscaled.
        weights: (N, 16) share of each joint's rotation that a point follows.
    """

    def __init__(self, joints_m: FloatArray, points_m: FloatArray, weights: FloatArray) -> None:
        self._joints_m = joints_m
        self._points_m = np.ascontiguousarray(points_m.T)
        self._passes: list[tuple[NDArray[np.int64], slice]] = []
        owners, shares, begin = [], [], 0
        # The last joint first; joints that move different points turn in one pass.
        waiting = list(range(len(JOINTS) - 1, -1, -1))
        while waiting:
            now: list[int] = []
            moved = np.zeros(len(points_m), dtype=bool)
            for joint in waiting:
                moves = weights[:, joint] != 0.0
                if not (moved & moves).any():
                    now.append(joint)
                moved |= moves
            waiting = [joint for joint in waiting if joint not in now]
            rows = [np.flatnonzero(weights[:, joint]) for joint in now]
            row = np.concatenate(rows)
            owner = np.repeat(now, [len(each) for each in rows])
            self._passes.append((row, slice(begin, begin + row.size)))
            owners.append(owner)
            shares.append(weights[row, owner])
            begin += row.size
        # Of all passes, one after the other.
        self._owner, self._share = np.concatenate(owners), np.concatenate(shares)

    def odom_m(self, pose: BodyPose) -> FloatArray:
        """(N, 3) in odom."""
        points = self._points_m * pose.scale
        rotvecs = pose.joint_rotvecs
        angles = np.sqrt(np.einsum("ij,ij->i", rotvecs, rotvecs))
        axes = (rotvecs / np.maximum(angles, 1e-12)[:, None]).T[:, self._owner]
        centres = (self._joints_m.T * pose.scale)[:, self._owner]
        turns = angles[self._owner] * self._share
        sines, versines = np.sin(turns), 1.0 - np.cos(turns)
        nexts, afters = axes[_NEXT], axes[_AFTER]
        for rows, now in self._passes:
            axis, centre = axes[:, now], centres[:, now]
            arm = points[:, rows] - centre
            parts = axis * arm
            along = parts[0] + parts[1] + parts[2]
            across = nexts[:, now] * arm[_AFTER] - afters[:, now] * arm[_NEXT]
            points[:, rows] = (
                centre + arm + sines[now] * across + versines[now] * (along * axis - arm)
            )
        rotation, origin = pose.T_odom_body[:3, :3], pose.T_odom_body[:3, 3]
        return np.asarray(points.T @ rotation.T + origin)


def skin_points(
    joints_m: FloatArray, pose: BodyPose, points_m: FloatArray, weights: FloatArray
) -> FloatArray:
    """(N, 3) in odom: :class:`BentPoints` for one pose."""
    return BentPoints(joints_m, points_m, weights).odom_m(pose)


def rotation_matrices(rotvecs: FloatArray) -> FloatArray:
    """(N, 3, 3) of (N, 3) rotation vectors (Rodrigues)."""
    squares = np.einsum("ij,ij->i", rotvecs, rotvecs)
    angles = np.sqrt(squares)
    small = squares < 1e-16
    safe = np.where(small, 1.0, squares)
    sine = np.where(small, 1.0, np.sin(angles) / np.sqrt(safe))
    versine = np.where(small, 0.5, (1.0 - np.cos(angles)) / safe)
    x, y, z = rotvecs.T
    out = versine[:, None, None] * rotvecs[:, :, None] * rotvecs[:, None, :]
    diagonal = 1.0 - versine * squares
    sx, sy, sz = sine * x, sine * y, sine * z
    out[:, 0, 0] += diagonal
    out[:, 1, 1] += diagonal
    out[:, 2, 2] += diagonal
    out[:, 0, 1] -= sz
    out[:, 1, 0] += sz
    out[:, 0, 2] += sy
    out[:, 2, 0] -= sy
    out[:, 1, 2] -= sx
    out[:, 2, 1] += sx
    return np.asarray(out)


def about_x(angle_rad: float) -> Quaternion:
    """Turn about x."""
    return (math.sin(0.5 * angle_rad), 0.0, 0.0, math.cos(0.5 * angle_rad))


def about_y(angle_rad: float) -> Quaternion:
    """Turn about y: positive brings what points forwards down."""
    return (0.0, math.sin(0.5 * angle_rad), 0.0, math.cos(0.5 * angle_rad))


def about_z(angle_rad: float) -> Quaternion:
    """Turn about z: positive to the left."""
    return (0.0, 0.0, math.sin(0.5 * angle_rad), math.cos(0.5 * angle_rad))


def about(axis: Vector, angle_rad: float) -> Quaternion:
    """Turn about a unit axis."""
    sin = math.sin(0.5 * angle_rad)
    return (axis[0] * sin, axis[1] * sin, axis[2] * sin, math.cos(0.5 * angle_rad))


def product(first: Quaternion, then: Quaternion) -> Quaternion:
    """``first ∘ then``: turns a vector by ``then``, afterwards by ``first``."""
    ax, ay, az, aw = first
    bx, by, bz, bw = then
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse(q: Quaternion) -> Quaternion:
    """The opposite turn."""
    return (-q[0], -q[1], -q[2], q[3])


def turned(q: Quaternion, v: Vector) -> Vector:
    """``v`` turned by ``q``."""
    x, y, z, w = q
    vx, vy, vz = v
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def slerp(first: Quaternion, second: Quaternion, share: float) -> Quaternion:
    """From ``first`` at 0 to ``second`` at 1, the short way."""
    x, y, z = rotation_vector(product(inverse(first), second))
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return first
    return product(first, about((x / angle, y / angle, z / angle), share * angle))


def rotation_vector(q: Quaternion) -> Vector:
    """Axis times angle in [0, π] of a unit quaternion."""
    x, y, z, w = q if q[3] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sin = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sin < 1e-9 else 2.0 * math.atan2(sin, w) / sin
    return (x * scale, y * scale, z * scale)


def matrix(q: Quaternion) -> FloatArray:
    """(3, 3) of a unit quaternion."""
    x, y, z, w = q
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternion(x_axis: Vector, y_axis: Vector, z_axis: Vector) -> Quaternion:
    """Of the rotation that takes the unit axes to these three; the largest part never cancels."""
    m00, m10, m20 = x_axis
    m01, m11, m21 = y_axis
    m02, m12, m22 = z_axis
    parts = (m00 - m11 - m22, m11 - m00 - m22, m22 - m00 - m11, m00 + m11 + m22)
    largest = max(range(4), key=parts.__getitem__)
    root = math.sqrt(max(1.0 + parts[largest], 0.0))
    rest = 0.5 / root
    if largest == 3:
        return ((m21 - m12) * rest, (m02 - m20) * rest, (m10 - m01) * rest, 0.5 * root)
    if largest == 0:
        return (0.5 * root, (m01 + m10) * rest, (m02 + m20) * rest, (m21 - m12) * rest)
    if largest == 1:
        return ((m01 + m10) * rest, 0.5 * root, (m12 + m21) * rest, (m02 - m20) * rest)
    return ((m02 + m20) * rest, (m12 + m21) * rest, 0.5 * root, (m10 - m01) * rest)
