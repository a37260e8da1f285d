"""Poses of the robot and its sensors: odometry, tf and fixed mounts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Final, Literal, NamedTuple

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray
from perception.laser import RobotMotion

from .._errors import NavError
from .._robot import RobotState
from ..rigid import Motion
from ._clock import CLOCK_TOLERANCE_S, BridgeClock, InputKind
from ._odometry_check import OdometryCheck
from ._outgoing import Frames
from ._transforms import TransformBuffer
from .conversions import header, pose_matrix, to_seconds
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry
from .messages.tf2_msgs import TFMessage

# No robot drives or turns so fast: more is an error of the sender.
_FASTEST_MPS: Final = 100.0
_FASTEST_RADPS: Final = 100.0
# After the newest odometry a robot keeps its velocity and its yaw rate but for this share, by which
# wheels slip, and these standard deviations of their change.
_RATE_SHARE: Final = 0.1
_CHANGE_MPS2: Final = 1.0
_CHANGE_RADPS2: Final = 2.0
# A camera on a robot that looks for people never looks further up.
_STEEPEST_RAD: Final = math.radians(60.0)
# A body frame (x ahead, y left, z up) that is tilted down looks like an optical one that is rolled
# by a quarter turn and looks up. No camera that is mounted so looks further up than this.
_STEEPEST_ROLLED_RAD: Final = math.radians(30.0)


class PoseSpread(NamedTuple):
    """Standard deviations of a robot's pose: of its place, to all sides, and of its heading."""

    place_m: float = 0.0
    heading_rad: float = 0.0

    def widened(
        self, observations: Iterable[PersonObservation], T_odom_sensor: FloatArray
    ) -> tuple[PersonObservation, ...]:
        """Return the observations of a sensor on the robot with its pose's error in their places.

        An error of the heading moves people aside, the more the farther away they are.
        """
        if not any(self):
            return tuple(observations)
        up = T_odom_sensor[2, :3]
        level = self.place_m**2 * (np.eye(3) - np.outer(up, up))
        widened = []
        for each in observations:
            aside = self.heading_rad * np.cross(up, each.position_camera_m)
            covariance = each.position_covariance_m2 + level + np.outer(aside, aside)
            widened.append(replace(each, position_covariance_m2=covariance))
        return tuple(widened)


