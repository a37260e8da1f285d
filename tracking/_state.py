"""The state of a tracker: all tracks, and what is known of the frames so far."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

from ._config import TrackerConfig
from ._frame import Frame
from ._person import Track
from ._sensors import Sensor, Sensors
from ._views import View
from .clock import FrameClock

# Of two frames nearer to each other, the camera's velocity is not known.
_LEAST_STEP_S: Final = 1e-3
# Nearer people may be beside the robot, where no camera sees them.
_NEAR_M: Final = 3.0
#: Height of the point that represents a body.
CHEST_M: Final = 1.2
# A gap this long, or two frames, is an absence; a shorter one is a missed detection.
_ABSENCE_S: Final = 0.5


class Field(NamedTuple):
    """Where a sensor whose view is not known has seen people: around its axis, and how far.

    Nearer than 3 m it need not see anybody: beside the robot it does not.

    Attributes:
        widest_rad: largest angle to the axis.
        farthest_m: largest distance.
    """

    widest_rad: float = 0.0
    farthest_m: float = 0.0

    def after(self, tracks: Iterable[Track], frame: Frame, sensor: Sensor) -> Field:
        """Return the field after a frame that shows these people."""
        widest_rad, farthest_m = self
        for track in tracks:
            angle_rad, distance_m = _direction(track, frame, sensor)
            widest_rad, farthest_m = max(widest_rad, angle_rad), max(farthest_m, distance_m)
        return Field(widest_rad, farthest_m)

    def sees(self, track: Track, frame: Frame, sensor: Sensor) -> float:
        """Return 1 for a person where others have been seen, and 0 elsewhere."""
        angle_rad, distance_m = _direction(track, frame, sensor)
        inside = angle_rad <= self.widest_rad
        return 1.0 if inside and _NEAR_M <= distance_m <= self.farthest_m else 0.0


def _direction(track: Track, frame: Frame, sensor: Sensor) -> tuple[float, float]:
    """Return the angle between a person's chest and the axis, and the distance.

    The axis of a camera is z, that of a scanner x.
    """
    axis = 0 if sensor.settings.measures_range else 2
    T = frame.T_odom_camera[:3].tolist()
    x, y, z = track.x - T[0][3], track.y - T[1][3], CHEST_M - T[2][3]
    distance_m = math.sqrt(x * x + y * y + z * z)
    along_m = x * T[0][axis] + y * T[1][axis] + z * T[2][axis]
    return math.acos(min(max(along_m / max(distance_m, 1e-9), -1.0), 1.0)), distance_m


class State(NamedTuple):
    """Everything that frames change. A state is immutable: each frame makes a new one.

    Attributes:
        tracks: at ``stamp_s`` in the order of their ids, and their awareness at that of ``faces``.
        clocks: of each sensor's frames.
        next_id: of the next track.
        stamp_s: of the latest frame of any sensor, or None before the first.
        faces: clock of the frames of all sensors that see faces.
        fields: where each sensor has seen people so far.
        origin_m: x and y of the latest sensor without measured ranges, or None before it.
        origin_velocity_mps: of that sensor, from its latest two frames.
    """

    tracks: tuple[Track, ...]
    clocks: tuple[FrameClock, ...]
    fields: tuple[Field, ...]
    next_id: int = 1
    stamp_s: float | None = None
    faces: FrameClock = FrameClock()
    origin_m: tuple[float, float] | None = None
    origin_velocity_mps: tuple[float, float] = (0.0, 0.0)

    def at(self, frame: Frame, sensor: Sensor) -> State:
        """Return the state with the clocks, and the place of the camera, after a frame."""
        index, stamp = sensor.index, frame.stamp_s
        before, clocks = self.clocks[index], self.clocks
        origin, velocity = self.origin_m, self.origin_velocity_mps
        if not sensor.settings.measures_range:
            x_m, y_m = frame.origin_odom_m
            if origin is not None and before.dt_s(stamp) >= _LEAST_STEP_S:
                dt_s = before.dt_s(stamp)
                velocity = ((x_m - origin[0]) / dt_s, (y_m - origin[1]) / dt_s)
            origin = (x_m, y_m)
        return State(
            self.tracks,
            (*clocks[:index], before.after(stamp), *clocks[index + 1 :]),
            self.fields,
            self.next_id,
            stamp,
            self.faces.after(stamp) if sensor.settings.sees_faces else self.faces,
            origin,
            velocity,
        )


def seen_within(track: Track, which: Iterable[int], stamp_s: float, within_s: float) -> bool:
    """Return whether one of these sensors has seen a person within this time."""
    return any(stamp_s - track.seen_s[index] <= within_s for index in which)


def absence_s(period_s: float) -> float:
    """Return the shortest gap that counts as an absence, given the time between frames."""
    return max(_ABSENCE_S, 2.5 * period_s)


def evidence_interval_s(track: Track, stamp_s: float, clock: FrameClock, sensors: Sensors) -> float:
    """Return the time that a face at ``stamp_s`` stands for, given the clock after its frame.

    Two cameras whose frames come a millisecond apart must neither count as one fast camera, whose
    frames are worth little, nor as two, whose frames are worth twice as much. So a frame stands for
    the time since the last evidence about the same person, at most for the interval of its own
    sensor.
    """
    since_s = stamp_s - track.face_s
    if len(sensors.faces) < 2 or since_s <= 0.0:
        # A second face at one stamp may only lower the bound, and counts in full for that.
        return clock.interval_s
    return min(since_s, clock.interval_s)


def face_period_s(
    track: Track, faces: FrameClock, clocks: tuple[FrameClock, ...], sensors: Sensors
) -> float:
    """Return the usual time between images of a person's face.

    It is that of the sensor that gave the latest evidence, and the shortest of all where another
    frame has shown the person since.

    Args:
        track: of the person.
        faces: clock of the frames of all sensors that see faces.
        clocks: of each sensor.
        sensors: all sensors.
    """
    if len(sensors.faces) < 2:
        return faces.period_s
    gave = [index for index in sensors.faces if track.seen_s[index] == track.face_s]
    return min([clocks[index].period_s for index in gave or sensors.faces], default=math.inf)


class Step(NamedTuple):
    """One frame on its way through the tracker.

    Attributes:
        frame: the frame.
        sensor: that took it.
        sensors: all sensors.
        earlier: the state before the frame.
        state: with the clocks after it.
    """

    frame: Frame
    sensor: Sensor
    sensors: Sensors
    earlier: State
    state: State

    @property
    def config(self) -> TrackerConfig:
        """The tracker's settings."""
        return self.sensors.config

    @property
    def clock(self) -> FrameClock:
        """The clock of the sensor, this frame included."""
        return self.state.clocks[self.sensor.index]

    @property
    def clocks_before(self) -> list[FrameClock]:
        """The clocks before the frame, but with the usual time between frames after it."""
        clocks = list(self.earlier.clocks)
        own = clocks[self.sensor.index]
        clocks[self.sensor.index] = own._replace(period_s=self.clock.period_s)
        return clocks

    @property
    def dt_s(self) -> float:
        """The time since the frame before of the same sensor."""
        return self.earlier.clocks[self.sensor.index].dt_s(self.frame.stamp_s)

    @property
    def is_second(self) -> bool:
        """Whether the sensor has sent a frame with the same stamp before."""
        return self.earlier.clocks[self.sensor.index].stamp_s == self.frame.stamp_s

    @property
    def view(self) -> View | None:
        """Where people can be seen in this frame; None if unknown."""
        return self.sensor.view if self.frame.view is None else self.frame.view
