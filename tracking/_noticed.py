"""A belief that a person has noticed the robot, from the looks of the last seconds.

α(t) tells whether somebody looks now; a person who has looked for half a second knows of the robot
for some seconds more. The belief is a lower bound of the probability of that, 1 − exp(−looks / τ),
where looks is the time in which the person has looked, each frame with a weight of how certain it
is that α is at least a half. While frames show the person without a look, looks decays. A further
look never lowers the belief.

A look is no promise: people often look before they set off. So the belief is dropped, until there
are new looks, by anything that makes it doubtful who this is or what they do:

- a face that looks away, in more than one frame, of somebody who does not walk away;
- an ambiguous match, unless the rival has noticed the robot as well, or a place that jumps;
- a gap in what the other sensors see, once no look is recent;
- cameras that have fallen silent: nobody would see a face that looks away;
- somebody who stood since the last look and moves, or who comes faster towards the robot than on
  the course that they had then, at the least speed since then;
- ``noticed_memory_s`` after the last look.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import mahalanobis2

from ._clocks import FrameClock
from ._faces import face_period_s
from ._matching import Found
from ._measurement import Frame
from ._sensors import Sensors
from ._table import BoolArray, TrackTable
from .awareness_filter import grace_s

# Half a second of certain looks gives a belief of a half.
_LOOKING_S: Final = 0.5 / math.log(2.0)
# Time constant with which looks decay while the person is seen without a look.
_FORGETTING_S: Final = 3.0
# A frame is a look if it is so certain, from 0 to 1, that α is at least a half: by 0.7 σ.
_LOOK: Final = 0.5
# A face looks away if α is at most this, and below a half by one standard deviation: with the
# default cone it points more than 57° off the robot. A person who passes the robot and looks ahead
# still has it in the corner of the eye.
_AVERTED_AWARENESS: Final = 0.1
_AVERTED_SIGMAS: Final = -1.0
_AVERTED_LOGIT: Final = math.log(_AVERTED_AWARENESS / (1.0 - _AVERTED_AWARENESS))
# One frame may be wrong about a face, and two are not both by chance.
_AVERTED_S: Final = 0.09
# Somebody walks at this speed or faster: three standard deviations of a velocity from scans.
_WALKING_MPS: Final = 0.4
# Cameras that are silent for longer than this see no face that looks away.
_BLIND_S: Final = 0.5
# Two scans in a row without the person, or as long a silence, are a gap.
_GAP_PERIODS: Final = 2.5
# How much faster towards the robot than before: 2.5 σ of a velocity from scans. Speed and
# separation takes the measured speed towards the robot in any case.
_FASTER_MPS: Final = 0.4
# A person who stood has begun to move at this speed, if it is not 0 by 99.7 % (χ², two degrees).
_STARTED_MPS: Final = 0.25
_STARTED_CHI2: Final = 11.6
# χ² with two degrees of freedom of a measurement beyond which it may be somebody else: 99.9 %.
_JUMP_CHI2: Final = 13.8


def with_noticed(
    before: TrackTable,
    after: TrackTable,
    frame: Frame,
    found: Found,
    faces: FrameClock,
    dt_s: float,
    clocks: tuple[FrameClock, ...],
    sensors: Sensors,
) -> TrackTable:
    """Return the tracks with the belief that they have noticed the robot after one frame.

    Args:
        before: N tracks, predicted to the frame.
        after: the same with the frame's measurements, and new tracks.
        frame: of any sensor.
        found: which of them the frame shows.
        faces: clock of the frames with faces before this one.
        dt_s: since the frame before of the same sensor.
        clocks: of all sensors, this frame included.
        sensors: all sensors.
    """
    config = sensors.config.awareness
    if config.noticed_memory_s <= 0.0 or sensors.faces.all() or not len(after):
        return after
    stamp, sees_faces = frame.stamp_s, sensors.all[frame.sensor].settings.sees_faces
    looks, averted = _looks(after, frame, found, sensors)
    if not (looks > 0.0).any() and not (after.looked_s > 0.0).any():
        return after
    looking = looks > 0.0
    dt_s = min(dt_s, config.max_evidence_gap_s) if sees_faces else 0.0
    towards = _towards(after, frame)
    # Whoever walks away looks where they go, and has to turn round first.
    away = (towards * after.states[:, 2:]).sum(axis=1) < 0.0
    averted &= ~(away & (np.hypot(after.states[:, 2], after.states[:, 3]) >= _WALKING_MPS))
    averted_s = np.where(looking, 0.0, after.averted_s + averted * dt_s)
    dropped = _jumped(before, after, frame, found) | (averted_s > _AVERTED_S)
    after = _with_doubt(after, found)
    # After a gap nobody knows that it is the same person; a new look excuses motion alone.
    period_s = face_period_s(after, faces, clocks, sensors)
    gap_s = _longest_gap_s(period_s, config.max_evidence_gap_s)
    recent_s = np.where(looking, gap_s, grace_s(period_s, config))
    ended = stamp - after.look_stamps_s > config.noticed_memory_s
    ended |= _is_blind(stamp, faces)
    ended |= _interrupted(before, after, stamp, recent_s, clocks, sensors)
    ended |= _set_off(after, towards) & ~looking
    looked_s = np.where(dropped | ended, 0.0, after.looked_s)
    # What they do from the last look on.
    velocities = after.states[:, 2:]
    speeds_mps = np.hypot(velocities[:, 0], velocities[:, 1])
    least_mps = np.minimum(after.look_speeds_mps, speeds_mps)
    stood = after.look_standing | after.standing
    if not sees_faces:
        return after.replaced(looked_s=looked_s, look_speeds_mps=least_mps, look_standing=stood)
    fades = found.seen & ~looking
    looked_s = np.where(fades, math.exp(-dt_s / _FORGETTING_S), 1.0) * looked_s
    # A look after a pause stands for one frame, not for the pause.
    since_s = stamp - after.look_stamps_s
    follows = since_s <= config.max_evidence_gap_s
    # Of two cameras, only the time since the last look of either.
    usual_s = np.minimum(dt_s, period_s) if sensors.several_faces else min(dt_s, faces.period_s)
    stands_for_s = np.where(follows, np.fmin(dt_s, since_s), usual_s)
    looked_s += np.where(dropped | found.ambiguous, 0.0, looks * stands_for_s)
    return after.replaced(
        looked_s=looked_s,
        look_stamps_s=np.where(looking, stamp, after.look_stamps_s),
        look_velocities_mps=np.where(looking[:, None], velocities, after.look_velocities_mps),
        look_speeds_mps=np.where(looking, speeds_mps, least_mps),
        look_standing=np.where(looking, after.standing, stood),
        averted_s=averted_s,
    )


def _is_blind(stamp_s: float, faces: FrameClock) -> bool:
    """Return whether no camera has sent a frame for so long that nobody would see a face."""
    if faces.stamp_s is None:
        return True
    usual_s = faces.period_s if math.isfinite(faces.period_s) else 0.0
    return stamp_s - faces.stamp_s > max(_BLIND_S, _GAP_PERIODS * usual_s)


def _with_doubt(tracks: TrackTable, found: Found) -> TrackTable:
    """Return the tracks where an ambiguous match leaves no more belief than its rival has.

    If two people may have been exchanged, what holds for both holds for each of them still.
    """
    if not found.ambiguous.any():
        return tracks
    looked_s, stamps = tracks.looked_s.copy(), tracks.look_stamps_s.copy()
    known = np.zeros(len(tracks), dtype=np.bool_)
    doubtful, rivals = found.rivals.T
    known[doubtful] = True
    nobody = rivals < 0
    np.minimum.at(looked_s, doubtful, np.where(nobody, 0.0, tracks.looked_s[rivals]))
    np.fmin.at(stamps, doubtful, tracks.look_stamps_s[np.where(nobody, doubtful, rivals)])
    looked_s[found.ambiguous & ~known] = 0.0
    return tracks.replaced(looked_s=looked_s, look_stamps_s=stamps)


def _longest_gap_s(period_s: float | FloatArray, least_s: float) -> float | FloatArray:
    """Return the longest time between two looks of one spell, given the time between faces."""
    if isinstance(period_s, np.ndarray):
        known_s = np.where(np.isfinite(period_s), period_s, 0.0)
        return np.maximum(least_s, _GAP_PERIODS * known_s)
    return max(least_s, _GAP_PERIODS * period_s) if math.isfinite(period_s) else least_s


def noticed(
    tracks: TrackTable,
    stamp_s: float,
    faces: FrameClock,
    clocks: tuple[FrameClock, ...],
    sensors: Sensors,
) -> FloatArray:
    """Return (N,) in [0, 1]: the lower bound of the probability that people have noticed the robot.

    It is 0 for tentative tracks, and where the latest look is no longer recent and no other sensor
    sees the person.
    """
    config = sensors.config.awareness
    if config.noticed_memory_s <= 0.0 or not (tracks.looked_s > 0.0).any():
        return np.zeros(len(tracks))
    if _is_blind(stamp_s, faces):
        return np.zeros(len(tracks))
    age_s = stamp_s - tracks.look_stamps_s
    counts = tracks.confirmed & (age_s <= config.noticed_memory_s)
    held = _held(tracks, stamp_s, clocks, sensors)
    counts &= held | (age_s <= grace_s(face_period_s(tracks, faces, clocks, sensors), config))
    return np.where(counts, -np.expm1(-tracks.looked_s / _LOOKING_S), 0.0)


def _looks(
    tracks: TrackTable, frame: Frame, found: Found, sensors: Sensors
) -> tuple[FloatArray, BoolArray]:
    """Return (N,) in [0, 1], how certainly each looks at the robot, and (N,) who looks away."""
    looks, averted = np.zeros(len(tracks)), np.zeros(len(tracks), dtype=np.bool_)
    if not sensors.all[frame.sensor].settings.sees_faces:
        return looks, averted
    rows = np.flatnonzero(found.seen)
    measured, columns = frame.measurements, found.source[rows]
    # In standard deviations above α = 0.5, whose logit is 0.
    sigmas = measured.evidence_means[columns] / np.sqrt(measured.evidence_variances[columns])
    averted[rows] = (sigmas <= _AVERTED_SIGMAS) & (
        measured.evidence_means[columns] <= _AVERTED_LOGIT
    )
    sure = tracks.confirmed[rows] & ~found.beyond[rows] & ~measured.weak[columns]
    # 2 Φ(σ) − 1.
    certainty = np.array([max(math.erf(each), 0.0) for each in (math.sqrt(0.5) * sigmas).tolist()])
    looks[rows] = np.where(sure & (certainty >= _LOOK), certainty, 0.0)
    if tracks.twins.any():
        # A frame that shows a person and their twin counts as the lower of both.
        twins = np.flatnonzero(tracks.twins & found.seen)
        hosts = np.searchsorted(tracks.ids, tracks.host_ids[twins])
        np.minimum.at(looks, hosts, looks[twins])
        np.logical_or.at(averted, hosts, averted[twins])
    return looks, averted


def _jumped(before: TrackTable, after: TrackTable, frame: Frame, found: Found) -> BoolArray:
    """Return (N,) True for measurements far from where the person was expected."""
    jumped = np.zeros(len(after), dtype=np.bool_)
    count = len(before)
    rows = np.flatnonzero(found.seen[:count] & ~found.beyond[:count])
    if rows.size:
        columns = found.source[rows]
        spread = before.covariances[rows, :2, :2] + frame.measurements.noises_m2[columns]
        offset = frame.measurements.positions_odom_m[columns] - before.states[rows, :2]
        jumped[rows] = mahalanobis2(offset, spread) > _JUMP_CHI2
    return jumped


def _held(
    tracks: TrackTable, stamp_s: float, clocks: tuple[FrameClock, ...], sensors: Sensors
) -> BoolArray:
    """Return (N,) True for people whom a sensor without faces has seen without a gap."""
    held = np.zeros(len(tracks), dtype=np.bool_)
    for index in np.flatnonzero(~sensors.faces).tolist():
        limit_s = _GAP_PERIODS * clocks[index].period_s
        if math.isfinite(limit_s):
            held |= stamp_s - tracks.seen_stamps_s[:, index] <= limit_s
    return held


def _interrupted(
    before: TrackTable,
    after: TrackTable,
    stamp_s: float,
    recent_s: FloatArray,
    clocks: tuple[FrameClock, ...],
    sensors: Sensors,
) -> BoolArray:
    """Return (N,) True where no look is ``recent_s`` (N,) old, and there was a gap before now."""
    old = after.look_stamps_s < stamp_s - recent_s
    count = len(before)
    # By the sightings before this frame: it must not close a gap.
    old[:count] &= ~_held(before, stamp_s, clocks, sensors)
    return np.asarray(old)


def _towards(tracks: TrackTable, frame: Frame) -> FloatArray:
    """Return (N, 2) unit vectors from the people to the robot."""
    offset = frame.T_odom_camera[:2, 3] - tracks.states[:, :2]
    distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    return np.asarray(offset / distance[:, None])


def _set_off(tracks: TrackTable, towards: FloatArray) -> BoolArray:
    """Return (N,) True for people who have begun to move, or come faster than before.

    ``towards`` (N, 2) are the unit vectors to the robot.
    """
    velocity, before = tracks.states[:, 2:], tracks.look_velocities_mps
    approach_mps = (towards * velocity).sum(axis=1)
    # On the same course the speed towards the robot changes while both move.
    expected_mps = np.maximum((towards * before).sum(axis=1), 0.0)
    slower = tracks.look_speeds_mps / np.maximum(np.hypot(before[:, 0], before[:, 1]), 1e-9)
    expected_mps *= np.minimum(slower, 1.0)
    faster = approach_mps > expected_mps + _FASTER_MPS
    chi2 = mahalanobis2(velocity, tracks.covariances[:, 2:, 2:])
    moves = (np.hypot(velocity[:, 0], velocity[:, 1]) > _STARTED_MPS) & (chi2 > _STARTED_CHI2)
    return np.asarray(faster | (tracks.look_standing & moves))
