"""The state of a tracker: all tracks, and what is known of the frames so far."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

from ._config import TrackerConfig
from ._frame import Frame
from ._person import Track
from ._sensors import Sensor, Sensors
from ._views import CHEST_M, View
from .clock import GAP_PERIODS, FrameClock

# Of two frames nearer to each other, the camera's velocity is not known.
_LEAST_STEP_S: Final = 1e-3
# Nearer people may be beside the robot, where no camera sees them.
_NEAR_M: Final = 3.0
# A gap this long, or two frames, is an absence; a shorter one is a missed detection.
_ABSENCE_S: Final = 0.5


class Field(NamedTuple):
    """The field in which a sensor without a known view has seen people: around its axis, so far.

    Nearer than 3 m it need not see anybody: beside the robot it does not.

    Attributes:
        widest_rad: largest angle to the axis.
        farthest_m: largest distance.
    """

    widest_rad: float = 0.0
    farthest_m: float = 0.0

    def after(self, tracks: Iterable[Track], step: Step) -> Field:
        """Return the field after a frame that shows these people."""
        widest_rad, farthest_m = self
        axis = _axis(step)
        for track in tracks:
            angle_rad, distance_m = _direction(track, step.place_m, axis)
            widest_rad, farthest_m = max(widest_rad, angle_rad), max(farthest_m, distance_m)
        return Field(widest_rad, farthest_m)

    def sees(self, track: Track, step: Step) -> float:
        """Return 1 for a person where others have been seen, and 0 elsewhere."""
        angle_rad, distance_m = _direction(track, step.place_m, _axis(step))
        inside = angle_rad <= self.widest_rad
        return 1.0 if inside and _NEAR_M <= distance_m <= self.farthest_m else 0.0


def _axis(step: Step) -> list[float]:
    """Return the unit vector of a sensor's axis in odom: z of a camera, x of a scanner."""
    column = 0 if step.sensor.settings.measures_range else 2
    axis: list[float] = step.frame.T_odom_camera[:3, column].tolist()
    return axis


def _direction(
    track: Track, place_m: tuple[float, float, float], axis: list[float]
) -> tuple[float, float]:
    """Return the angle between a person's chest and the axis of a sensor, and the distance."""
    x, y, z = track.x - place_m[0], track.y - place_m[1], CHEST_M - place_m[2]
    distance_m = math.sqrt(x * x + y * y + z * z)
    cosine = (x * axis[0] + y * axis[1] + z * axis[2]) / max(distance_m, 1e-9)
    return math.acos(min(max(cosine, -1.0), 1.0)), distance_m


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

    def at(self, frame: Frame, sensor: Sensor, place_m: tuple[float, float, float]) -> State:
        """Return the state with the clocks, and the place of the camera, after a frame."""
        index, stamp = sensor.index, frame.stamp_s
        before, clocks = self.clocks[index], self.clocks
        origin, velocity = self.origin_m, self.origin_velocity_mps
        if not sensor.settings.measures_range:
            dt_s = before.dt_s(stamp)
            if origin is not None and dt_s >= _LEAST_STEP_S:
                velocity = ((place_m[0] - origin[0]) / dt_s, (place_m[1] - origin[1]) / dt_s)
            origin = place_m[:2]
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
    for index in which:  # noqa: SIM110 - half the time of a generator, for every track
        if stamp_s - track.seen_s[index] <= within_s:
            return True
    return False


def absence_s(period_s: float) -> float:
    """Return the shortest gap that counts as an absence, given the time between frames."""
    return max(_ABSENCE_S, GAP_PERIODS * period_s)


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
        config: the tracker's settings.
        earlier: the state before the frame.
        state: with the clocks after it.
        clock: of the sensor, this frame included.
        clocks_before: the clocks before the frame, but with the sensor's usual time between frames
            after it.
        dt_s: time since the frame before of the same sensor.
        place_m: x, y, z of the sensor in odom.
        view: where people can be seen in this frame; None if unknown.
    """

    frame: Frame
    sensor: Sensor
    sensors: Sensors
    config: TrackerConfig
    earlier: State
    state: State
    clock: FrameClock
    clocks_before: tuple[FrameClock, ...]
    dt_s: float
    place_m: tuple[float, float, float]
    view: View | None

    @staticmethod
    def of(frame: Frame, earlier: State, sensors: Sensors) -> Step:
        """Return the step from a state by one more frame."""
        sensor, clocks, index = sensors.all[frame.sensor], earlier.clocks, frame.sensor
        x, y, z = frame.T_odom_camera[:3, 3].tolist()
        state = earlier.at(frame, sensor, (x, y, z))
        own = clocks[index]._replace(period_s=state.clocks[index].period_s)
        return Step(
            frame,
            sensor,
            sensors,
            sensors.config,
            earlier,
            state,
            state.clocks[index],
            (*clocks[:index], own, *clocks[index + 1 :]),
            clocks[index].dt_s(frame.stamp_s),
            (x, y, z),
            sensor.view if frame.view is None else frame.view,
        )

    @property
    def is_second(self) -> bool:
        """Whether the sensor has sent a frame with the same stamp before."""
        return self.earlier.clocks[self.sensor.index].stamp_s == self.frame.stamp_s
