"""The bridge without a transport: messages in, messages out."""

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
from ._outgoing import Frames, outgoing
from ._pictures import camera_of, picture_of
from ._stamps import pose_matrix, to_seconds
from ._transforms import TransformBuffer
from .messages import Message
from .messages.geometry_msgs import TransformStamped
from .messages.nav_msgs import Odometry
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image
from .messages.tf2_msgs import TFMessage

_CLOCK_TOLERANCE_S = 0.05
# How well the height and the tilt of a camera on a driving robot are known.
_HEIGHT_STD_M = 0.05
_TILT_STD_RAD = math.radians(2.0)
# No robot of this library drives so fast: such a number is a fault of the sender.
_FASTEST_MPS = 100.0


class AwarenessBridge:
    """Camera and odometry of a ROS graph to constraints for its planners.

    Feed it messages as they come (``on_…``) and call :meth:`tick` at a fixed rate, images or none:
    each tick publishes every topic. Whatever is missing, late or refused makes it publish a stop
    and the reason; it never falls silent by itself and never counts anybody as aware for want of
    data.

    Args:
        policy: of the adapter and of the awareness filter.
        robot: its profile.
        publish: called with the key of a topic and a message.
        frames: names of the frames.
        T_base_camera: where a fixed camera sits; None asks tf.
        make_pipeline: makes perception for a camera, once it is known; default the shipped
            networks.
        camera: calibration, if it is not to come from camera_info.
        percentage: of :func:`speed_limit`.
        warn: called with what went wrong, each text once in a row.
        wanted: asked with the key of a topic in every tick; what nobody wants is not made.
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
        self._seen_s: float | None = None
        self._ticked_s: float | None = None
        self._forget()
        #: The latest frame for whoever draws: picture, observations, T_odom_camera.
        self.last_picture: NDArray[np.uint8] | None = None
        self.last_observations: tuple[PersonObservation, ...] = ()
        self.last_T_odom_camera: FloatArray | None = None

    @property
    def tracks(self) -> tuple[PersonTrack, ...]:
        """Of the latest frame."""
        return self._tracks

    @property
    def robot_state(self) -> RobotState | None:
        """The latest."""
        return self._state

    @property
    def camera(self) -> Camera | None:
        """As far as it is known."""
        return self._camera

    def on_camera_info(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; a later, other one is refused."""
        if self._camera is not None:
            return
        try:
            self._camera = camera_of(message)
            self._pipeline = self._make_pipeline(self._camera)
        except (NavError, PerceptionError) as problem:
            self._camera = None
            self._warn(str(problem))
            return
        self._forget()

    def on_transforms(self, message: TFMessage, *, static: bool = False) -> None:
        """Remember transforms of /tf or /tf_static."""
        for each in message.transforms:
            self._remember(each, static)

    def on_odometry(self, message: Odometry) -> None:
        """Take the robot's state, and its pose as a transform."""
        if message.header.frame_id.lstrip("/") != self.frames.odom:
            self._warn(
                f"odometry must be in frame {self.frames.odom!r}, got "
                f"{message.header.frame_id!r}: ignored"
            )
            return
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        stamp_s = to_seconds(message.header.stamp)
        try:
            T = pose_matrix((place.x, place.y, place.z), turn)
            speed_mps = message.twist.twist.linear.x
            if abs(speed_mps) > _FASTEST_MPS:
                raise NavError(f"speed must be within {_FASTEST_MPS:g} m/s, got {speed_mps:g} m/s")
            state = RobotState(
                stamp_s,
                T[:2, 3],
                math.atan2(T[1, 0], T[0, 0]),
                speed_mps,
                message.twist.twist.angular.z,
            )
            child = message.child_frame_id or self.frames.base
            self._transforms.add(self.frames.odom, child, stamp_s, T)
        except NavError as problem:
            self._warn(f"odometry: {problem}")
            return
        if self._state is None or stamp_s >= self._state.stamp_s:
            self._state = state

    def on_image(self, message: Image | CompressedImage, now_s: float) -> bool:
        """Work one frame through; True when it was good."""
        stamp_s = to_seconds(message.header.stamp)
        try:
            if self._pipeline is None:
                raise NavError("no camera_info yet: the image cannot be used")
            if stamp_s > now_s + _CLOCK_TOLERANCE_S:
                raise NavError(
                    f"the image's stamp is {stamp_s - now_s:.3f} s ahead of this machine's clock"
                )
            frame = self.frames.camera or message.header.frame_id
            T_odom_camera = self._camera_pose(frame, stamp_s)
            image = picture_of(message)
            observations = self._pipeline.process(image, stamp_s, floor=_floor(T_odom_camera))
            tracks = self._tracker.update(observations, stamp_s, T_odom_camera)
        except (NavError, PerceptionError, TrackingError) as problem:
            self._warn(f"image: {problem}")
            return False
        self._tracks, self._seen_s = tracks, stamp_s
        self.last_picture, self.last_observations = image, observations
        self.last_T_odom_camera = T_odom_camera
        self._warned = ""
        return True

    def tick(self, now_s: float) -> NavConstraints:
        """Publish every topic for the instant ``now_s`` and return what was published."""
        if self._ticked_s is not None and now_s < self._ticked_s:
            self._warn("the clock went backward: everybody is forgotten")
            self._forget()
            self._state = None
            self._transforms = TransformBuffer()
        self._ticked_s = now_s
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
        """Say what was wrong with a message that never got here."""
        self._warn(problem)

    def stop(self, now_s: float, reason: str) -> NavConstraints:
        """Publish a stop, for a caller that is about to leave."""
        constraints = NavConstraints(now_s, (), 0.0, reason, True)
        for key, message in outgoing(
            constraints, (), self._robot, None, self.frames, percentage=self._percentage
        ):
            self._publish(key, message)
        return constraints

    def _constraints(self, now_s: float) -> NavConstraints:
        for missing, what in (
            (self._state, "no odometry yet"),
            (self._pipeline, "no camera_info yet"),
            (self._seen_s, "no camera frame yet"),
        ):
            if missing is None:
                return NavConstraints(now_s, (), 0.0, what, True)
        assert self._state is not None
        try:
            return self._adapter.update(
                self._tracks, self._state, now_s, perception_stamp_s=self._seen_s
            )
        except NavError as problem:
            self._warn(str(problem))
            return NavConstraints(now_s, (), 0.0, f"refused: {problem}", True)

    def _camera_pose(self, frame: str, stamp_s: float) -> FloatArray:
        if self._T_base_camera is None:
            return self._transforms.lookup(self.frames.odom, frame, stamp_s)
        T_odom_base = self._transforms.lookup(self.frames.odom, self.frames.base, stamp_s)
        return np.asarray(T_odom_base @ self._T_base_camera, dtype=np.float64)

    def _remember(self, message: TransformStamped, static: bool) -> None:
        move, turn = message.transform.translation, message.transform.rotation
        try:
            self._transforms.add(
                message.header.frame_id,
                message.child_frame_id,
                to_seconds(message.header.stamp),
                pose_matrix((move.x, move.y, move.z), turn),
                static=static,
            )
        except NavError as problem:
            self._warn(f"tf: {problem}")

    def _forget(self) -> None:
        view = None if self._camera is None else CameraView(self._camera)
        self._tracker = PersonTracker(TrackerConfig(awareness=self._policy.filter), view=view)
        self._adapter = NavAdapter(self._policy, self._robot)
        self._tracks = ()
        self._seen_s = None
        self._ticked_s = None

    def _warn(self, text: str) -> None:
        if text != self._warned:
            self._warned = text
            self._warn_user(text)


def _floor(T_odom_camera: FloatArray) -> FloorPlane | None:
    """The floor z = 0 of odom, which the feet of people stand on."""
    if T_odom_camera[2, 3] <= 0.0:
        return None
    return FloorPlane.from_pose(
        T_odom_camera, height_std_m=_HEIGHT_STD_M, tilt_std_rad=_TILT_STD_RAD
    )
