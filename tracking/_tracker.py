"""The tracker: turns the person observations of each frame into tracks in the odom frame."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from perception import PersonObservation
from perception.arrays import covariance_matrix, finite_number, rigid_transform
from perception.documents import read_json

from ._config import TrackerConfig
from ._errors import TrackingError
from ._history import History
from ._measurement import Frame, measurements_of
from ._saved_state import frame_of, record_of, state_of, to_plain
from ._snapshot import snapshots
from ._step import TrackerState, advance, gates_of
from ._table import TrackTable
from ._track import PersonTrack
from ._views import View
from .clock import JumpedClock

_LOG = logging.getLogger("tracking")


class PersonTracker:
    """Track people with a moving camera, at any frame rate.

    Each track has a constant-velocity Kalman filter on the floor plane (odom x and y) and a filter
    of awareness in logit(α). A track is tentative until ``confirm_hits`` frames within
    ``confirm_window_s`` have shown the person, and coasting while the latest frame does not. An id
    is never used again. Tentative tracks are returned too, with ``awareness_lower`` 0: the person
    may not exist, but navigation must treat them as one who has not seen the robot.

    A track is deleted sooner if frames should have shown the person. With a ``view``, a person whom
    nothing hides is deleted after ``max_missed_s``. A person out of view or behind another person
    is deleted after ``max_coast_s``, or after ``max_standing_coast_s`` if they stood still. Without
    a view every person is kept for ``max_coast_s``.

    Frames may come late by up to ``max_lag_s``. The tracks and their ids are then the same as if
    the frames had come in order. This may revise earlier results from after the late frame's stamp:
    a person first seen after it can get another id, or turn out to be a known person.

    A frame that is later than the last by more than ``max_pause_s`` is refused as well, since one
    wrong stamp would end all tracks. If the refused frames follow one another for
    ``new_clock_after_s``, the clock has been set: the tracker starts anew, as after :meth:`reset`,
    counts it in :attr:`clock_restarts` and logs a warning.

    The tracker is deterministic. A refused input raises :class:`~tracking.TrackingError` and leaves
    the tracks as they were; :attr:`refused_late_frames` and :attr:`refused_early_frames` count
    those refused for their stamp.

    Args:
        config: settings; None for the defaults.
        view: where the camera can see people; None if unknown.
    """

    def __init__(self, config: TrackerConfig | None = None, *, view: View | None = None) -> None:
        if config is None:
            config = TrackerConfig()
        if not isinstance(config, TrackerConfig):
            raise TrackingError(f"config must be a TrackerConfig, got {type(config).__name__}")
        if view is not None and not isinstance(view, View):
            raise TrackingError(
                "view must have a method visibility(positions_odom_m, T_odom_camera), "
                f"got {type(view).__name__}"
            )
        self._config = config
        self._view = view
        self._gates = gates_of(config)
        self._refused_late_frames = 0
        self._refused_early_frames = 0
        self._clock_restarts = 0
        self._jumped: JumpedClock | None = None
        nobody = TrackerState(TrackTable.empty(config.confirm_hits))
        self._history = History(self._advance, config.max_lag_s, nobody)

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        return self._config

    @property
    def last_stamp_s(self) -> float | None:
        """Stamp of the latest frame, or None before the first.

        Without tracks, it tells whether nobody is there or the camera has stopped.
        """
        return self._history.latest.stamp_s

    @property
    def refused_late_frames(self) -> int:
        """Number of frames that were refused because they came too late."""
        return self._refused_late_frames

    @property
    def refused_early_frames(self) -> int:
        """Number of frames that were refused because their stamp jumped ahead."""
        return self._refused_early_frames

    @property
    def clock_restarts(self) -> int:
        """How often the tracker has started anew because the clock had been set."""
        return self._clock_restarts

    def reset(self) -> None:
        """Forget all tracks and the clock. Ids go on, and the counts stay."""
        state = self._history.latest
        nobody = TrackerState(TrackTable.empty(self._config.confirm_hits), state.next_id)
        self._history = History(self._advance, self._config.max_lag_s, nobody)
        self._jumped = None

    def update(
        self,
        observations: Iterable[PersonObservation],
        stamp_s: float,
        T_odom_camera: Any,
        *,
        pose_covariance_odom: Any = None,
    ) -> tuple[PersonTrack, ...]:
        """Process one frame and return every track at the latest stamp, in the order of their ids.

        Args:
            observations: of this frame; empty if it shows nobody.
            stamp_s: time of the frame, at most ``max_lag_s`` before the latest one's. A second
                frame with the same stamp is a second set of measurements at that time. At most
                ``max_pause_s`` after the latest one's.
            T_odom_camera: (4, 4) pose of the camera at ``stamp_s``.
            pose_covariance_odom: (3, 3) of the camera's x, y (m) and yaw (rad) in odom at
                ``stamp_s``, or None if the pose is known well enough. All people in a frame share
                the pose error; the tracker adds it to each of them as if it were independent.

        Raises:
            TrackingError: for a stamp that is not finite, lies too far back or ahead, or differs
                from that of an observation by more than ``stamp_tolerance_s``, for a
                ``T_odom_camera`` that is not a rigid transform, for a ``pose_covariance_odom`` that
                is not a covariance, and for anything in ``observations`` that is not a
                :class:`~perception.PersonObservation` or lies out of bounds.
        """
        stamp = finite_number("stamp_s", stamp_s, TrackingError)
        T = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        pose = None
        if pose_covariance_odom is not None:
            pose = covariance_matrix("pose_covariance_odom", pose_covariance_odom, 3, TrackingError)
        measurements = measurements_of(observations, stamp, T, pose, self._config)
        self._check_clock(stamp)
        self._history.insert(Frame(stamp, T, measurements))
        latest = self._history.latest
        return self._snapshots(stamp if latest.stamp_s is None else latest.stamp_s)

    def predict(self, stamp_s: float) -> tuple[PersonTrack, ...]:
        """Return the tracks at the latest stamp or later; the tracker does not change.

        They are what :meth:`update` would return for a frame at ``stamp_s`` that covers nothing:
        position uncertainty grows, awareness falls, and expired tracks are left out. A person in
        the latest frame keeps the status confirmed, and a tentative track is kept for
        ``confirm_window_s``.

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

    def state(self) -> dict[str, Any]:
        """Return the whole state of the tracker, config included, as plain JSON values.

        A tracker made by :meth:`from_state` continues bit for bit. The view is not included.
        """
        history = self._history
        return to_plain(
            self._config,
            self._refused_late_frames,
            history.base,
            history.frames,
            history.latest,
            clock=(self._refused_early_frames, self._clock_restarts, self._jumped),
        )

    @classmethod
    def from_state(cls, state: dict[str, Any], *, view: View | None = None) -> PersonTracker:
        """Make a tracker that continues from a state that :meth:`state` returned.

        Args:
            state: from :meth:`state`, or from its JSON.
            view: the view of the first tracker; it is not part of the state.

        Raises:
            TrackingError: for a state that no tracker has written, or that has another version.
        """
        record = record_of(state)
        tracker = cls(record.config, view=view)
        tracker._refused_late_frames = record.refused_late_frames
        tracker._refused_early_frames = record.clock.refused_early_frames
        tracker._clock_restarts = record.clock.restarts
        jumped = record.clock.jumped
        if jumped is not None:
            tracker._jumped = JumpedClock(jumped.first_s, jumped.last_s, jumped.stamps)
        hits = record.config.confirm_hits
        tracker._history = History(
            tracker._advance,
            record.config.max_lag_s,
            state_of(record.base, hits, "base"),
            [frame_of(frame, f"frames[{index}]") for index, frame in enumerate(record.frames)],
            state_of(record.latest, hits, "latest"),
        )
        return tracker

    def save(self, path: str | Path) -> None:
        """Write :meth:`state` as JSON for :meth:`load`; the file is replaced in one step.

        Raises:
            TrackingError: naming the file, if it cannot be written.
        """
        path = Path(path)
        text = json.dumps(self.state(), allow_nan=False)
        partial = path.with_name(path.name + ".part")
        try:
            partial.write_text(text, encoding="utf-8")
            partial.replace(path)
        except OSError as cause:
            raise TrackingError(f"cannot write {path}: {cause.strerror or cause}") from cause

    @classmethod
    def load(cls, path: str | Path, *, view: View | None = None) -> PersonTracker:
        """Make a tracker that continues from a file that :meth:`save` wrote.

        Raises:
            TrackingError: naming the file, if it cannot be read or holds no state of a tracker.
        """
        path = Path(path)
        state = read_json(path, TrackingError)
        try:
            return cls.from_state(state, view=view)
        except TrackingError as cause:
            raise TrackingError(f"{path}: {cause}") from cause

    def _check_clock(self, stamp_s: float) -> None:
        """Refuse and count a stamp that jumps; start anew if the clock has been set."""
        last_s, config = self.last_stamp_s, self._config
        if last_s is None:
            return
        message = self._history.lateness_error(stamp_s)
        early = stamp_s - last_s > config.max_pause_s
        if early:
            message = (
                f"stamp_s = {stamp_s!r} s jumps ahead: the last frame was at {last_s!r} s, and "
                f"max_pause_s = {config.max_pause_s:g} s"
            )
        if message is None:
            self._jumped = None
            return
        self._jumped = JumpedClock.following(self._jumped, stamp_s, config.max_pause_s)
        if self._jumped.has_lasted(config.new_clock_after_s):
            _LOG.warning(
                "the clock has been set: frames at %.3f s after %.3f s; the tracker starts anew",
                stamp_s,
                last_s,
            )
            self.reset()
            self._clock_restarts += 1
            return
        if early:
            self._refused_early_frames += 1
        else:
            self._refused_late_frames += 1
        raise TrackingError(message)

    def _advance(self, state: TrackerState, frame: Frame) -> TrackerState:
        return advance(state, frame, self._config, self._gates, self._view)

    def _snapshots(self, stamp_s: float) -> tuple[PersonTrack, ...]:
        return snapshots(self._history.latest, stamp_s, self._config, self._view is not None)
