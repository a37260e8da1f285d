"""The bridge from sensor and odometry messages to constraints, without a transport."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

from perception import AwarenessPipeline, Camera, PerceptionError
from perception.arrays import FloatArray
from perception.laser import LegDetector, MapCells
from tracking import PersonTrack, TrackerConfig
from tracking.prediction import PredictionModel

from .._adapter import NavAdapter
from .._checks import require_type
from .._constraints import NavConstraints
from .._errors import NavError
from .._policy import AwarenessPolicy
from .._robot import RobotProfile, RobotState
from ..rules import Unseen
from ._alerts import sensor_status
from ._clock import BridgeClock
from ._footprint_input import FootprintInput
from ._image_input import ImageInput, PerceivedFrame
from ._outgoing import Frames, outgoing
from ._poses import RobotPoses
from ._scan_input import MapInput, ScanInput, ScannerInput, ScanPerception
from ._sensor_watch import CAMERA, SensorWatch
from ._shared import Shared
from ._shared_tracker import SharedTracker
from ._speed_limit import speed_limit
from ._speed_mask import SpeedMaskSettings, SpeedMaskStream
from .messages import Message
from .messages.diagnostic_msgs import DiagnosticStatus
from .messages.geometry_msgs import PolygonStamped
from .messages.nav_msgs import OccupancyGrid, Odometry
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image, LaserScan
from .messages.tf2_msgs import TFMessage

_LOG = logging.getLogger("nav_adapter")


class AwarenessBridge:
    """Turns camera, scanner and odometry messages of a ROS graph into constraints for its planners.

    Pass on messages as they come (``on_…``) and call :meth:`tick` at a fixed rate, with or without
    new images: each tick publishes every topic. If input is missing, late, refused, or contradicts
    other input (odometry, tf), the bridge publishes a stop with the reason. It never stops
    publishing by itself, and missing data never make a person count as aware.

    Perception may have a thread of its own, as :class:`PerceptionThread` gives it one: while
    :meth:`on_image` and :meth:`on_camera_info` run, :meth:`tick` and the other methods go on with
    the last frame's people, who grow older, as in :meth:`NavAdapter.watchdog`. :meth:`on_scan` may
    have another one (:class:`ScanThread`).

    With scanners, the robot stands until every sensor has been heard. If the camera is lost for
    longer than ``stale_after_s``, everybody counts as unaware, and the robot goes on only while
    scanners see all of the camera's field. If scanners are lost, or blind, the camera goes on as if
    it were alone. Each loss and return is a warning and a status of the alerts.

    Messages whose stamp lies more than 0.05 s ahead of ``now_s`` are refused and counted in
    :attr:`counts`. The clock of ``now_s`` may be stepped back: by up to 0.05 s, time stands still
    until it has caught up; by more, the robot stops, and if the clock goes on for 1 s from there,
    tracks and moving transforms are forgotten with a warning, and the limit rises slowly.

    Args:
        policy: of the adapter and of the awareness filter.
        robot: the robot's profile.
        publish: called with the key of a topic and a message.
        frames: names of the frames.
        T_base_camera: pose of a fixed camera; None to look it up in tf.
        make_pipeline: makes perception for a camera once it is known; by default the shipped one.
        camera: calibration; None to read it from camera_info. With it, the pipeline is made here.
        rectified: whether the images are rectified (:func:`is_rectified`): camera_info's P counts.
        with_camera: False for scanners alone; everybody then counts as unaware.
        with_depth: True if the camera has depth images (:meth:`on_depth`).
        scanners: the laser scanners.
        make_detector: makes the leg detector, if there are scanners.
        prediction: as for :class:`NavAdapter`.
        percentage: as in :func:`speed_limit`.
        speed_mask: of Nav2's speed filter; None for no mask.
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
        rectified: bool = False,
        with_camera: bool = True,
        with_depth: bool = False,
        scanners: Sequence[ScannerInput] = (),
        make_detector: Callable[[], LegDetector] = LegDetector,
        prediction: PredictionModel | None = None,
        percentage: bool = False,
        speed_mask: SpeedMaskSettings | None = None,
        warn: Callable[[str], None] = lambda text: None,
        wanted: Callable[[str], bool] = lambda key: True,
    ) -> None:
        self.frames = frames or Frames()
        self._publish, self._robot, self._percentage = publish, robot, percentage
        self._mask = None if speed_mask is None else SpeedMaskStream(speed_mask, self.frames.odom)
        self._with_camera, self._wanted = with_camera, wanted
        self._warn_user, self._warned = warn, ""
        self._calibration = "no camera_info yet"
        if not with_camera and not scanners:
            raise NavError("with_camera must be True, or scanners must name one or two, got none")
        self._adapter = NavAdapter(policy, robot, prediction=prediction)
        self._perception_failures = 0
        # For all that is shared but the tracker; perception is not held up.
        self._lock = threading.RLock()
        # Keeps the messages of one publication together.
        self._sending = threading.Lock()
        self._clock = BridgeClock()
        self._poses = RobotPoses(
            self.frames, T_base_camera, self._clock, self._warn, with_map=bool(scanners)
        )
        self._watch = SensorWatch(
            [each.name for each in scanners],
            with_camera=with_camera,
            lost_after_s=policy.timing.stale_after_s,
            with_depth=with_depth,
        )
        self._tracker = SharedTracker(TrackerConfig.for_policy(policy), len(scanners))
        shared = Shared(
            self._clock, self._poses, self._watch, self._tracker, self._lock, self._warn
        )
        self._images = ImageInput(
            *(shared, make_pipeline, camera),
            rectified=rectified,
            with_depth=with_depth,
            creeps=policy.applies(Unseen.name) and not scanners,
        )
        self._footprint = FootprintInput(shared, lambda: self._robot, self._go_on_with)
        self._map = MapInput(shared, self.frames.odom)
        self._scans: tuple[ScanInput, ...] = ()
        self._legs: ScanPerception | None = None
        self._scans_dropped = 0
        if inputs := tuple(scanners):
            legs = self._legs = ScanPerception(robot.footprint_m, inputs, make_detector)
            self._scans = tuple(
                ScanInput(shared, number, each, legs, self._map)
                for number, each in enumerate(inputs)
            )

    @property
    def frame(self) -> PerceivedFrame | None:
        """The latest frame with its image, people and tracks, or None before the first."""
        return self._images.frame

    @property
    def tracks(self) -> tuple[PersonTrack, ...]:
        """Tracks after the latest frame of any sensor."""
        return self._tracker.tracks

    @property
    def counts(self) -> dict[str, int]:
        """Counts since the start, which are published with the alerts.

        ``frames`` that were processed; ``odometry_from_future``, ``transforms_from_future`` and
        ``images_from_future``, which were refused; ``perception_failures``: images that ended in an
        error of the program; ``clock_restarts``. With scanners also ``scans_from_future``, and
        ``scans`` that were processed, ``scans_refused`` for any reason, ``scans_dropped``, and
        ``frames_refused_by_tracker``, of any sensor. With depth images ``depth_images`` that were
        used, ``depth_images_refused`` for any reason, and ``depth_images_from_future``.
        """
        with self._lock:
            depth, scans = self._images.depth, self._scans
            counts = {
                "frames": self._images.used,
                **{f"{key}_from_future": count for key, count in self._clock.refused.items()},
                "perception_failures": self._perception_failures,
                "clock_restarts": self._clock.restarts,
            }
            if depth is None:
                del counts["depth_images_from_future"]
            else:
                counts |= {"depth_images": depth.used, "depth_images_refused": depth.refused}
            if not scans:
                del counts["scans_from_future"]
                return counts
            return counts | {
                "scans": sum(each.used for each in scans),
                "scans_refused": sum(each.refused for each in scans),
                "scans_dropped": self._scans_dropped,
                "frames_refused_by_tracker": self._tracker.refused_frames,
            }

    @property
    def robot_state(self) -> RobotState | None:
        """The latest state of the robot, or None."""
        return self._poses.state

    @property
    def camera(self) -> Camera | None:
        """The camera, or None while it is unknown."""
        return self._images.camera

    def use_robot(self, robot: RobotProfile) -> None:
        """Go on with another profile, as :meth:`NavAdapter.use_robot`, in the scans too.

        An outline of :meth:`on_footprint` counts on until the next one.

        Raises:
            NavError: for anything else.
        """
        require_type("robot", robot, RobotProfile)
        self._go_on_with(self._footprint.loaded(robot))

    def _go_on_with(self, robot: RobotProfile) -> None:
        with self._sending, self._lock:
            self._adapter.use_robot(robot)
            self._robot = robot
            if self._legs is not None:
                self._legs.body_base_m = robot.footprint_m

    def on_camera_info(self, message: CameraInfo) -> None:
        """Make the pipeline from the first calibration; later ones are ignored."""
        try:
            if self._with_camera:
                self._images.calibrate(message)
        except (NavError, PerceptionError) as problem:
            self._calibration = "the camera_info that comes cannot be used"
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
            self._poses.read_transforms(message, now_s, static=static)

    def on_odometry(self, message: Odometry, now_s: float | None = None) -> None:
        """Store the robot's state and pose.

        Args:
            message: in the odom frame; of the base frame, or of one that tf knows on the robot.
            now_s: the present time; None to check the stamp in the next :meth:`tick` only.
        """
        with self._lock:
            self._poses.read_odometry(message, now_s)

    def on_footprint(self, message: PolygonStamped, now_s: float) -> bool:
        """Go on with the footprint of a robot that has taken or left a load; return if it was used.

        The limit counts the hull of it and of the profile's footprint. A message that is refused
        is reported, and the last one is kept.

        Args:
            message: the outline in the base frame, in one on the robot, or in odom at its stamp, as
                Nav2's local costmap publishes it.
            now_s: the present time.
        """
        return self._footprint.read(message, now_s)

    def on_image(self, message: Image | CompressedImage, now_s: float) -> bool:
        """Process one image; return True if it was used."""
        used = self._images.read(message, now_s)
        if used:
            with self._lock:
                self._warned = ""
        return used

    def on_depth(self, message: Image, now_s: float) -> bool:
        """Keep a depth image, aligned with the pictures, for the picture of its time.

        It must come before the picture, or while the one before is processed. Return False if it
        was refused.

        Raises:
            NavError: if the bridge was made without depth images.
        """
        if self._images.depth is None:
            raise NavError("the bridge was made without depth images")
        return self._images.depth.read(message, now_s)

    def refuse_depth(self, problem: str, now_s: float) -> None:
        """Count and report a depth image that could not be decoded or used."""
        if self._images.depth is not None:
            self._images.depth.refuse(problem, now_s)

    def on_scan(self, number: int, message: LaserScan, now_s: float) -> bool:
        """Process one scan of a scanner, numbered from 0; return True if it was used.

        Raises:
            NavError: for a number that no scanner has.
        """
        return self._scan_input(number).read(message, now_s)

    def on_map(self, message: OccupancyGrid | MapCells) -> None:
        """Use a map of fixed things, also one from a file: they are not taken for legs.

        It is used while tf tells where the map is in odom.
        """
        self._scan_input()
        try:
            self._map.set(message)
        except NavError as problem:
            self._warn(f"map: {problem}")

    def refuse_scan(self, number: int, problem: str, now_s: float) -> None:
        """Count and report a scan that could not be decoded."""
        self._scan_input(number).refuse(problem, now_s)

    def scan_dropped(self) -> None:
        """Count a scan that was dropped, because others came faster than they are processed."""
        with self._lock:
            self._scans_dropped += 1

    def tick(self, now_s: float) -> NavConstraints:
        """Publish every topic at ``now_s`` and return the constraints."""
        with self._sending:
            with self._lock:
                restarts = self._clock.restarts
                time_s = self._clock.advance(now_s)
                if self._clock.restarts != restarts:
                    self._restart()
                if time_s is None:
                    constraints = stopped(now_s, "the clock went backward")
                else:
                    self._poses.drop_future(time_s)
                    constraints = self._constraints(time_s)
                    if constraints.stale and (blind := self._watch.blind_text):
                        reason = f"{constraints.limited_by}; {blind}"
                        constraints = replace(constraints, limited_by=reason)
                tracks, state = self.tracks, self._poses.state
                details = {name: str(count) for name, count in self.counts.items()}
                if self.frame is not None:
                    details["frame_age_s"] = f"{constraints.stamp_s - self.frame.stamp_s:.3f}"
                sensors, news = self._sensors(constraints.stamp_s)
            for line in news:
                self._warn_user(line)
            self._send(constraints, tracks, state, self._wanted, details, sensors)
        return constraints

    def sent_limit_mps(self, constraints: NavConstraints) -> float:
        """Return the limit (m/s) that Nav2 gets: that of the base, per axis (``speed_limit``)."""
        message = speed_limit(constraints, self._robot.max_speed_mps, state=self.robot_state)
        return message.speed_limit

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
        constraints = stopped(now_s, reason)
        with self._sending:
            self._send(constraints, (), None, lambda key: True)
        return constraints

    def _send(
        self,
        constraints: NavConstraints,
        tracks: tuple[PersonTrack, ...],
        state: RobotState | None,
        wanted: Callable[[str], bool],
        details: dict[str, str] | None = None,
        sensors: DiagnosticStatus | None = None,
    ) -> None:
        """Publish the topics that are ``wanted``; the arguments are those of :func:`outgoing`."""
        messages = outgoing(
            *(constraints, tracks, self._robot, state, self.frames),
            percentage=self._percentage,
            wanted=wanted,
            details=details,
            sensors=sensors,
        )
        masks = () if self._mask is None else self._mask.messages(constraints, state, wanted)
        for key, message in chain(messages, masks):
            self._publish(key, message)

    def _constraints(self, now_s: float) -> NavConstraints:
        state, seen_s = self._poses.state, self._watch.stamp_s
        missing = self._missing()
        if missing or state is None or seen_s is None:
            return stopped(now_s, missing or "no sensor sees what is ahead")
        tracks = self.tracks
        if self._scans and CAMERA in self._watch.lost(now_s):
            # As the camera alone would have it, whatever the tracker remembers.
            tracks = tuple(replace(each, awareness_lower=0.0, noticed=0.0) for each in tracks)
        return guarded_update(
            *(self._adapter, tracks, state, now_s, seen_s, self._warn), self._watch.seen.stamp_s
        )

    def _missing(self) -> str:
        """Return what has not come yet or cannot be trusted; empty if nothing is missing."""
        if self._poses.problem:
            return f"odometry: {self._poses.problem}"
        if self._poses.state is None:
            return "no odometry yet"
        if self._with_camera and self._images.camera is None:
            return self._calibration
        return self._watch.missing_text

    def _restart(self) -> None:
        """Forget all that has a stamp of the clock before it was set."""
        self._adapter.reset()
        self._tracker.forget()
        self._poses.forget()
        self._watch.forget()
        for each in (self._images, self._footprint, *self._scans):
            each.forget()
        self._warn("the clock has been set back: all tracks and moving transforms are deleted")

    def _sensors(self, now_s: float) -> tuple[DiagnosticStatus | None, list[str]]:
        """Return the status of the sensors, and a line for each loss and return."""
        if not self._scans and self._images.depth is None:
            return None, []
        status = sensor_status(self._watch.ages_s(now_s), self._watch.lost(now_s))
        return status, self._watch.news(now_s)

    def _scan_input(self, number: int = 0) -> ScanInput:
        if not self._scans:
            raise NavError("the bridge was made without scanners")
        if not 0 <= number < len(self._scans):
            raise NavError(
                f"number must be that of a scanner, 0 to {len(self._scans) - 1}, got {number}"
            )
        return self._scans[number]

    def _warn(self, text: str) -> bool:
        """Pass on a problem; return False for the one that was passed on last."""
        with self._lock:
            if text == self._warned:
                return False
            self._warned = text
        self._warn_user(text)
        return True


