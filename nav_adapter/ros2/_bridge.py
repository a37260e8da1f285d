"""The bridge from camera and odometry messages to constraints, without a transport."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from perception import AwarenessPipeline, Camera, FloorPlane, PerceptionError, PersonObservation
from perception.arrays import FloatArray
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig, TrackingError

from .._adapter import NavAdapter
from .._constraints import NavConstraints
from .._errors import NavError
from .._policy import AwarenessPolicy
from .._robot import RobotProfile, RobotState
from ._images import camera_of, picture_of
from ._outgoing import Frames, outgoing
from ._transforms import TransformBuffer
from .conversions import pose_matrix, to_seconds
from .messages import Message
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image
from .messages.tf2_msgs import TFMessage

# Tolerated difference between the clocks of the camera and of this computer.
_CLOCK_TOLERANCE_S = 0.05
# Uncertainty of the height and the tilt of a camera on a driving robot.
_HEIGHT_STD_M = 0.05
_TILT_STD_RAD = math.radians(2.0)
# No robot drives so fast: a higher speed is an error of the sender.
_FASTEST_MPS = 100.0


class AwarenessBridge:
    """Turns camera and odometry messages of a ROS graph into constraints for its planners.

    Pass on messages as they come (``on_…``) and call :meth:`tick` at a fixed rate, with or without
    new images: each tick publishes every topic. If input is missing, late or refused, the bridge
    publishes a stop with the reason. It never stops publishing by itself, and missing data never
    make a person count as aware.

    Args:
        policy: of the adapter and of the awareness filter.
        robot: the robot's profile.
        publish: called with the key of a topic and a message.
        frames: names of the frames.
        T_base_camera: pose of a fixed camera; None to look it up in tf.
        make_pipeline: makes perception for a camera, once it is known; by default with the shipped
            networks.
        camera: calibration; None to read it from camera_info.
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
        self._make_pipeline = make_pipeline
        self._percentage = percentage
        self._wanted = wanted
        self._warn_user, self._warned = warn, ""
        self._camera = camera
        self._pipeline = make_pipeline(camera) if camera is not None else None
        self._transforms = TransformBuffer()
        self._state: RobotState | None = None
        self._tracks: tuple[PersonTrack, ...] = ()
        self._perceived_s: float | None = None
        self._last_tick_s: float | None = None
        self._start_afresh()
        #: The latest frame, for drawing: image, observations and T_odom_camera.
        self.last_picture: NDArray[np.uint8] | None = None
        self.last_observations: tuple[PersonObservation, ...] = ()
        self.last_T_odom_camera: FloatArray | None = None

    @property
    def tracks(self) -> tuple[PersonTrack, ...]:
        """Tracks of the latest frame."""
        return self._tracks

    @property
    def robot_state(self) -> RobotState | None:
        """The latest state of the robot, or None."""
        return self._state

    @property
    def camera(self) -> Camera | None:
        """The camera, or None while it is unknown."""
        return self._camera

    def on_camera_info(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; later ones are ignored."""
        if self._camera is not None:
            return
        try:
            self._camera = camera_of(message)
            self._pipeline = self._make_pipeline(self._camera)
        except (NavError, PerceptionError) as problem:
            self._camera = None
            self._warn(str(problem))
            return
        self._start_afresh()

    def on_transforms(self, message: TFMessage, *, static: bool = False) -> None:
        """Store the transforms of /tf or /tf_static."""
        for each in message.transforms:
            self._store_transform(each, static)

    def on_odometry(self, message: Odometry) -> None:
        """Store the robot's state, and its pose as a transform."""
        if message.header.frame_id.lstrip("/") != self.frames.odom:
            self._warn(
                f"odometry must be in frame {self.frames.odom!r}, got "
                f"{message.header.frame_id!r}: ignored"
            )
            return
        position, rotation = message.pose.pose.position, message.pose.pose.orientation
        stamp_s = to_seconds(message.header.stamp)
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

    def on_image(self, message: Image | CompressedImage, now_s: float) -> bool:
        """Process one image; return True if it was used."""
        stamp_s = to_seconds(message.header.stamp)
        try:
            if self._pipeline is None:
                raise NavError("no camera_info yet: the image cannot be used")
            if stamp_s > now_s + _CLOCK_TOLERANCE_S:
                raise NavError(
                    f"the image's stamp is {stamp_s - now_s:.3f} s ahead of this computer's clock"
                )
            frame = self.frames.camera or message.header.frame_id
            T_odom_camera = self._camera_pose(frame, stamp_s)
            image = picture_of(message)
            observations = self._pipeline.process(image, stamp_s, floor=_floor(T_odom_camera))
            tracks = self._tracker.update(observations, stamp_s, T_odom_camera)
        except (NavError, PerceptionError, TrackingError) as problem:
            self._warn(f"image: {problem}")
            return False
        self._tracks, self._perceived_s = tracks, stamp_s
        self.last_picture, self.last_observations = image, observations
        self.last_T_odom_camera = T_odom_camera
        self._warned = ""
        return True

    def tick(self, now_s: float) -> NavConstraints:
        """Publish every topic at ``now_s`` and return the constraints."""
        if self._last_tick_s is not None and now_s < self._last_tick_s:
            self._warn("the clock went backward: all tracks are deleted")
            self._start_afresh()
            self._state = None
            self._transforms = TransformBuffer()
        self._last_tick_s = now_s
        constraints = self._constraints(now_s)
        for key, message in outgoing(
            constraints,
            self._tracks,
            self._robot,
            self._state,
            self.frames,
            percentage=self._percentage,
            wanted=self._wanted,
        ):
            self._publish(key, message)
        return constraints

    def refuse(self, problem: str) -> None:
        """Warn of a message that could not be decoded."""
        self._warn(problem)

    def stop(self, now_s: float, reason: str) -> NavConstraints:
        """Publish a stop, before the caller ends."""
        constraints = NavConstraints(now_s, (), 0.0, reason, True)
        for key, message in outgoing(
            constraints, (), self._robot, None, self.frames, percentage=self._percentage
        ):
            self._publish(key, message)
        return constraints

    def _constraints(self, now_s: float) -> NavConstraints:
        for needed, reason in (
            (self._state, "no odometry yet"),
            (self._pipeline, "no camera_info yet"),
            (self._perceived_s, "no camera frame yet"),
        ):
            if needed is None:
                return NavConstraints(now_s, (), 0.0, reason, True)
        assert self._state is not None
        try:
            return self._adapter.update(
                self._tracks, self._state, now_s, perception_stamp_s=self._perceived_s
            )
        except NavError as problem:
            self._warn(str(problem))
            return NavConstraints(now_s, (), 0.0, f"refused: {problem}", True)

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

    def _start_afresh(self) -> None:
        """Begin with a new tracker and a new adapter, without tracks."""
        view = None if self._camera is None else CameraView(self._camera)
        self._tracker = PersonTracker(TrackerConfig(awareness=self._policy.filter), view=view)
        self._adapter = NavAdapter(self._policy, self._robot)
        self._tracks = ()
        self._perceived_s = None
        self._last_tick_s = None

    def _warn(self, text: str) -> None:
        if text != self._warned:
            self._warned = text
            self._warn_user(text)


def _floor(T_odom_camera: FloatArray) -> FloorPlane | None:
    """Return the floor, z = 0 in odom, or None for a camera that is not above it."""
    if T_odom_camera[2, 3] <= 0.0:
        return None
    return FloorPlane.from_pose(
        T_odom_camera, height_std_m=_HEIGHT_STD_M, tilt_std_rad=_TILT_STD_RAD
    )
