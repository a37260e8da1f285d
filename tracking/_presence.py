"""Presence: the log-odds that a track is a person who is there.

One number confirms, keeps and ends a track. Each frame of a sensor moves it:

- a hit adds the log-likelihood ratio of the detection to clutter: the track score of Sittler (1964)
  with Wald's sequential test, as in Blackman and Popoli, "Design and Analysis of Modern Tracking
  Systems" (1999), chapter 6. Above a limit the track is a person, and each further hit says that
  the person is there for sure;
- a miss takes as much as the frame should have shown the person, by the sensor's view and the
  people who stand in front;
- time takes a little while the person cannot be seen: people also leave out of sight.

Each sensor that has seen a person has its own number, and the largest counts. So a track is never
given up sooner than it would be with one of the sensors alone, one of which may not see the person
for a reason that its view does not know.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M, MEAN_STATURE_M
from perception.matrices import larger_eigenvalue

from ._config import TrackerConfig
from ._errors import TrackingError
from ._person import Track
from ._sensors import Sensor, Sensors
from ._state import State, Step
from ._views import CHEST_M, RangedView
from .clock import FrameClock

# Log-odds that somebody is there whom a frame has just shown.
_SURE: Final = 8.0 * math.log(10.0)
# P_D, the share of frames that report a person in sight, and the evidence of one that does not.
_DETECTION_PROBABILITY: Final = 0.9
_LOG_MISSED: Final = math.log1p(-_DETECTION_PROBABILITY)
# Frames closer than this share their errors, clutter included, and count in proportion.
_CORRELATION_S: Final = 0.12
# Somebody who stood still is kept for this long while nobody could see them.
_STANDING_COAST_S: Final = 5.0
# A tentative track outlives as many missed frames in a row as happen to 1 % of people.
_GIVEN_UP: Final = 1.25 * math.log(0.01)
# One frame counts for at most this share of max_missed_s, however long the pause before it.
_MAX_SHARE_OF_ONE_FRAME: Final = 0.5
# The evidence of one frame. At 10 Hz or faster it takes two to confirm a new track.
_MOST_OF_ONE_FRAME: Final = 4.5
# A detector may report a person twice, with a second place as near as this in this share of frames;
# people who stand as near to another are detected in that share. Both places are as steady, so that
# only hits and misses tell them apart.
_BESIDE_M: Final = 0.5
_DOUBLE_SHARE: Final = 0.25
_BESIDE_SHARE: Final = 0.65
_BESIDE_HIT: Final = math.log(_BESIDE_SHARE / _DOUBLE_SHARE)
_BESIDE_MISS: Final = math.log((1.0 - _BESIDE_SHARE) / (1.0 - _DOUBLE_SHARE))
# A place is empty if nobody is within so many standard deviations of where the person should be.
_PLACE_SIGMAS: Final = 2.0
_TURN: Final = 2.0 * math.pi
# Rounding must not end a track one frame sooner.
_ROUNDING: Final = 1e-9


def hit_evidence(distance2: float, log_det: float, beside: bool, step: Step) -> float:
    """Return ln(P_D N(z; ẑ, S) / β) of a detection: of the track, or clutter of density β.

    β follows from ``miss_cost``.

    Args:
        distance2: squared Mahalanobis distance d² of the measurement.
        log_det: ln det S.
        beside: whether it may be the double of another person's.
        step: the frame.
    """
    gain = 0.5 * (step.config.miss_cost - distance2 - log_det) + _LOG_MISSED
    return min(gain, _BESIDE_HIT) if beside else gain


def record_hit(track: Track, gain: float, stands_for_s: float, step: Step) -> None:
    """Take a frame that shows a track; it may confirm it.

    By Wald's bound, clutter confirms at most exp(−logit) of the tracks that it starts. It starts
    more of them per second with a faster camera, so the logit depends on the frame rate such that
    the number of false people per second does not.

    Args:
        track: corrected with the frame.
        gain: the evidence of its detection.
        stands_for_s: time that the frame stands for.
        step: the frame.
    """
    index, stamp, period_s = step.sensor.index, step.frame.stamp_s, step.clock.period_s
    second = step.is_second and track.seen_s[index] < stamp
    track.seen_s[index] = track.last_seen_s = stamp
    track.standing = track.stands()
    if track.confirmed:
        track.presence[index] = _SURE
        return
    before = max(
        _left(track, sensor, clock, stamp, step.config)
        for sensor, clock in zip(step.sensors.all, step.clocks_before, strict=True)
    )
    if second:
        # The first of two frames with this stamp did not show the person, but the second does.
        before += track.lost
    counted = _weight(stands_for_s) * gain
    track.presence[index] = before + min(max(counted, 0.0), _MOST_OF_ONE_FRAME)
    if period_s < math.inf:
        needed = step.config.confirm_logit - math.log(period_s)
        if track.presence[index] >= needed:
            track.confirmed, track.presence[index] = True, _SURE


def record_misses(tracks: list[Track], step: Step) -> None:
    """Take a frame into the presence of the tracks that it does not show, after the frame.

    The time since the sensor's previous frame counts in proportion to how surely this frame should
    have shown the person. Only people in this frame can hide others.
    """
    index, stamp, dt_s = step.sensor.index, step.frame.stamp_s, step.dt_s
    unseen = []
    shown = []
    for track in tracks:
        track.passed_s[index] = -math.inf
        if track.seen_s[index] == stamp:
            shown.append(track)
        else:
            unseen.append(track)
    if not unseen:
        return
    if dt_s > 0.0:
        visibility = _visibility(unseen, shown, step)
        for track, visible in zip(unseen, visibility, strict=True):
            if track.presence[index] > -math.inf:
                track.lost = _loss(track, visible, dt_s, tracks, step)
                track.presence[index] -= track.lost
    _record_empty_places([track for track in unseen if track.confirmed], step)


def _loss(track: Track, visible: float, dt_s: float, tracks: Sequence[Track], step: Step) -> float:
    """Return what a frame takes that should have shown a track by ``visible`` in [0, 1]."""
    config, sensor = step.config, step.sensor
    hidden_s = (1.0 - visible) * dt_s
    lost = hidden_s * _fading_per_s(track, sensor, config)
    # How much less likely the frame is with the person there, as a share of a person in full view.
    share = math.log1p(-_DETECTION_PROBABILITY * visible) / _LOG_MISSED
    if track.confirmed:
        counted_s = min(dt_s, _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
        return lost + share * counted_s * _SURE / config.max_missed_s
    miss = _BESIDE_MISS if is_beside(track, tracks, step) else _LOG_MISSED
    return lost - share * _weight(dt_s) * miss


def _weight(dt_s: float) -> float:
    """Return the weight of a frame ``dt_s`` after the one before, for tracks not confirmed yet.

    A frame counts in proportion to the time that it stands for, so a faster camera adds no
    certainty. A second frame with one stamp adds nothing.
    """
    return min(dt_s / _CORRELATION_S, 1.0)


def _fading_per_s(track: Track, sensor: Sensor, config: TrackerConfig) -> float:
    """Return what each second takes in which a sensor cannot see a person."""
    kept_s = config.max_coast_s
    if track.standing and sensor.view is not None:
        kept_s = max(_STANDING_COAST_S, kept_s)
    return _SURE / max(kept_s, 1e-9)


def is_beside(track: Track, tracks: Iterable[Track], step: Step) -> bool:
    """Return whether a track may be the double of one that is surer.

    It is as near as the track's place is known, and confirmed, older, or as old and nearer to the
    sensor.
    """
    x, y, _ = step.place_m
    reach_m = _BESIDE_M + math.sqrt(track.p00 + track.p11)
    own = track.born_s, math.hypot(track.x - x, track.y - y)
    for other in tracks:
        if abs(track.x - other.x) > reach_m or other is track:
            continue
        if (track.x - other.x) ** 2 + (track.y - other.y) ** 2 > reach_m * reach_m:
            continue
        if other.confirmed or (other.born_s, math.hypot(other.x - x, other.y - y)) < own:
            return True
    return False


def _left(
    track: Track, sensor: Sensor, clock: FrameClock, stamp_s: float, config: TrackerConfig
) -> float:
    """Return the log-odds of one sensor at a stamp before which no further frame of it has come.

    Its next frame, one usual interval after the last, may still show the person.
    """
    presence = track.presence[sensor.index]
    if presence == -math.inf or clock.stamp_s is None:
        return -math.inf
    silent_s = stamp_s - clock.stamp_s - min(clock.known_period_s, config.max_coast_s)
    if silent_s <= 0.0:
        return presence
    return presence - silent_s * _fading_per_s(track, sensor, config)


def is_over(track: Track, stamp_s: float, clocks: Sequence[FrameClock], sensors: Sensors) -> bool:
    """Return whether a track has ended at a stamp, without frames since those of the clocks."""
    config = sensors.config
    unseen_s = stamp_s - track.last_seen_s
    if track.confirmed and unseen_s < min(config.max_missed_s, config.max_coast_s):
        return False  # not even misses in full view end it so soon
    for sensor, clock in zip(sensors.all, clocks, strict=True):
        gone = 0.0
        if not track.confirmed:
            period_s = clock.known_period_s
            gone = _GIVEN_UP * (_weight(period_s) if period_s > 0.0 else 1.0)
        if _left(track, sensor, clock, stamp_s, config) >= gone - _ROUNDING:
            return False
    return True


def _visibility(unseen: list[Track], shown: list[Track], step: Step) -> list[float]:
    """Return how surely a frame should have shown each of the tracks that it does not show.

    Evaluated at the track's position only, not over its uncertainty: an empty visible part of the
    uncertain area does not rule out a person in the hidden part.
    """
    if step.view is None:
        field = step.state.fields[step.sensor.index]
        in_view = [field.sees(track, step) if track.confirmed else 1.0 for track in unseen]
    else:
        places = np.array([(track.x, track.y) for track in unseen])
        found = np.asarray(step.view.visibility(places, step.frame.T_odom_camera), np.float64)
        if found.shape != (len(unseen),) or not ((found >= 0.0) & (found <= 1.0)).all():
            raise TrackingError(
                f"view.visibility must return one number in [0, 1] per position, {len(unseen)} in "
                f"all, got shape {found.shape}: {found!r:.80}"
            )
        in_view = found.tolist()
    front = Occluders(shown, step.place_m)
    return [
        visible and visible * front.unhidden(track)
        for track, visible in zip(unseen, in_view, strict=True)
    ]


def _record_empty_places(unseen: list[Track], step: Step) -> None:
    """Note whose places the frame has shown empty: as large as a body and two σ of the position."""
    if not unseen or not isinstance(step.view, RangedView):
        return
    places = np.array([(track.x, track.y) for track in unseen])
    radii = [
        BODY_RADIUS_M
        + _PLACE_SIGMAS * math.sqrt(larger_eigenvalue(track.p00, track.p01, track.p11))
        for track in unseen
    ]
    passed = step.view.passed(places, np.array(radii), step.frame.T_odom_camera).tolist()
    for track, empty in zip(unseen, passed, strict=True):
        if empty:
            track.passed_s[step.sensor.index] = step.frame.stamp_s


def shown_empty(track: Track, state: State, config: TrackerConfig) -> bool:
    """Return whether the next frame without the person would end the track, rightly.

    The sensor that saw the person last must have missed them: another one may never have been able
    to see them, for a reason that its view does not know. And the latest frame of it, or of a
    sensor that saw them until shortly before, must have shown the place empty. Frames may come as
    much as a half later than usual.
    """
    now_s = state.stamp_s
    if now_s is None or not track.confirmed or max(track.passed_s) == -math.inf:
        return False
    late_s = [1.5 * clock.known_period_s for clock in state.clocks]
    last = track.seen_s.index(track.last_seen_s)
    share_s = min(late_s[last], _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
    if track.presence[last] >= share_s * _SURE / config.max_missed_s:
        return False
    return any(
        seen_s >= track.last_seen_s - config.max_missed_s and passed_s >= now_s - late
        for seen_s, passed_s, late in zip(track.seen_s, track.passed_s, late_s, strict=True)
    )


class Occluders:
    """People who hide others: upright cylinders, each of which covers an interval of bearings.

    They cover it as far up as people are tall: a camera high up sees a chest over their heads.

    Args:
        people: who stand in front.
        camera_m: x, y and height of the camera, in odom.
    """

    def __init__(self, people: Iterable[Track], camera_m: tuple[float, float, float]) -> None:
        self._camera_m = camera_m
        # In the order of their bearings, so that only neighbours are compared.
        self._people = sorted(self._interval(track.x, track.y) for track in people)
        self._bearings = [bearing for bearing, _, _ in self._people]
        self._widest = max((half for _, _, half in self._people), default=0.0)

    def _interval(self, x: float, y: float) -> tuple[float, float, float]:
        """Return bearing, distance and angular half-width of a body."""
        east, north = x - self._camera_m[0], y - self._camera_m[1]
        distance = math.hypot(east, north)
        half = math.asin(BODY_RADIUS_M / max(distance, BODY_RADIUS_M))
        return math.atan2(north, east), distance, half

    def unhidden(self, track: Track) -> float:
        """Return in [0, 1] the share of a body that no nearer body hides.

        The shares that several people hide are summed: two people side by side can hide a third
        completely.
        """
        bearing, distance, half = self._interval(track.x, track.y)
        height_m, hidden = self._camera_m[2], 0.0
        for turn in (-_TURN, 0.0, _TURN):
            reach = half + self._widest
            first = bisect_left(self._bearings, bearing + turn - reach)
            last = bisect_right(self._bearings, bearing + turn + reach)
            for front, front_distance, front_half in self._people[first:last]:
                if front_distance + BODY_RADIUS_M > distance:
                    continue
                seen_at_m = height_m + (CHEST_M - height_m) * front_distance / distance
                if seen_at_m > MEAN_STATURE_M:
                    continue
                apart = abs(bearing + turn - front)
                overlap = min(half, apart + front_half) - max(-half, apart - front_half)
                hidden += min(max(overlap / (2.0 * half), 0.0), 1.0)
        return max(1.0 - hidden, 0.0)
