"""A body's pose as data, and the links, rigid pieces and skin points that follow from it.

Links are numbered by :data:`JOINTS` plus one: row 0 is the pelvis, row 1 + j the part of the body
beyond joint j.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._asset import JOINTS, PARENTS

_PARENTS: Final = np.array(PARENTS)
# Component order of a cross product: y z − z y, z x − x z, x y − y x.
_NEXT: Final = np.array([1, 2, 0])
_AFTER: Final = np.array([2, 0, 1])
# The matrix (0 −z y, z 0 −x, −y x 0), row by row: components of the vector, and their signs.
_SKEW_ROWS: Final = np.array([0, 2, 1, 2, 0, 0, 1, 0, 0])
_SKEW_SIGNS: Final = np.array([0.0, -1.0, 1.0, 1.0, 0.0, -1.0, -1.0, 1.0, 0.0])


def _depth(joint: int) -> int:
    return 0 if PARENTS[joint] < 0 else 1 + _depth(PARENTS[joint])


def _generation(depth: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the joints at this depth below the pelvis, their link rows and their parents' rows."""
    joints = np.array([joint for joint in range(len(JOINTS)) if _depth(joint) == depth])
    return joints, 1 + joints, 1 + _PARENTS[joints]


# Joints at equal depth below the pelvis are computed in one pass.
_GENERATIONS: Final = tuple(map(_generation, range(1 + max(map(_depth, range(len(JOINTS)))))))


@dataclass(frozen=True, slots=True, eq=False)
class BodyPose:
    """Place of a body and rotation of its joints.

    Attributes:
        T_odom_body: (4, 4) rigid, from the scaled body frame to odom. The frame moves with the
            pelvis: it rises, sways and turns a little during a walk.
        scale: stature of the body divided by that of its asset.
        joint_rotvecs: (16, 3) rotation vector of each joint in the order of :data:`JOINTS`, in axes
            parallel to the body frame at rest.
    """

    T_odom_body: FloatArray
    scale: float
    joint_rotvecs: FloatArray


def link_transforms(joints_m: FloatArray, pose: BodyPose) -> FloatArray:
    """Return (17, 4, 4) transforms of all links from the scaled body at rest to odom.

    A point p of the asset (metres, body frame at rest) that follows joint j fully lies in odom at
    ``links[1 + j] @ (scale * p, 1)``.

    Args:
        joints_m: (16, 3) joints of the asset at rest.
        pose: the body's pose.
    """
    centres = joints_m * pose.scale
    turns = rotation_matrices(pose.joint_rotvecs)
    links = np.zeros((1 + len(JOINTS), 4, 4))
    links[:, 3, 3] = 1.0
    links[0] = pose.T_odom_body
    shifts = centres - np.einsum("nij,nj->ni", turns, centres)
    for joints, rows, parents in _GENERATIONS:
        before = links.take(parents, axis=0)
        rotation = before[:, :3, :3]
        place = before[:, :3, 3] + np.einsum("nij,nj->ni", rotation, shifts.take(joints, axis=0))
        before[:, :3, :3] = rotation @ turns.take(joints, axis=0)
        before[:, :3, 3] = place
        links[rows] = before
    return links


class RigidPieces:
    """Rigid pieces that each follow a share of one joint's rotation, and its parents fully.

    With share 1 a piece moves with its joint's link.

    Args:
        joints_m: (16, 3) joints of the asset at rest.
        joints: (N,) joint of each piece, −1 for the pelvis.
        shares: (N,) in [0, 1]: the part of the joint's rotation angle by which a piece turns;
            ignored for the pelvis.
    """

    def __init__(self, joints_m: FloatArray, joints: NDArray[np.int64], shares: FloatArray) -> None:
        self._joints, self._centres_m = joints, joints_m[joints]
        self._parent_rows = 1 + np.where(joints < 0, -1, _PARENTS[joints])
        self._turning = np.where(joints < 0, 0.0, shares)[:, None]

    def odom(self, pose: BodyPose, links: FloatArray) -> FloatArray:
        """Return (N, 4, 4) transforms to odom, from the :func:`link_transforms` of the pose."""
        pieces = links.take(self._parent_rows, axis=0)
        before = np.array(pieces[:, :3, :3])
        turn = rotation_matrices(self._turning * pose.joint_rotvecs.take(self._joints, axis=0))
        centre = self._centres_m * pose.scale
        pieces[:, :3, :3] = before @ turn
        shift = centre - np.einsum("nij,nj->ni", turn, centre)
        pieces[:, :3, 3] += np.einsum("nij,nj->ni", before, shift)
        return np.asarray(pieces)