def guarded_update(
    adapter: NavAdapter,
    tracks: tuple[PersonTrack, ...],
    robot_state: RobotState,
    now_s: float,
    perception_stamp_s: float,
    warn: Callable[[str], bool],
    seen_stamp_s: Callable[[float, float], float | None] | None = None,
) -> NavConstraints:
    """Return :meth:`NavAdapter.update`, or a stop with the reason if it refuses or fails.

    ``warn`` is called with the problem, and returns whether it is a new one.
    """
    try:
        return adapter.update(
            tracks,
            robot_state,
            now_s,
            perception_stamp_s=perception_stamp_s,
            seen_stamp_s=seen_stamp_s,
        )
    except NavError as problem:
        warn(str(problem))
        reason = f"refused: {problem}"
    except Exception as problem:
        # Publishing must go on, whatever is wrong with these data.
        reason = f"the adapter failed: {type(problem).__name__}: {problem}"
        if warn(reason):
            _LOG.error("the adapter failed", exc_info=problem)
    try:
        # A stop that keeps the people of the last good data, grown older.
        older = adapter.watchdog(now_s)
    except Exception:
        return stopped(now_s, reason)
    nothing: dict[str, Any] = {"speed_limit_mps": 0.0, "reachable_speed_limit_mps": 0.0}
    return replace(older, **nothing, limited_by=reason, stale=True)


def stopped(now_s: float, reason: str) -> NavConstraints:
    """Return constraints without people that stop the robot."""
    return NavConstraints(now_s, (), 0.0, reason, True)
