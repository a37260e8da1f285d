"""The tracks at an instant, as the tracker hands them to navigation."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Final, Literal, cast, get_args

import numpy as np

from perception.anthropometry import MEAN_STATURE_M
from perception.arrays import FloatArray, covariance_matrix, finite_array, finite_number, set_fields

from ._errors import TrackingError
from ._noticed import aware_for_s, departed_mps, noticed
from ._person import Track
from ._presence import is_over, shown_empty
from ._sensors import Sensors
from ._size import lever
from ._state import State, face_period_s
from .awareness_filter import drift_unseen, estimate
from .clock import GAP_PERIODS
from .covariances import Upper, matrices

TrackStatus = Literal["tentative", "confirmed", "coasting"]


@dataclass(frozen=True, slots=True, eq=False)
class PersonTrack:
    """An immutable snapshot of one tracked person, in the odom frame.

    Attributes:
        id: unique for the life of a tracker, never used again.
        stamp_s: time of the state.
        status: ``"tentative"`` (not confirmed yet), ``"confirmed"`` or ``"coasting"`` (not in the
            latest frame, nor in that of another sensor that is not silent).
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
        covariance_odom: (4, 4), order x, y, vx, vy.
        awareness: filtered α in [0, 1].
        awareness_std: its standard deviation, ≥ 0.
        awareness_lower: lower bound of α in [0, 1]; only this value may shrink an obstacle.
        height_m: the person's assumed stature, > 0.
        time_since_seen_s: ≥ 0, time since a frame of any sensor last showed this person.
        place_empty: whether the sensor that last saw this person should have shown them for so
            long that its next frame without them ends the track, and a scanner has seen through all
            of their place. A camera never shows a place empty. If a track ends without it, the
            person was out of sight and may still be there.
        noticed: lower bound, in [0, 1], of the probability that this person has noticed the robot
            by the looks of the last seconds; 0 unless ``noticed_memory_s`` is set.
        time_since_face_s: ≥ 0, time since the latest picture whose view of the face α rests on;
            infinite if there is none, and None from a tracker that does not say.
        aware_for_s: ≥ 0, for how long what is known of their awareness lasts at least, if they keep
            to their motion and do not look again, or 1.5 s once they look away if that is less;
            infinite where the tracker does not say.
        departed_mps: ≥ 0, speed by which their motion departs from that which they had as they
            looked, or from slowing down; 0 for somebody who has not noticed the robot.
    """

    id: int
    stamp_s: float
    status: TrackStatus
    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    covariance_odom: FloatArray
    awareness: float
    awareness_std: float
    awareness_lower: float
    height_m: float
    time_since_seen_s: float
    place_empty: bool = False
    noticed: float = 0.0
    time_since_face_s: float | None = None
    aware_for_s: float = math.inf
    departed_mps: float = 0.0

    def __post_init__(self) -> None:
        if self.status not in get_args(TrackStatus):
            raise TrackingError(
                f"status must be one of {', '.join(get_args(TrackStatus))}, got {self.status!r}"
            )
        if isinstance(self.id, bool) or int(self.id) != self.id:
            raise TrackingError(f"id must be an integer, got {self.id!r}")

        def number(name: str, low: float, high: float = float("inf")) -> float:
            return finite_number(
                name, getattr(self, name), TrackingError, minimum=low, maximum=high
            )

        set_fields(
            self,
            id=int(self.id),
            stamp_s=finite_number("stamp_s", self.stamp_s, TrackingError),
            position_odom_m=finite_array(
                "position_odom_m", self.position_odom_m, (2,), TrackingError
            ),
            velocity_odom_mps=finite_array(
                "velocity_odom_mps", self.velocity_odom_mps, (2,), TrackingError
            ),
            covariance_odom=covariance_matrix(
                "covariance_odom", self.covariance_odom, 4, TrackingError
            ),
            awareness=number("awareness", 0.0, 1.0),
            awareness_std=number("awareness_std", 0.0),
            awareness_lower=number("awareness_lower", 0.0, 1.0),
            height_m=finite_number(
                "height_m", self.height_m, TrackingError, minimum=0.0, exclusive_minimum=True
            ),
            time_since_seen_s=number("time_since_seen_s", 0.0),
            place_empty=bool(self.place_empty),
            noticed=number("noticed", 0.0, 1.0),
            departed_mps=number("departed_mps", 0.0),
        )
        if self.aware_for_s != math.inf:
            set_fields(self, aware_for_s=number("aware_for_s", 0.0))
        if self.time_since_face_s not in (None, math.inf):
            set_fields(self, time_since_face_s=number("time_since_face_s", 0.0))


_SETTERS: Final = tuple(
    cast(Any, getattr(PersonTrack, field.name)).__set__ for field in fields(PersonTrack)
)


def snapshots(state: State, stamp_s: float, sensors: Sensors) -> tuple[PersonTrack, ...]:
    """Return every track at ``stamp_s``, which is not before the state's own stamp.

    The time in between counts as unseen. It holds no frame that could have missed a person.
    """
    now_s = state.stamp_s
    if now_s is None:
        return ()
    # A track that has ended stays in the state for a second frame with the same stamp.
    people = [track for track in state.tracks if not is_over(track, now_s, state.clocks, sensors)]
    if stamp_s > now_s:
        people = [track for track in people if not is_over(track, stamp_s, state.clocks, sensors)]
    statuses = [_status(track, state, now_s) for track in people]
    if stamp_s > now_s:
        people = [track.copied() for track in people]
        for track in people:
            track.predict(now_s, stamp_s, sensors.config.acceleration_density_m2ps3)
    if not people:
        return ()
    # The snapshots share these arrays.
    states = np.array([(track.x, track.y, track.vx, track.vy) for track in people])
    covariances = matrices([_covariance(track, state) for track in people])
    states.setflags(write=False)
    covariances.setflags(write=False)
    return tuple(
        _snapshot(track, status, numbers, spread, state, stamp_s, sensors)
        for track, status, numbers, spread in zip(
            people, statuses, states, covariances, strict=True
        )
    )


def _snapshot(
    track: Track,
    status: TrackStatus,
    numbers: FloatArray,
    covariance: FloatArray,
    state: State,
    stamp_s: float,
    sensors: Sensors,
) -> PersonTrack:
    """Return a track at ``stamp_s`` without the checks of the constructor: a fifth of its time."""
    belief, faces = track.belief, state.faces
    # Frames of sensors that see no faces leave the belief where it was.
    if faces.stamp_s is not None and stamp_s > faces.stamp_s:
        period_s = face_period_s(track, faces, state.clocks, sensors)
        belief = drift_unseen(
            belief, faces.stamp_s, stamp_s, track.face_s, period_s, sensors.config.awareness
        )
    made = object.__new__(PersonTrack)
    values = (
        track.id,
        stamp_s,
        status,
        numbers[:2],
        numbers[2:],
        covariance,
        *estimate(belief),
        MEAN_STATURE_M,
        stamp_s - track.last_seen_s,
        shown_empty(track, state, sensors.config),
        noticed(track, stamp_s, state, sensors),
        stamp_s - track.face_s,
        aware_for_s(track, stamp_s, state, sensors),
        departed_mps(track),
    )
    for assign, value in zip(_SETTERS, values, strict=True):
        assign(made, value)
    return made


def _covariance(track: Track, state: State) -> Upper[float]:
    """Return the upper triangle of the covariance, with the lasting error of the range."""
    if track.lasting_std and state.origin_m is not None:
        track = track.copied()
        b = lever(track, state.origin_m, state.origin_velocity_mps)
        track.widen(b, track.lasting_std * track.lasting_std)
    return track.upper


def _status(track: Track, state: State, now_s: float) -> TrackStatus:
    """Return the status: confirmed in the latest frame of a sensor that is not silent."""
    if not track.confirmed:
        return "tentative"
    if track.last_seen_s == now_s:
        return "confirmed"
    shown = any(
        seen_s == clock.stamp_s and now_s - seen_s <= GAP_PERIODS * clock.known_period_s
        for clock, seen_s in zip(state.clocks, track.seen_s, strict=True)
    )
    return "confirmed" if shown else "coasting"
