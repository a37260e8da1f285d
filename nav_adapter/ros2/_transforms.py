"""Transforms between frames over time, from tf and odometry."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray, finite_number, rigid_transform

from .._errors import NavError
from ..rigid import Motion
from .conversions import pose_matrix, to_seconds, yaw_quaternion
from .messages.geometry_msgs import Point, TransformStamped

_KEPT_S: Final = 5.0
#: The newest transform is used for at most this long after its stamp.
HOLD_S: Final = 0.1
# One between two frames of the robot that has never changed is used for this many of its periods.
_PERIODS: Final = 3.0
# Below this turn an arc is a straight line but for rounding.
_STRAIGHT_RAD: Final = 1e-6


class _Sample(NamedTuple):
    """The pose of a frame in its parent, and how it moves on from there, in itself."""

    stamp_s: float
    T: FloatArray
    motion: Motion


class TransformBuffer:
    """Stores the transforms of the last 5 s and looks up those between any two frames of a tree.

    Between two stamps, a frame moves at constant velocity and turning speed, along an arc. For up
    to 0.1 s after the newest it keeps its motion, as far as it is known; there is no extrapolation
    before the oldest. Static transforms hold at all times and have no stamp. Some senders put them
    among the others: between ``rigid`` frames one that was sent once, and those that are sent again
    and again without a change, are taken to be static.
    """

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._histories: dict[str, list[_Sample]] = {}
        self._static: set[str] = set()

    def add(
        self,
        parent: str,
        child: str,
        stamp_s: float,
        T_parent_child: FloatArray,
        *,
        static: bool = False,
        motion: Motion | None = None,
    ) -> None:
        """Store the pose of ``child`` in ``parent``, and its motion from there in its own frame.

        A frame has one parent. A transform with another parent replaces the frame's history.

        Raises:
            NavError: for a matrix that is not a rigid transform, a stamp that is not finite, or a
                loop of frames.
        """
        parent, child = parent.lstrip("/"), child.lstrip("/")
        T = rigid_transform("T_parent_child", T_parent_child, NavError)
        stamp = finite_number("stamp_s", stamp_s, NavError)
        if child in self._path(parent):
            raise NavError(f"frames must form a tree, got {child!r} above and below {parent!r}")
        if self._parents.get(child) != parent or static:
            self._histories[child] = []
        self._parents[child] = parent
        (self._static.add if static else self._static.discard)(child)
        history = self._histories[child]
        sample = _Sample(stamp, T, motion or Motion(0.0, 0.0))
        insort(history, sample, key=lambda entry: entry.stamp_s)
        while history[-1].stamp_s - history[0].stamp_s > _KEPT_S:
            del history[0]

    def add_message(self, message: TransformStamped, *, static: bool) -> None:
        """Store the transform of a message.

        Raises:
            NavError: as :meth:`add`, and for a rotation that is none.
        """
        self.add(
            message.header.frame_id,
            message.child_frame_id,
            to_seconds(message.header.stamp),
            pose_matrix(message.transform.translation, message.transform.rotation),
            static=static,
        )

    def root(self, frame: str) -> str:
        """Return the topmost frame above a frame; itself if it has no parent."""
        return self._path(frame.lstrip("/"))[-1]

    def forget(self, *, after_s: float = -math.inf) -> int:
        """Forget transforms with later stamps, by default all, and return how many.

        Static transforms are kept.
        """
        forgotten = 0
        for child, history in list(self._histories.items()):
            if child in self._static or history[-1].stamp_s <= after_s:
                continue
            kept = [entry for entry in history if entry.stamp_s <= after_s]
            forgotten += len(history) - len(kept)
            if kept:
                self._histories[child] = kept
            else:
                del self._histories[child], self._parents[child]
        return forgotten

    def lookup(
        self, target: str, source: str, stamp_s: float, *, rigid: bool = False
    ) -> FloatArray:
        """Return T_target_source (4, 4) at ``stamp_s``.

        Args:
            target: name of the frame to transform to.
            source: name of the frame to transform from.
            stamp_s: the time.
            rigid: whether both are frames of one robot.

        Raises:
            NavError: for frames that are not connected, or not known at that time.
        """
        stamp = finite_number("stamp_s", stamp_s, NavError)
        source_way, target_way = self.ways(target, source)
        T_common_source = self._chain(source_way[:-1], stamp, rigid)
        T_common_target = self._chain(target_way[:-1], stamp, rigid)
        return np.asarray(np.linalg.inv(T_common_target) @ T_common_source, dtype=np.float64)

    def ways(self, target: str, source: str) -> tuple[list[str], list[str]]:
        """Return the frames from ``source``, and from ``target``, up to the nearest one above both.

        Raises:
            NavError: for frames that are not connected.
        """
        target, source = target.lstrip("/"), source.lstrip("/")
        source_path, target_path = self._path(source), self._path(target)
        common = next((frame for frame in source_path if frame in target_path), None)
        if common is None:
            raise NavError(
                f"no transform between {source!r} and {target!r}: known are "
                f"{', '.join(f'{p} -> {c}' for c, p in self._parents.items()) or 'none'}"
            )
        source_end, target_end = source_path.index(common) + 1, target_path.index(common) + 1
        return source_path[:source_end], target_path[:target_end]

    def latest_s(self, target: str, source: str) -> float:
        """Return the newest stamp that all transforms between two frames have reached.

        It is infinite if all of them are static.

        Raises:
            NavError: for frames that are not connected.
        """
        children = [child for way in self.ways(target, source) for child in way[:-1]]
        moving = (child for child in children if child not in self._static)
        return min((self._histories[child][-1].stamp_s for child in moving), default=math.inf)

    def _path(self, frame: str) -> list[str]:
        """Return the frame and all its ancestors, up to the root."""
        path = [frame]
        while path[-1] in self._parents:
            path.append(self._parents[path[-1]])
        return path

    def above(self, frame: str) -> tuple[str, ...]:
        """Return a frame and all its ancestors, up to the root."""
        return tuple(self._path(frame.lstrip("/")))

    def _chain(self, children: list[str], stamp: float, rigid: bool) -> FloatArray:
        """Return the pose of the first child in the parent of the last."""
        T = np.eye(4)
        for child in children:
            T = self._at(child, stamp, rigid) @ T
        return T

    def _at(self, child: str, stamp: float, rigid: bool) -> FloatArray:
        """Return the pose of a frame in its parent."""
        history = self._histories[child]
        if child in self._static or (rigid and _is_constant(history, stamp)):
            return history[-1].T
        after = bisect_right(history, stamp, key=lambda entry: entry.stamp_s)
        if after == 0:
            raise NavError(
                f"transform of {child!r} is wanted at {stamp:.3f} s and known from "
                f"{history[0].stamp_s:.3f} s on"
            )
        before_s, before, motion = history[after - 1]
        since_s = stamp - before_s
        if after < len(history):
            later = history[after]
            step = np.linalg.inv(before) @ later.T
            return np.asarray(before @ _part(step, since_s / (later.stamp_s - before_s)))
        if since_s > HOLD_S:
            raise NavError(
                f"transform of {child!r} is wanted at {stamp:.3f} s and known until "
                f"{before_s:.3f} s (holds {HOLD_S:g} s longer)"
            )
        x_m, y_m, heading_rad, *_ = motion.at(since_s)
        return np.asarray(before @ pose_matrix(Point(x_m, y_m), yaw_quaternion(heading_rad)))


def _is_constant(history: list[_Sample], stamp_s: float) -> bool:
    """Return whether transforms have never changed and still come, or were sent only once."""
    last_s = history[-1].stamp_s
    if any(not np.array_equal(each.T, history[-1].T) for each in history):
        return False
    gaps = np.diff([each.stamp_s for each in history])
    return not len(gaps) or stamp_s - last_s <= max(HOLD_S, _PERIODS * float(gaps.max()))


def _part(step: FloatArray, share: float) -> FloatArray:
    """Return the part (4, 4) of a step that a body at constant velocity in itself has made.

    It moves along a screw, so that the part is the same from whichever frame it is looked at.
    """
    turn = Rotation.from_matrix(step[:3, :3]).as_rotvec()
    part = np.eye(4)
    part[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix()
    velocity = np.linalg.solve(_way(turn), step[:3, 3])
    part[:3, 3] = _way(share * turn) @ (share * velocity)
    return part


def _way(turn: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) from a velocity in a body to its way in a second of that turn."""
    x, y, z = turn.tolist()
    angle = math.hypot(x, y, z)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _STRAIGHT_RAD:
        return np.eye(3) + 0.5 * cross
    aside = 2.0 * math.sin(0.5 * angle) ** 2 / angle**2
    along = (angle - math.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + aside * cross + along * cross @ cross)