class RobotPoses:
    """The poses of robot and sensors over the last seconds, from odometry, tf and fixed mounts.

    One thread at a time may use it. Without ``T_base_camera`` (4, 4) of a fixed camera, tf has it.
    ``with_map`` says whether the pose of odom in a map is needed. Localisation stamps it ahead on
    purpose; the latest one then holds until the next.

    Attributes:
        transforms: from tf.
        state: the latest state of the robot, or None.
        problem: why the odometry cannot be trusted; empty if nothing is wrong with it.
    """

    def __init__(
        self,
        frames: Frames,
        T_base_camera: FloatArray | None,
        clock: BridgeClock,
        warn: Callable[[str], object],
        *,
        with_map: bool,
    ) -> None:
        self._frames, self._T_base_camera = frames, T_base_camera
        self._clock, self._warn, self._with_map = clock, warn, with_map
        # Kinds of messages from the future that have been reported.
        self._ahead: set[InputKind | Literal["mounts"]] = set()
        self.transforms = TransformBuffer()
        # Apart from tf, which may have a pose of the robot too: two sources in one history would
        # be one robot that jumps.
        self._odometry = TransformBuffer()
        self._check = OdometryCheck(frames)
        self.state: RobotState | None = None
        self.problem = ""

    def read_transforms(
        self, message: TFMessage, now_s: float | None, *, static: bool = False
    ) -> None:
        """Store the transforms of /tf or /tf_static, as the bridge does; None checks no stamps."""
        for each in message.transforms:
            to_odom = each.child_frame_id.lstrip("/") == self._frames.odom
            timeless = static or (to_odom and self._with_map)
            mount = not timeless and self._rides(each)
            if mount:
                each = self._not_ahead(each, now_s)  # noqa: PLW2901
            elif not timeless and self._is_future_transform(each, now_s):
                continue
            try:
                self.transforms.add_message(each, static=timeless)
            except NavError as problem:
                self._warn(f"tf: {problem}")

    def read_odometry(self, message: Odometry, now_s: float | None) -> None:
        """Store the robot's state and pose in the odom frame; None checks no stamp."""
        if message.header.frame_id.lstrip("/") != self._frames.odom:
            self._warn(
                f"odometry must be in frame {self._frames.odom!r}, got "
                f"{message.header.frame_id!r}: ignored"
            )
            return
        if self._is_future("odometry", to_seconds(message.header.stamp), now_s):
            return
        before = self.problem
        try:
            self._add_odometry(message)
            problem = self.problem
        except NavError as refused:
            problem = str(refused)
        if problem and problem != before:
            self._warn(f"odometry: {problem}")

    def drop_future(self, now_s: float) -> None:
        """Forget what is from the future and would shut out good messages until then."""
        state = self.state
        if state is not None and self._is_future("odometry", state.stamp_s, now_s):
            self.state = None
        self.transforms.forget(after_s=now_s + CLOCK_TOLERANCE_S)
        self._odometry.forget(after_s=now_s + CLOCK_TOLERANCE_S)

    def forget(self) -> None:
        """Forget the state, all transforms but the static ones, and which problems were told."""
        self.state, self.problem = None, ""
        self._ahead.clear()
        self.transforms.forget()
        self._odometry.forget()
        self._check = OdometryCheck(self._frames)

    def T_odom_camera(self, frame: str, stamp_s: float) -> FloatArray:  # noqa: N802 - frames in names
        """Return the pose (4, 4) of the camera at the time of an image.

        The image's ``frame`` is not used if the camera's has a name in ``frames``, or a fixed pose.

        Raises:
            NavError: for a pose that is not known at that time, or not of an optical frame.
        """
        T_base_camera = self._T_base_camera
        if in_odom := self._frame_in_odom(frame):
            T_odom_camera = self.transforms.lookup(self._frames.odom, in_odom, stamp_s)
            return _optical(T_odom_camera, in_odom, self._frames.odom)
        if T_base_camera is None:
            frame = self._frames.camera or frame
            T_base_camera = _optical(self.in_base(frame, stamp_s), frame, self._frames.base)
        return np.asarray(self._T_odom_base(stamp_s) @ T_base_camera, dtype=np.float64)

    def in_base(self, frame: str, stamp_s: float) -> FloatArray:
        """Return the pose (4, 4) of a frame of the robot, or of odom, in the base frame.

        Raises:
            NavError: for a pose that is not known at that time.
        """
        if frame.lstrip("/") == self._frames.odom.lstrip("/"):
            return np.asarray(np.linalg.inv(self._T_odom_base(stamp_s)), dtype=np.float64)
        rigid = self._is_on_robot(frame)
        return self.transforms.lookup(self._frames.base, frame, stamp_s, rigid=rigid)

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
        state = self.state
        if state is None:
            raise NavError("no odometry yet: the pose of the robot is unknown")
        # Raises where the odometry ends too long before, also for a scan after its end.
        T_end = self._T_odom_base(end_s)
        if start_s < end_s <= state.stamp_s:
            return RobotMotion.between(start_s, self._T_odom_base(start_s), end_s, T_end)
        at_s = min(end_s, state.stamp_s)
        velocity_mps = np.array([state.speed_mps, state.lateral_mps])
        return RobotMotion(at_s, self._T_odom_base(at_s), velocity_mps, state.yaw_rate_radps)

    def spread(self, stamp_s: float, camera: str | None = None) -> PoseSpread:
        """Return the error of the pose of the robot, or of its camera, at a time.

        There is none up to the newest odometry. A camera whose pose in odom comes from tf is held
        where it was, so that the whole motion since then is its error. ``camera`` is the frame of
        the images; None is for the robot's own pose.
        """
        state, share = self.state, _RATE_SHARE
        if state is None:
            return PoseSpread()
        after_s = stamp_s - state.stamp_s
        if camera is not None and (frame := self._frame_in_odom(camera)):
            after_s, share = stamp_s - self.transforms.latest_s(self._frames.odom, frame), 1.0
        if after_s <= 0.0:
            return PoseSpread()
        return PoseSpread(
            after_s * (share * state.travel_mps + 0.5 * after_s * _CHANGE_MPS2),
            after_s * (share * abs(state.yaw_rate_radps) + 0.5 * after_s * _CHANGE_RADPS2),
        )

    def _frame_in_odom(self, camera: str) -> str:
        """Return the frame of a camera whose pose in odom tf has; empty for one on the robot."""
        frame = self._frames.camera or camera
        return "" if self._T_base_camera is not None or self._is_on_robot(frame) else frame

    def _is_future(self, kind: InputKind, stamp_s: float, now_s: float | None) -> bool:
        """Return whether a message is from the future; it is then counted."""
        refusal = None if now_s is None else self._clock.refusal(kind, stamp_s, now_s)
        # A sender that is always ahead must not flood the terminal: the diagnostics have the count.
        if refusal is not None and kind not in self._ahead:
            self._ahead.add(kind)
            self._warn(f"{kind}: the {refusal}: refused and counted, without further warnings")
        return refusal is not None

    def _rides(self, message: TransformStamped) -> bool:
        """Return whether a transform is between two frames of the robot, or may be."""
        odom, base = self._frames.odom.lstrip("/"), self._frames.base.lstrip("/")
        parent = message.header.frame_id.lstrip("/")
        above, over_base = self.transforms.above(parent), self.transforms.above(base)
        on_robot = {*itertools.takewhile(lambda frame: frame != odom, over_base)}
        known = on_robot.isdisjoint(above) and odom in above
        return message.child_frame_id.lstrip("/") != odom and not known

    def _not_ahead(self, message: TransformStamped, now_s: float | None) -> TransformStamped:
        """Return a mount with the present time if its sender stamps it ahead, as ROS 1 does."""
        if now_s is None or to_seconds(message.header.stamp) - now_s <= CLOCK_TOLERANCE_S:
            return message
        if "mounts" not in self._ahead:
            self._ahead.add("mounts")
            ahead_s = to_seconds(message.header.stamp) - now_s
            self._warn(
                f"transforms: {message.header.frame_id!r} -> {message.child_frame_id!r} is stamped "
                f"{ahead_s:.3f} s ahead, as static_transform_publisher of ROS 1 does: between "
                "frames of the robot, the present time is taken"
            )
        return replace(message, header=header(now_s, message.header.frame_id))

    def _is_future_transform(self, message: TransformStamped, now_s: float | None) -> bool:
        stamp_s = to_seconds(message.header.stamp)
        if message.child_frame_id.lstrip("/") == self._frames.odom and now_s is not None:
            # Localisation stamps map -> odom ahead on purpose, and it is not needed here.
            return stamp_s > self._clock.read(now_s) + CLOCK_TOLERANCE_S
        return self._is_future("transforms", stamp_s, now_s)

    def _add_odometry(self, message: Odometry) -> None:
        """Store the robot's state, unless a newer one is known, and its pose.

        Pose and twist of another frame on the robot are moved to the base frame. The place of that
        frame comes from tf, and never by way of odom, where it would be somebody else's odometry.

        Raises:
            NavError: for numbers that cannot be used, and for a child frame whose place on the
                robot is unknown.
        """
        base = self._frames.base.lstrip("/")
        child = message.child_frame_id.lstrip("/") or base
        stamp_s = to_seconds(message.header.stamp)
        T_odom_child = pose_matrix(message.pose.pose.position, message.pose.pose.orientation)
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        velocity, turning = np.array([linear.x, linear.y, 0.0]), np.array([0.0, 0.0, angular.z])
        if child != base:
            velocity[2], turning[:2] = linear.z, (angular.x, angular.y)
        for name, value, most, unit in (
            ("speed_mps", math.hypot(*velocity), _FASTEST_MPS, "m/s"),
            ("yaw_rate_radps", math.hypot(*turning), _FASTEST_RADPS, "rad/s"),
        ):
            # Written so that NaN is refused too.
            if not value <= most:
                raise NavError(f"{name} must be within {most:g} {unit}, got {value:g}")
        T_child_base = np.eye(4) if child == base else self._base_in(child, stamp_s)
        T_odom_base = T_odom_child @ T_child_base
        arm = T_child_base[:3, 3]
        velocity_base = T_child_base[:3, :3].T @ (velocity + np.cross(turning, arm))
        turning_base = T_child_base[:3, :3].T @ turning
        state = RobotState(
            stamp_s,
            T_odom_base[:2, 3],
            math.atan2(T_odom_base[1, 0], T_odom_base[0, 0]),
            velocity_base[0],
            turning_base[2],
            velocity_base[:2],
        )
        motion = Motion(0.0, 0.0, 0.0, state.speed_mps, state.lateral_mps, state.yaw_rate_radps)
        self._odometry.add(self._frames.odom, base, stamp_s, T_odom_base, motion=motion)
        if self.state is None or stamp_s >= self.state.stamp_s:
            self.state = state
            self._check.add(stamp_s, T_odom_child, velocity, turning, child)
            self._check.compare(self._odometry, self.transforms, state)
            self.problem = self._check.problem

    def _base_in(self, child: str, stamp_s: float) -> FloatArray:
        """Return the pose (4, 4) of the base frame in another frame of the robot."""
        base = self._frames.base
        if not self._is_on_robot(child):
            self.problem = (
                f"the odometry is that of {child!r}, and tf does not tell where it is on {base!r}: "
                "publish the static transform between them, or, if both are one place, set the "
                f"base frame to {child!r} (--base-frame, base_frame)"
            )
            raise NavError(self.problem)
        return self.transforms.lookup(child, base, stamp_s, rigid=True)

    def _is_on_robot(self, frame: str) -> bool:
        """Return whether tf knows the frame beside the base frame, and not by way of odom."""
        try:
            ways = self.transforms.ways(self._frames.base, frame)
        except NavError:
            return False
        return not any(self._frames.odom.lstrip("/") in way for way in ways)

    def _T_odom_base(self, stamp_s: float) -> FloatArray:  # noqa: N802 - frames in names
        return self._odometry.lookup(self._frames.odom, self._frames.base, stamp_s)