class SkinnedPoints:
    """Points of an asset that each follow a share of every joint's rotation.

    Args:
        joints_m: (16, 3) joints of the asset at rest.
        points_m: (N, 3) at rest in the body frame, unscaled.
        weights: (N, 16) in [0, 1]: the share of each joint's rotation that a point follows.
    """

    def __init__(self, joints_m: FloatArray, points_m: FloatArray, weights: FloatArray) -> None:
        self._points_m = np.ascontiguousarray(points_m.T)
        self._passes: list[tuple[NDArray[np.int64], slice]] = []
        owners, shares, begin = [], [], 0
        # From the last joint to the first. Joints that move disjoint points share a pass.
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
        # All passes, one after the other.
        self._owner, self._share = np.concatenate(owners), np.concatenate(shares)
        self._centres_m = np.ascontiguousarray(joints_m.T[:, self._owner])

    def odom_m(self, pose: BodyPose) -> FloatArray:
        """Return (N, 3) points in odom."""
        points = self._points_m * pose.scale
        rotvecs = pose.joint_rotvecs
        angles = np.sqrt(np.einsum("ij,ij->i", rotvecs, rotvecs))
        axes = (rotvecs / np.maximum(angles, 1e-12)[:, None]).T.take(self._owner, axis=1)
        centres = self._centres_m * pose.scale
        turns = angles[self._owner] * self._share
        sines, versines = np.sin(turns), 1.0 - np.cos(turns)
        nexts, afters = axes.take(_NEXT, axis=0), axes.take(_AFTER, axis=0)
        for rows, now in self._passes:
            axis, centre = axes[:, now], centres[:, now]
            arm = points.take(rows, axis=1) - centre
            parts = axis * arm
            along = parts[0] + parts[1] + parts[2]
            across = nexts[:, now] * arm.take(_AFTER, axis=0)
            across -= afters[:, now] * arm.take(_NEXT, axis=0)
            points[:, rows] = (
                centre + arm + sines[now] * across + versines[now] * (along * axis - arm)
            )
        rotation, origin = pose.T_odom_body[:3, :3], pose.T_odom_body[:3, 3]
        return np.asarray(points.T @ rotation.T + origin)


def skin_points(
    joints_m: FloatArray, pose: BodyPose, points_m: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return (N, 3) points in odom; see :class:`SkinnedPoints`."""
    return SkinnedPoints(joints_m, points_m, weights).odom_m(pose)


def rotation_matrices(rotvecs: FloatArray) -> FloatArray:
    """Return the (N, 3, 3) matrices of (N, 3) rotation vectors (Rodrigues' formula)."""
    squares = np.einsum("ij,ij->i", rotvecs, rotvecs)
    angles = np.sqrt(squares)
    small = squares < 1e-16
    safe = np.where(small, 1.0, squares)
    sine = np.where(small, 1.0, np.sin(angles) / np.sqrt(safe))
    versine = np.where(small, 0.5, (1.0 - np.cos(angles)) / safe)
    out = (versine[:, None, None] * rotvecs[:, :, None] * rotvecs[:, None, :]).reshape(-1, 9)
    out[:, ::4] += (1.0 - versine * squares)[:, None]
    out += (sine[:, None] * rotvecs).take(_SKEW_ROWS, axis=1) * _SKEW_SIGNS
    return np.asarray(out.reshape(-1, 3, 3))
