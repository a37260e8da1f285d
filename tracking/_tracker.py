"""The tracker: turns the person observations of each frame into tracks in the odom frame."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from perception import PersonObservation
from perception.arrays import covariance_matrix, finite_number, rigid_transform

from ._admission import Admission
from ._config import TrackerConfig
from ._errors import TrackingError
from ._frame import Frame, measurements_of
from ._history import History
from ._sensors import CAMERA, SensorConfig, sensors_of
from ._snapshot import PersonTrack, snapshots
from ._state import Field, State
from ._step import advance
from ._views import View
from .clock import FrameClock


class PersonTracker:
    """Track people with a moving camera and other sensors, at any frame rates.

    Each track has a constant-velocity Kalman filter on the floor plane (odom x and y) and a filter
    of awareness in logit(α). A track is tentative until its detections exceed ``confirm_logit``,
    and coasting while the latest frame does not show the person. An id is never used again.
    Tentative tracks are returned too, with ``awareness_lower`` 0: the person may not exist, but
    navigation must treat them as one who has not seen the robot.

    Other sensors of the robot, such as laser scanners, have names in ``sensors``. Each sensor has
    its own view, frame rate and latency, and its own opinion whether a person is still there; a
    track is kept as long as one of them holds it. A sensor that sees no faces keeps identity, place
    and motion, and says nothing about awareness.

    A person is given up after ``max_missed_s`` of frames that should have shown them, after
    ``max_coast_s`` in which none could, or after ``max_standing_coast_s`` if they stood still; the
    times add up. Without a ``view``, people are expected where the sensor has seen people.

    Frames may come late by up to ``max_lag_s``. The tracks and their ids are then the same as if
    the frames had come in order. This may revise earlier results from after the late frame's stamp:
    a person first seen after it can get another id, or turn out to be a known person.

    A frame that is later than the last by more than ``max_pause_s`` is refused as well, since one
    wrong stamp would end all tracks. One that is ahead by less is taken, and taken back if the next
    frame of any sensor goes on from before it: the latest stamp then goes back. If the refused
    frames follow one another for ``new_clock_after_s``, the clock has been set: the tracker starts
    anew, as after :meth:`reset`, counts it in :attr:`clock_restarts` and logs a warning.

    The tracker is deterministic. A refused input raises :class:`~tracking.TrackingError` and leaves
    the tracks as they were; :attr:`refused_late_frames` and :attr:`refused_early_frames` count
    those refused for their stamp.

    Examples:
        >>> import numpy as np
        >>> from perception import PersonObservation
        >>> from tracking import PersonTracker
        >>> covariance_m2 = np.eye(3) / 100
        >>> seen = PersonObservation(0.0, [0, 0, 4], covariance_m2, [0, 0, -1], 0.9, 0.1, 1.0)
        >>> T_odom_camera = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]]
        >>> (track,) = PersonTracker().update([seen], 0.0, T_odom_camera)
        >>> track.status, track.position_odom_m.tolist(), track.awareness_lower
        ('tentative', [4.0, 0.0], 0.0)

    Args:
        config: settings; None for the defaults.
        view: where the camera can see people; None if unknown.
        sensors: the settings of other sensors, by name; None for the camera alone.
    """

    def __init__(
        self,
        config: TrackerConfig | None = None,
        *,
        view: View | None = None,
        sensors: Mapping[str, SensorConfig] | None = None,
    ) -> None:
        if config is None:
            config = TrackerConfig()
        if not isinstance(config, TrackerConfig):
            raise TrackingError(f"config must be a TrackerConfig, got {type(config).__name__}")
        _check_view(view)
        self._config = config
        self._sensors = sensors_of(config, view, sensors)
        self._admission = Admission(config, self._sensors)
        self._history = self._empty_history(next_id=1)

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        return self._config

    @property
    def last_stamp_s(self) -> float | None:
        """Stamp of the latest frame of any sensor, or None before the first.

        Without tracks, it tells whether nobody is there or the camera has stopped.
        """
        return self._history.latest.stamp_s

    @property
    def silences_s(self) -> dict[str, float]:
        """Time since the latest frame of each sensor, at the latest stamp; infinite before any.

        A sensor that is lost has a silence that grows. The tracker goes on with the others.
        """
        state = self._history.latest
        now_s = state.stamp_s
        return {
            sensor.name: math.inf
            if clock.stamp_s is None or now_s is None
            else now_s - clock.stamp_s
            for sensor, clock in zip(self._sensors.all, state.clocks, strict=True)
        }

    @property
    def refused_late_frames(self) -> int:
        """Number of frames that were refused because they came too late."""
        return self._admission.late.total()

    @property
    def refused_early_frames(self) -> int:
        """Number of frames that were refused, or taken back, since their stamp jumped ahead."""
        return self._admission.ahead.total()

    @property
    def refused_frames(self) -> dict[str, int]:
        """Number of frames that were refused for their stamp, of each sensor.

        If it grows for one sensor only, that sensor's clock differs from the others', or its frames
        come later than ``max_lag_s``.
        """
        late, ahead = self._admission.late, self._admission.ahead
        return {each.name: late[each.name] + ahead[each.name] for each in self._sensors.all}

    @property
    def clock_restarts(self) -> int:
        """Number of times the tracker has started anew because the clock had been set."""
        return self._admission.restarts

    def reset(self) -> None:
        """Forget all tracks and the clock. Ids go on, and the counts stay."""
        self._history = self._empty_history(self._history.latest.next_id)
        self._admission.forget()

    def update(
        self,
        observations: Iterable[PersonObservation],
        stamp_s: float,
        T_odom_camera: Any,
        *,
        pose_covariance_odom: Any = None,
        sensor: str = CAMERA,
        view: View | None = None,
    ) -> tuple[PersonTrack, ...]:
        """Process one frame and return every track at the latest stamp, in the order of their ids.

        Args:
            observations: of this frame, in the frame of its sensor; empty if it shows nobody. The
                awareness in observations of a sensor that sees no faces is ignored.
            stamp_s: time of the frame, at most ``max_lag_s`` before the latest one's. A second
                frame with the same stamp is a second set of measurements at that time. At most
                ``max_pause_s`` after the latest one's.
            T_odom_camera: (4, 4) pose of the camera, or of the other sensor, at ``stamp_s``.
            pose_covariance_odom: (3, 3) of the camera's x, y (m) and yaw (rad) in odom at
                ``stamp_s``, or None if the pose is known well enough. All people in a frame share
                the pose error; the tracker adds it to each of them as if it were independent.
            sensor: name of the sensor that took the frame. Stamps of all sensors are times of one
                clock, the robot's.
            view: of this frame alone, for example a :class:`ScannerView` with the points of the
                scan; None for that of the sensor.

        Raises:
            TrackingError: for an unknown sensor, for a stamp that is not finite, lies too far back
                or ahead, or differs from that of an observation by more than
                a millisecond, for a ``T_odom_camera`` that is not a rigid transform, for a
                ``pose_covariance_odom`` that is not a covariance, for a view without its method,
                and for anything in ``observations`` that is not a
                :class:`~perception.PersonObservation` or lies out of bounds.
        """
        source = self._sensors.named(sensor)
        _check_view(view)
        stamp = finite_number("stamp_s", stamp_s, TrackingError)
        T = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        pose = None
        if pose_covariance_odom is not None:
            pose = covariance_matrix("pose_covariance_odom", pose_covariance_odom, 3, TrackingError)
        if source.pose_covariance is not None:
            pose = source.pose_covariance if pose is None else pose + source.pose_covariance
        measurements = measurements_of(observations, stamp, T, pose)
        entry = self._admission.frame_entry(self._history, stamp, source)
        if entry.anew:
            history = self._empty_history(entry.memory.latest.next_id)
        else:
            history = entry.memory.copy()
        history.insert(Frame(stamp, T, measurements, source.index, view))
        self._history = history
        self._admission.taken(entry)
        latest = self._history.latest
        return self._snapshots(stamp if latest.stamp_s is None else latest.stamp_s)

    def predict(self, stamp_s: float) -> tuple[PersonTrack, ...]:
        """Return the tracks at the latest stamp or later; the tracker does not change.

        They are what :meth:`update` would return for a frame at ``stamp_s`` that covers nothing:
        position uncertainty grows, awareness falls, and expired tracks are left out. A person in
        the latest frame keeps the status confirmed.

        Raises:
            TrackingError: for a stamp that is not finite or lies before the latest frame's.
        """
        stamp = finite_number("stamp_s", stamp_s, TrackingError)
        last_s = self.last_stamp_s
        if last_s is not None and stamp < last_s:
            raise TrackingError(
                f"cannot predict at stamp_s = {stamp!r} s: the last frame was at {last_s!r} s, "
                "and earlier tracks are not kept"
            )
        return self._snapshots(stamp)

    def _empty_history(self, next_id: int) -> History:
        """Return the history before the first frame."""
        count = len(self._sensors.all)
        nobody = State((), (FrameClock(),) * count, (Field(),) * count, next_id)
        return History(self._advance, self._config.max_lag_s, nobody)

    def _advance(self, state: State, frame: Frame) -> State:
        return advance(state, frame, self._sensors)

    def _snapshots(self, stamp_s: float) -> tuple[PersonTrack, ...]:
        return snapshots(self._history.latest, stamp_s, self._sensors)


@cache  # a check against a protocol takes long, and every frame brings a view
def _are_views(kind: type) -> bool:
    return issubclass(kind, View)


def _check_view(view: Any) -> None:
    if view is not None and not (_are_views(view.__class__) or isinstance(view, View)):
        raise TrackingError(
            "view must have a method visibility(positions_odom_m, T_odom_camera), "
            f"got {type(view).__name__}"
        )