def _optical(T: FloatArray, frame: str, level_frame: str) -> FloatArray:
    """Return the pose (4, 4) of a camera in a level frame.

    Raises:
        NavError: for one that is not of an optical frame.
    """
    if problem := optical_problem(T, frame, level_frame):
        raise NavError(f"{problem}, or the bridge's camera frame must be it")
    return T


def optical_problem(T_level_camera: FloatArray, frame: str, level_frame: str) -> str:
    """Return why a frame cannot be the optical frame of images; empty if it can.

    Cameras that are upside down or rolled are in order: perception turns their pictures.

    Args:
        T_level_camera: (4, 4) pose of the frame in one whose z axis points up.
        frame: its name.
        level_frame: name of the other frame.
    """
    right, down, ahead = T_level_camera[2, :3].tolist()
    up_rad = math.asin(max(-1.0, min(1.0, ahead)))
    highest_rad = _STEEPEST_ROLLED_RAD if abs(down) <= abs(right) else _STEEPEST_RAD
    # A camera may look straight down, if at least the name is right.
    lowest_rad = -math.pi if "optical" in frame.lower() else -_STEEPEST_RAD
    if lowest_rad <= up_rad <= highest_rad:
        return ""
    where = "up" if up_rad > 0.0 else "down"
    optical = f"{frame.removesuffix('_link').removesuffix('_frame')}_optical_frame"
    return (
        f"the frame {frame!r} of the images is not an optical frame: its z axis, the view, points "
        f"{abs(math.degrees(up_rad)):.0f} degrees {where} in {level_frame!r}; the driver must name "
        f"the frame with z ahead, x right and y down, often {optical!r}"
    )


