"""The bridge from camera and odometry messages to constraints, without a transport."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from perception import AwarenessPipeline, Camera, PerceptionError
from perception.arrays import FloatArray
from tracking import PersonTrack, TrackerConfig, TrackingError

from .._adapter import NavAdapter
from .._constraints import NavConstraints
from .._errors import NavError
from .._policy import AwarenessPolicy
from .._robot import RobotProfile, RobotState
from ._clock import CLOCK_TOLERANCE_S, BridgeClock, InputKind
from ._image_perception import ImagePerception, PerceivedFrame
from ._outgoing import Frames, outgoing
from ._transforms import TransformBuffer
from .conversions import pose_matrix, to_seconds
from .messages import Message
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image
from .messages.tf2_msgs import TFMessage

_LOG = logging.getLogger("nav_adapter")

# No robot drives so fast: a higher speed is an error of the sender.
_FASTEST_MPS = 100.0


class AwarenessBridge:
    """Turns camera and odometry messages of a ROS graph into constraints for its planners.

    Pass on messages as they come (``on_…``) and call :meth:`tick` at a fixed rate, with or without
    new images: each tick publishes every topic. If input is missing, late or refused, the bridge
    publishes a stop with the reason. It never stops publishing by itself, and missing data never
    make a person count as aware.

    Perception may have a thread of its own, as :class:`PerceptionThread` gives it one: while
    :meth:`on_image` and :meth:`on_camera_info` run, :meth:`tick` and the other methods go on with
    the last frame's people, who grow older, as in :meth:`NavAdapter.watchdog`.

    Messages whose stamp lies more than 0.05 s ahead of ``now_s`` are refused and counted in
    :attr:`counts`. The clock of ``now_s`` may be stepped back: by up to 0.05 s, time stands still
    until it has caught up; by more, the robot stops, and if the clock goes on from there for 1 s,
    tracks and transforms are forgotten with a warning. Static transforms are always kept.

    Args:
        policy: of the adapter and of the awareness filter.
        robot: the robot's profile.
        publish: called with the key of a topic and a message.
        frames: names of the frames.
        T_base_camera: pose of a fixed camera; None to look it up in tf.
        make_pipeline: makes perception for a camera, once it is known; by default with the shipped
            networks.
        camera: calibration; None to read it from camera_info. With it, the pipeline is made here.
        percentage: as in :func:`speed_limit`.
        warn: called with each problem; a repeated text is passed on only once.
        wanted: called with the key of a topic in every tick; unwanted messages are not made.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        publish: Callable[[str, Message], None],
        *,
        frames: Frames | None = None,
        T_base_camera: FloatArray | None = None,
        make_pipeline: Callable[[Camera], AwarenessPipeline] = AwarenessPipeline,
        camera: Camera | None = None,
        percentage: bool = False,
        warn: Callable[[str], None] = lambda text: None,
        wanted: Callable[[str], bool] = lambda key: True,
    ) -> None:
        self.frames = frames or Frames()
        self._policy, self._robot, self._publish = policy, robot, publish
        self._T_base_camera = T_base_camera
        self._percentage = percentage
        self._wanted = wanted
        self._warn_user, self._warned = warn, ""
        self._ahead: set[InputKind] = set()
        self._perception = ImagePerception(
            make_pipeline, TrackerConfig(awareness=policy.filter), camera
        )
        self._adapter = NavAdapter(policy, robot)
        self._transforms = TransformBuffer()
        self._state: RobotState | None = None
        self._frame: PerceivedFrame | None = None
        self._clock = BridgeClock()
        self._frames = self._perception_failures = 0
        # For all of the above but the perception, which is not held up by it.
        self._lock = threading.RLock()
        # Keeps the messages of one publication together.
        self._sending = threading.Lock()

    @property
    def frame(self) -> PerceivedFrame | None:
        """The latest frame with its image, people and tracks, or None before the first."""
        return self._frame

    @property
    def tracks(self) -> tuple[PersonTrack, ...]:
        """Tracks of the latest frame."""
        frame = self._frame
        return () if frame is None else frame.tracks

    @property
    def counts(self) -> dict[str, int]:
        """Counts since the start, which are published with the alerts.

        ``frames`` that were processed; ``odometry_from_future``, ``transforms_from_future`` and
        ``images_from_future``, which were refused; ``perception_failures``: images that ended in an
        error of the program; ``clock_restarts``.
        """
        with self._lock:
            return {
                "frames": self._frames,
                **{f"{kind}_from_future": count for kind, count in self._clock.refused.items()},
                "perception_failures": self._perception_failures,
                "clock_restarts": self._clock.restarts,
            }

    @property
    def robot_state(self) -> RobotState | None:
        """The latest state of the robot, or None."""
        return self._state

    @property
    def camera(self) -> Camera | None:
        """The camera, or None while it is unknown."""
        return self._perception.camera

    def on_camera_info(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; later ones are ignored."""
        try:
            self._perception.calibrate(message)
        except (NavError, PerceptionError) as problem:
            self._warn(str(problem))

    def on_transforms(
        self, message: TFMessage, now_s: float | None = None, *, static: bool = False
    ) -> None:
        """Store the transforms of /tf or /tf_static.

        Args:
            message: the transforms.
            now_s: the present time; None to check the stamps in the next :meth:`tick` only.
            static: whether they hold at all times; their stamps are then not looked at.
        """
        with self._lock:
            for each in message.transforms:
                if static or not self._is_future_transform(each, now_s):
                    self._store_transform(each, static)

    def on_odometry(self, message: Odometry, now_s: float | None = None) -> None:
        """Store the robot's state, and its pose as a transform.

        Args:
            message: in the odom frame.
            now_s: the present time; None to check the stamp in the next :meth:`tick` only.
        """
        with self._lock:
            self._store_odometry(message, now_s)

    def on_image(self, message: Image | CompressedImage, now_s: float) -> bool:
        """Process one image; return True if it was used."""
        stamp_s = to_seconds(message.header.stamp)
        try:
            with self._lock:
                if self._perception.camera is None:
                    raise NavError("no camera_info yet: the image cannot be used")
                refusal = self._clock.refusal("images", stamp_s, now_s)
                if refusal is not None:
                    raise NavError(f"the image's {refusal}")
                restarts = self._clock.restarts
                T_odom_camera = self._camera_pose(
                    self.frames.camera or message.header.frame_id, stamp_s
                )
            frame = self._perception.process(
                message, stamp_s, T_odom_camera, lambda: self._clock.restarts == restarts
            )
        except (NavError, PerceptionError, TrackingError) as problem:
            self._warn(f"image: {problem}")
            return False
        with self._lock:
            if frame is None or self._clock.restarts != restarts:
                return False
            self._frame = frame
            self._frames += 1
            self._warned = ""
        return True

    def tick(self, now_s: float) -> NavConstraints:
        """Publish every topic at ``now_s`` and return the constraints."""
        with self._sending:
            with self._lock:
                restarts = self._clock.restarts
                time_s = self._clock.advance(now_s)
                if self._clock.restarts != restarts:
                    self._restart()
                if time_s is None:
                    constraints = _stopped(now_s, "the clock went backward")
                else:
                    self._drop_future(time_s)
                    constraints = self._constraints(time_s)
                tracks, state = self.tracks, self._state
                details = {name: str(count) for name, count in self.counts.items()}
                if self._frame is not None:
                    details["frame_age_s"] = f"{constraints.stamp_s - self._frame.stamp_s:.3f}"
            self._send(constraints, tracks, state, details, self._wanted)
        return constraints

    def refuse(self, problem: str) -> None:
        """Warn of a message that could not be decoded."""
        self._warn(problem)

    def perception_failed(self, problem: Exception) -> None:
        """Count and report an error of the program in :meth:`on_image` or :meth:`on_camera_info`.

        The first one of a kind is logged with its traceback.
        """
        with self._lock:
            self._perception_failures += 1
        if self._warn(f"perception failed: {type(problem).__name__}: {problem}"):
            _LOG.error("perception failed", exc_info=problem)

    def stop(self, now_s: float, reason: str) -> NavConstraints:
        """Publish a stop, before the caller ends."""
        constraints = _stopped(now_s, reason)
        with self._sending:
            self._send(constraints, (), None, {}, lambda key: True)
        return constraints

    def _store_odometry(self, message: Odometry, now_s: float | None) -> None:
        if message.header.frame_id.lstrip("/") != self.frames.odom:
            self._warn(
                f"odometry must be in frame {self.frames.odom!r}, got "
                f"{message.header.frame_id!r}: ignored"
            )
            return
        position, rotation = message.pose.pose.position, message.pose.pose.orientation
        stamp_s = to_seconds(message.header.stamp)
        if self._is_future("odometry", stamp_s, now_s):
            return
        try:
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
            child = message.child_frame_id or self.frames.base
            self._transforms.add(self.frames.odom, child, stamp_s, T)
        except NavError as problem:
            self._warn(f"odometry: {problem}")
            return
        if self._state is None or stamp_s >= self._state.stamp_s:
            self._state = state

    def _constraints(self, now_s: float) -> NavConstraints:
        state, frame = self._state, self._frame
        if state is None:
            return _stopped(now_s, "no odometry yet")
        if self._perception.camera is None:
            return _stopped(now_s, "no camera_info yet")
        if frame is None:
            return _stopped(now_s, "no camera frame yet")
        try:
            return self._adapter.update(
                frame.tracks, state, now_s, perception_stamp_s=frame.stamp_s
            )
        except NavError as problem:
            self._warn(str(problem))
            reason = f"refused: {problem}"
        except Exception as problem:
            # Publishing must go on, whatever is wrong with these data.
            reason = f"the adapter failed: {type(problem).__name__}: {problem}"
            if self._warn(reason):
                _LOG.error("the adapter failed", exc_info=problem)
        try:
            # A stop that keeps the people of the last good data, grown older.
            older = self._adapter.watchdog(now_s)
        except Exception:
            return _stopped(now_s, reason)
        return replace(
            older,
            speed_limit_mps=0.0,
            reachable_speed_limit_mps=0.0,
            limited_by=reason,
            stale=True,
        )

    def _send(
        self,
        constraints: NavConstraints,
        tracks: tuple[PersonTrack, ...],
        state: RobotState | None,
        details: dict[str, str],
        wanted: Callable[[str], bool],
    ) -> None:
        for key, message in outgoing(
            constraints,
            tracks,
            self._robot,
            state,
            self.frames,
            percentage=self._percentage,
            wanted=wanted,
            details=details,
        ):
            self._publish(key, message)

    def _is_future(self, kind: InputKind, stamp_s: float, now_s: float | None) -> bool:
        """Return whether a message is from the future; it is then counted."""
        refusal = None if now_s is None else self._clock.refusal(kind, stamp_s, now_s)
        # A sender that is always ahead must not flood the terminal: the diagnostics have the count.
        if refusal is not None and kind not in self._ahead:
            self._ahead.add(kind)
            self._warn(f"{kind}: the {refusal}: refused and counted, without further warnings")
        return refusal is not None

    def _is_future_transform(self, message: TransformStamped, now_s: float | None) -> bool:
        stamp_s = to_seconds(message.header.stamp)
        if message.child_frame_id.lstrip("/") == self.frames.odom and now_s is not None:
            # Localisation stamps map -> odom ahead on purpose, and it is not needed here.
            return stamp_s > self._clock.read(now_s) + CLOCK_TOLERANCE_S
        return self._is_future("transforms", stamp_s, now_s)

    def _drop_future(self, now_s: float) -> None:
        """Forget what is from the future and would shut out good messages until then."""
        state = self._state
        if state is not None and self._is_future("odometry", state.stamp_s, now_s):
            self._state = None
        self._transforms.forget(after_s=now_s + CLOCK_TOLERANCE_S)

    def _restart(self) -> None:
        """Forget all that has a stamp of the clock before it was set."""
        self._adapter = NavAdapter(self._policy, self._robot)
        self._perception.forget_tracks()
        self._frame, self._state = None, None
        self._transforms.forget()
        self._ahead.clear()
        self._warn("the clock has been set back: all tracks and moving transforms are deleted")

    def _camera_pose(self, frame: str, stamp_s: float) -> FloatArray:
        if self._T_base_camera is None:
            return self._transforms.lookup(self.frames.odom, frame, stamp_s)
        T_odom_base = self._transforms.lookup(self.frames.odom, self.frames.base, stamp_s)
        return np.asarray(T_odom_base @ self._T_base_camera, dtype=np.float64)

    def _store_transform(self, message: TransformStamped, static: bool) -> None:
        translation, rotation = message.transform.translation, message.transform.rotation
        try:
            self._transforms.add(
                message.header.frame_id,
                message.child_frame_id,
                to_seconds(message.header.stamp),
                pose_matrix((translation.x, translation.y, translation.z), rotation),
                static=static,
            )
        except NavError as problem:
            self._warn(f"tf: {problem}")

    def _warn(self, text: str) -> bool:
        """Pass on a problem; return False for the one that was passed on last."""
        with self._lock:
            if text == self._warned:
                return False
            self._warned = text
        self._warn_user(text)
        return True


def _stopped(now_s: float, reason: str) -> NavConstraints:
    return NavConstraints(now_s, (), 0.0, reason, True)
