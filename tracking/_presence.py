"""Presence: whether a track is a person, and whether they are still there.

A track becomes a person by the log-likelihood ratio of its detections to clutter: the track score
of Sittler (1964) with Wald's sequential test, as in Blackman and Popoli, "Design and Analysis of
Modern Tracking Systems" (1999), chapter 6. A person is given up soon if frames should have shown
them and did not. How surely a frame should have shown them depends on the view and on the people
who stand in front.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.matrices import larger_eigenvalue

from ._config import TrackerConfig
from ._errors import TrackingError
from ._person import Track
from ._sensors import Sensor, Sensors
from ._state import State, Step
from ._views import RangedView
from .clock import FrameClock

# The share of people who are missed so often in a row that a tentative track gives them up.
_GIVEN_UP: Final = 0.01
# One frame counts for at most this share of max_missed_s, however long the pause before it.
_MAX_SHARE_OF_ONE_FRAME: Final = 0.5
# A place is empty if nobody is within so many standard deviations of where the person should be.
_PLACE_SIGMAS: Final = 2.0
_TURN: Final = 2.0 * math.pi


def evidence_of(distance2: float, log_det: float, sensor: Sensor) -> float:
    """Return ln(P_D N(z; ẑ, S) / β) of a detection: of the track, or clutter.

    β follows from ``miss_cost``.

    Args:
        distance2: squared Mahalanobis distance d² of the measurement.
        log_det: ln det S.
        sensor: that took it.
    """
    return 0.5 * (sensor.gates.miss_cost - distance2 - log_det) + sensor.log_missed


def weight_of(dt_s: float, config: TrackerConfig) -> float:
    """Return the weight of a frame ``dt_s`` after the one before, for tracks not confirmed yet.

    Frames closer than ``detection_correlation_s`` share their errors, clutter included. So a frame
    counts in proportion to the time that it stands for, and a faster camera adds no certainty. A
    second frame with one stamp adds nothing.
    """
    if dt_s <= 0.0:
        return 0.0
    if config.detection_correlation_s <= 0.0:
        return 1.0
    return min(1.0, dt_s / config.detection_correlation_s)


def confirming_logit(period_s: float, config: TrackerConfig) -> float:
    """Return the evidence that confirms a track, given the time between frames.

    By Wald's bound, clutter confirms at most exp(−logit) of the tracks that it starts. It starts
    more of them per second with a faster camera, so the logit depends on the frame rate such that
    the number of false people per second does not.
    """
    return config.confirm_logit - math.log(period_s)


def record_hit(track: Track, step: Step) -> None:
    """Take a frame that shows the person; it may confirm the track.

    A second set of measurements with the same stamp is not another hit.
    """
    stamp, period_s, config = step.frame.stamp_s, step.clock.period_s, step.config
    if track.hits_s[-1] < stamp:
        track.hits_s = [*track.hits_s, stamp][-config.confirm_hits :]
    track.seen_s[step.sensor.index] = stamp
    track.standing = track.stands(config.standing_speed_mps)
    if track.confirmed:
        return
    window_s = config.confirm_window_s
    if period_s < math.inf:
        window_s = max(window_s, (config.confirm_hits + 1) * period_s)
        track.confirmed = track.logit >= confirming_logit(period_s, config)
    enough = len(track.hits_s) == config.confirm_hits and stamp - track.hits_s[0] <= window_s
    track.confirmed = track.confirmed or enough


def tentative_gap_s(clock: FrameClock, sensor: Sensor, config: TrackerConfig) -> float:
    """Return the time after which an unseen tentative track is deleted.

    It covers as many frames in a row as miss a person in all but 1 % of cases, and at least
    ``max_tentative_gap_s``.
    """
    frames = math.ceil(math.log(_GIVEN_UP) / sensor.log_missed - 1e-9)
    return max(config.max_tentative_gap_s, (frames + 0.5) * clock.known_period_s)


def coasted_too_long(track: Track, stamps_s: Sequence[float], sensors: Sensors) -> bool:
    """Return whether no sensor has seen a person for too long, each judged at its own stamp."""
    return all(
        stamp_s - seen_s > _longest_coast_s(track, sensor, sensors.config)
        for stamp_s, seen_s, sensor in zip(stamps_s, track.seen_s, sensors.all, strict=True)
    )


def _longest_coast_s(track: Track, sensor: Sensor, config: TrackerConfig) -> float:
    if track.standing and sensor.view is not None:
        return max(config.max_standing_coast_s, config.max_coast_s)
    return config.max_coast_s


def is_expired(track: Track, stamp_s: float, state: State, sensors: Sensors) -> bool:
    """Return whether a frame at ``stamp_s`` can no longer match a track of the state before.

    A track that the last frame has left alive gets a chance in this one, however long the interval.
    """
    config = sensors.config
    if not track.confirmed:
        return stamp_s - track.last_seen_s > max(config.max_coast_s, config.max_tentative_gap_s)
    stamps_s = [stamp_s - clock.known_period_s for clock in state.clocks]
    return coasted_too_long(track, stamps_s, sensors)


def is_over(track: Track, step: Step) -> bool:
    """Return whether a frame that does not show a track ends it.

    Each sensor judges by its own frames, and all must agree. So a track is never given up sooner
    than it would be with one of the sensors alone. A sensor that has never seen a person agrees.
    The others judge one usual interval before the frame, since their next one may show the person.
    """
    config, stamp = step.config, step.frame.stamp_s
    for sensor, clock, seen_s in zip(
        step.sensors.all, step.state.clocks, track.seen_s, strict=True
    ):
        gap_s = stamp - (0.0 if sensor is step.sensor else clock.known_period_s) - seen_s
        if not track.confirmed:
            lost = gap_s > tentative_gap_s(clock, sensor, config)
        else:
            lost = gap_s > _longest_coast_s(track, sensor, config)
            lost = lost or track.missed_s[sensor.index] > config.max_missed_s
        if not lost:
            return False
    return True


def record_misses(tracks: list[Track], step: Step) -> None:
    """Take a frame into ``missed_s`` and ``passed_s`` of the tracks after it.

    The time since the sensor's previous frame counts in proportion to how surely this frame should
    have shown the person. Only people in this frame can hide others. Without a view it is 0.
    """
    frame, config, dt_s, view = step.frame, step.config, step.dt_s, step.view
    index, stamp = step.sensor.index, frame.stamp_s
    seen = []
    unseen = []
    for track in tracks:
        track.passed_s[index] = -math.inf
        if track.seen_s[index] == stamp:
            track.missed_s[index] = 0.0
            seen.append(track)
        elif track.confirmed:
            unseen.append(track)
    if view is None or not unseen:
        return
    places = np.array([(track.x, track.y) for track in unseen])
    if dt_s > 0.0:
        share_s = min(dt_s, _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
        in_view = np.asarray(view.visibility(places, frame.T_odom_camera), dtype=np.float64)
        if in_view.shape != (len(unseen),) or not ((in_view >= 0.0) & (in_view <= 1.0)).all():
            raise TrackingError(
                f"view.visibility must return one number in [0, 1] per position, {len(unseen)} in "
                f"all, got shape {in_view.shape}: {in_view!r:.80}"
            )
        people = [(track.x, track.y) for track in seen]
        for track, visible in zip(unseen, in_view.tolist(), strict=True):
            if visible > 0.0:
                place = (track.x, track.y)
                share = unoccluded_share(place, people, frame.origin_odom_m, config.body_radius_m)
                track.missed_s[index] += visible * share * share_s
    if isinstance(view, RangedView):
        # The place is as large as a body and two standard deviations of the position.
        radii = [
            config.body_radius_m
            + _PLACE_SIGMAS * math.sqrt(larger_eigenvalue(track.p00, track.p01, track.p11))
            for track in unseen
        ]
        passed = view.passed(places, np.array(radii), frame.T_odom_camera).tolist()
        for track, empty in zip(unseen, passed, strict=True):
            if empty:
                track.passed_s[index] = stamp


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
    last = track.seen_s.index(max(track.seen_s))
    share_s = min(late_s[last], _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
    if track.missed_s[last] + share_s <= config.max_missed_s:
        return False
    return any(
        seen_s >= track.last_seen_s - config.max_missed_s and passed_s >= now_s - late
        for seen_s, passed_s, late in zip(track.seen_s, track.passed_s, late_s, strict=True)
    )


def unoccluded_share(
    place_m: tuple[float, float],
    others_m: Sequence[tuple[float, float]],
    camera_m: tuple[float, float],
    radius_m: float,
) -> float:
    """Return in [0, 1] the share of a body that no nearer body hides.

    Bodies are upright cylinders, so each covers an interval of bearings on the floor plane. The
    shares that several people hide are summed: two people side by side can hide a third completely.

    Args:
        place_m: x and y of the body.
        others_m: of the other people.
        camera_m: of the camera, in the same frame.
        radius_m: > 0, of every body.
    """
    bearing, distance, half = _interval(place_m, camera_m, radius_m)
    hidden = 0.0
    for other in others_m:
        front, front_distance, front_half = _interval(other, camera_m, radius_m)
        if front_distance + radius_m > distance:
            continue
        apart = abs((bearing - front + math.pi) % _TURN - math.pi)
        overlap = min(half, apart + front_half) - max(-half, apart - front_half)
        hidden += min(max(overlap / (2.0 * half), 0.0), 1.0)
    return max(1.0 - hidden, 0.0)


def _interval(
    place_m: tuple[float, float], camera_m: tuple[float, float], radius_m: float
) -> tuple[float, float, float]:
    """Return bearing, distance and angular half-width of a body."""
    x, y = place_m[0] - camera_m[0], place_m[1] - camera_m[1]
    distance = math.hypot(x, y)
    return math.atan2(y, x), distance, math.asin(radius_m / max(distance, radius_m))