def odometry_problems(
    odometry: Iterable[Odometry],
    transforms: Iterable[TFMessage] = (),
    static_transforms: Iterable[TFMessage] = (),
    *,
    frames: Frames | None = None,
) -> tuple[str, ...]:
    """Return in words what the bridge would find wrong with a recording's odometry and tf.

    For example that they contradict each other, or that the odometry is in another frame.

    Args:
        odometry: all messages of its topic.
        transforms: all messages of /tf.
        static_transforms: all messages of /tf_static.
        frames: names of the frames.

    Returns:
        Each problem once, in the order of their first sight; none if nothing is wrong.
    """
    named = frames or Frames()
    problems: dict[str, None] = {}
    poses = RobotPoses(named, None, BridgeClock(), problems.setdefault, with_map=False)
    for message in static_transforms:
        poses.read_transforms(message, None, static=True)
    moving = [
        (to_seconds(each.header.stamp), 0, partial(poses.read_transforms, TFMessage((each,))))
        for message in transforms
        for each in message.transforms
    ]
    driven = [
        (to_seconds(each.header.stamp), 1, partial(poses.read_odometry, each)) for each in odometry
    ]
    for _, _, read in sorted([*moving, *driven], key=lambda entry: entry[:2]):
        read(None)
    return tuple(problems)
