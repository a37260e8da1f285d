"""The robot's senses in one crossing: camera, scanners and odometry with their faults, tracker."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy
from perception.arrays import FloatArray
from perception.laser import AHEAD_RAD, SeenDirections, camera_field
from tracking import PersonTrack, PersonTracker, TrackerConfig

from ..conditions import Perception
from ..world.camera import FrameQueue
from ._messages import Change, Delivery, OdometryReading, Sighting, WorkerObservations
from ._stage import TrueView
from .sensors import CameraSensor, SensorSetup, World, motion_of, sensor_class, view_of

# The tracker's name of the camera.
_CAMERA: Final = "camera"
# Age of perception before the first image has arrived: older than any policy accepts.
_NEVER_S: Final = 1.0e6
# Images and scans with stamps farther ahead are refused, as the bridge on a robot refuses them.
_AHEAD_S: Final = 0.05


class Sensing:
    """The sensors of a robot on a stage, its odometry and its tracker.

    Args:
        setup: what sensors are made of.
        perception: their names.
        policy: has the settings of the tracker.

    Attributes:
        state: the robot's own state, as it knows it.
        tracks: tracks of the people.
        observed: observations of the newest image if it arrived in this cycle, else none.
        scan_points_odom_m: (N, 2) points of the scans that arrived in this cycle.

    Raises:
        SimError: for a perception with scanners and a scenario without any.
    """

    def __init__(self, setup: SensorSetup, perception: Perception, policy: AwarenessPolicy) -> None:
        self._stage = stage = setup.stage
        # The camera comes last: its faces are then those of people whom scans have placed.
        self._sensors = [sensor_class(name)(setup) for name in reversed(perception)]
        self._odometry = Odometry(setup.faults.odometry())
        self._sees_all = any(each.knows_all for each in self._sensors)
        spec = stage.scenario.camera
        cameras = [each for each in self._sensors if isinstance(each, CameraSensor)]
        model = cameras[0].camera if cameras else spec.camera()
        self._tracker = PersonTracker(
            TrackerConfig.for_policy(policy),
            view=cameras[0].view if cameras else view_of(stage, model),
            sensors={
                name: config for each in self._sensors for name, config in each.tracked.items()
            },
        )
        self._newest_s: dict[str, float] = {}
        self._seen = SeenDirections()
        T_base_camera = np.linalg.inv(stage.amr.T_odom_base) @ stage.amr.T_odom_camera
        self._fields = [
            camera_field(model, T_base_camera @ each.T_camera_view)
            for each in spec.flat_views(model)
        ]

    def step(self, t_s: float, truth: tuple[TrueView, ...]) -> None:
        """Take the images and scans that are due in a control cycle."""
        T_odom_camera = self._stage.amr.T_odom_camera
        known = self._odometry.take(OdometryReading(self._stage.amr.state(t_s), T_odom_camera))
        world = World(t_s, T_odom_camera, _camera_at(t_s, known), truth, known.state)
        sightings = [sighting for each in self._sensors for sighting in each.look(world)]
        self.state = known.state
        self.observed: WorkerObservations = ()
        tracks: tuple[PersonTrack, ...] = ()
        for sighting in sightings:
            if not self._is_new(sighting, t_s):
                continue
            tracks = self._tracker.update(
                tuple(observation for observation, _ in sighting.observations),
                sighting.stamp_s,
                sighting.T_odom_camera,
                sensor=sighting.sensor,
                view=sighting.view,
            )
            if sighting.sight is not None:
                self._seen.note(sighting.sight, sighting.stamp_s)
            elif sighting.sensor == _CAMERA:
                for field in self._fields:
                    self._seen.note_field(*field, sighting.stamp_s)
            if sighting.stamp_s > self._newest_s.get(sighting.sensor, -_NEVER_S):
                self._newest_s[sighting.sensor] = sighting.stamp_s
                if sighting.sensor == _CAMERA:
                    self.observed = sighting.observations
        latest_s = self._tracker.last_stamp_s
        if latest_s != t_s or not tracks:
            # A sensor's clock may be a little ahead.
            tracks = self._tracker.predict(t_s if latest_s is None else max(t_s, latest_s))
        self.tracks = tracks
        points = [each.points_odom_m for each in sightings if each.points_odom_m is not None]
        self.scan_points_odom_m: FloatArray = np.concatenate([np.zeros((0, 2)), *points])

    @property
    def seen_stamp_s(self) -> Callable[[float, float], float | None] | None:
        """The time from which the robot knows what is in a sector, for :class:`NavAdapter`.

        None for a robot that knows the truth in all directions.
        """
        return None if self._sees_all else self._seen.stamp_s

    @property
    def stamp_s(self) -> float:
        """The time from which camera or scanners know what is ahead, as on a robot."""
        ahead_s = self._seen.stamp_s(0.0, AHEAD_RAD)
        return max(
            self._newest_s.get(_CAMERA, -_NEVER_S), -_NEVER_S if ahead_s is None else ahead_s
        )

    def _is_new(self, sighting: Sighting, t_s: float) -> bool:
        """Return whether the tracker takes a sighting.

        The same image again is no new evidence, the tracker cannot go back to one too old, and a
        stamp from the future is wrong.
        """
        if sighting.stamp_s > t_s + _AHEAD_S:
            return False
        if sighting.stamp_s == self._newest_s.get(sighting.sensor):
            return False
        newest_s = max(self._newest_s.values(), default=-_NEVER_S)
        return newest_s - sighting.stamp_s <= self._tracker.config.max_lag_s


class Odometry:
    """The robot's odometry: the newest message that has arrived, one of which is sent a cycle."""

    def __init__(self, change: Change[OdometryReading] | None) -> None:
        self._change = change
        self._queue: FrameQueue[OdometryReading] = FrameQueue()
        self._known: OdometryReading | None = None

    def take(self, reading: OdometryReading) -> OdometryReading:
        """Return what the robot knows when the true reading is sent; stamps grow."""
        if self._change is None:
            return reading
        now_s = reading.state.stamp_s
        sent = self._change(Delivery(reading, now_s, now_s, reading.T_odom_camera))
        if sent is not None:
            self._queue.put(now_s, sent.arrives_s, sent.message)
        if self._known is None:  # before the first message has arrived, the robot knows its start
            self._known = reading if sent is None else sent.message
        arrived = self._queue.take(now_s)
        self._known = arrived[-1] if arrived else self._known
        return self._known


def _camera_at(t_s: float, known: OdometryReading) -> FloatArray:
    """Return T_odom_camera (4, 4) of a robot that keeps its motion after its newest odometry."""
    if known.state.stamp_s == t_s:
        return known.T_odom_camera
    motion = motion_of(known.state)
    moved = motion.pose_at(t_s) @ np.linalg.inv(motion.T_odom_base)
    return np.asarray(moved @ known.T_odom_camera)
