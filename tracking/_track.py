"""A tracked person, as the tracker hands it to navigation."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final, Literal, cast, get_args

from perception.arrays import FloatArray, covariance_matrix, finite_array, finite_number, set_fields

from ._errors import TrackingError

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
        )


_SETTERS: Final = tuple(
    cast(Any, getattr(PersonTrack, field.name)).__set__ for field in fields(PersonTrack)
)


def trusted_track(*values: Any) -> PersonTrack:
    """Make a track from values in the order of its fields, without checks.

    For the tracker's own numbers only, with read-only arrays. It takes a fifth of the time of the
    constructor.
    """
    track = object.__new__(PersonTrack)
    for assign, value in zip(_SETTERS, values, strict=True):
        assign(track, value)
    return track
