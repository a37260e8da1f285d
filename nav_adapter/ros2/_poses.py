"""Poses of the robot and its sensors: odometry, tf and fixed mounts."""

from __future__ import annotations

import math

import numpy as np

from perception.arrays import FloatArray
from perception.laser import RobotMotion

from .._errors import NavError
from .._robot import RobotState
from ._optical import optical_problem
from ._outgoing import Frames
from ._transforms import TransformBuffer
from .conversions import pose_matrix, to_seconds
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry

# No robot drives so fast: a higher speed is an error of the sender.
_FASTEST_MPS = 100.0


class RobotPoses:
    """The poses of robot and sensors over the last seconds. One thread at a time may use it.

    Args:
        frames: names of the frames.
        T_base_camera: (4, 4) pose of a fixed camera; None to look it up in tf.

    Attributes:
        transforms: from tf and odometry.
        state: the latest state of the robot, or None.
    """

    def __init__(self, frames: Frames, T_base_camera: FloatArray | None) -> None:
        self._frames, self._T_base_camera = frames, T_base_camera
        self.transforms = TransformBuffer()
        self.state: RobotState | None = None

    def add_transform(self, message: TransformStamped, *, static: bool) -> None:
        """Store a transform.

        Raises:
            NavError: for a pose or a stamp that cannot be used.
        """
        translation, rotation = message.transform.translation, message.transform.rotation
        self.transforms.add(
            message.header.frame_id,
            message.child_frame_id,
            to_seconds(message.header.stamp),
            pose_matrix((translation.x, translation.y, translation.z), rotation),
            static=static,
        )

    def add_odometry(self, message: Odometry) -> None:
        """Store the robot's state, unless a newer one is known, and its pose as a transform.

        Raises:
            NavError: for numbers that cannot be used.
        """
        position, rotation = message.pose.pose.position, message.pose.pose.orientation
        stamp_s = to_seconds(message.header.stamp)
        T = pose_matrix((position.x, position.y, position.z), rotation)
        linear = message.twist.twist.linear
        speed_mps = math.hypot(linear.x, linear.y)
        # Written so that NaN is refused too.
        if not speed_mps <= _FASTEST_MPS:
            raise NavError(f"speed_mps must be within {_FASTEST_MPS:g} m/s, got {speed_mps:g}")
        state = RobotState(
            stamp_s,
            T[:2, 3],
            math.atan2(T[1, 0], T[0, 0]),
            linear.x,
            message.twist.twist.angular.z,
            np.array([linear.x, linear.y]),
        )
        child = message.child_frame_id or self._frames.base
        self.transforms.add(self._frames.odom, child, stamp_s, T)
        if self.state is None or stamp_s >= self.state.stamp_s:
            self.state = state

    def forget(self) -> None:
        """Forget the state and all transforms but the static ones."""
        self.state = None
        self.transforms.forget()

    def T_odom_camera(self, frame: str, stamp_s: float) -> FloatArray:  # noqa: N802 - frames in names
        """Return the pose (4, 4) of the camera.

        Args:
            frame: of the image; not used if the camera's frame has a name in ``frames``, or its
                pose is fixed.
            stamp_s: of the image.

        Raises:
            NavError: for a pose that is not known at that time, or not of an optical frame.
        """
        frames = self._frames
        if self._T_base_camera is None:
            frame = frames.camera or frame
            T_odom_camera = self.transforms.lookup(frames.odom, frame, stamp_s)
            if problem := optical_problem(T_odom_camera, frame, frames.odom):
                raise NavError(f"{problem}, or the bridge's camera frame must be it")
            return T_odom_camera
        T_odom_base = self.transforms.lookup(frames.odom, frames.base, stamp_s)
        return np.asarray(T_odom_base @ self._T_base_camera, dtype=np.float64)

    def in_base(self, frame: str, stamp_s: float) -> FloatArray:
        """Return the pose (4, 4) of a frame of the robot in the base frame.

        Raises:
            NavError: for a pose that is not known at that time.
        """
        return self.transforms.lookup(self._frames.base, frame, stamp_s)

    def camera_in_base(self, frame: str, stamp_s: float) -> FloatArray | None:
        """Return the pose (4, 4) of the camera in the base frame; None if it is not known."""
        if self._T_base_camera is not None:
            return self._T_base_camera
        try:
            return self.in_base(self._frames.camera or frame, stamp_s)
        except NavError:
            return None

    def motion(self, start_s: float, end_s: float) -> RobotMotion:
        """Return the robot's motion from one time to a later one, of a scan's first and last ray.

        Where the odometry ends before that, the robot goes on at its speed.

        Raises:
            NavError: for poses that are not known, or end too long before.
        """
        state, frames = self.state, self._frames
        if state is None:
            raise NavError("no odometry yet: the pose of the robot is unknown")
        velocity_mps = np.array([state.speed_mps, state.lateral_mps])
        T_end = self.transforms.lookup(frames.odom, frames.base, end_s)
        if end_s > state.stamp_s:
            pose_s = state.stamp_s
            T = self.transforms.lookup(frames.odom, frames.base, pose_s)
            return RobotMotion(pose_s, T, velocity_mps, state.yaw_rate_radps)
        if end_s <= start_s:
            return RobotMotion(end_s, T_end, velocity_mps, state.yaw_rate_radps)
        T_start = self.transforms.lookup(frames.odom, frames.base, start_s)
        return RobotMotion.between(start_s, T_start, end_s, T_end)
