"""Footsteps of a walk that is known beforehand: the place and time of every stance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from perception.arrays import FloatArray

from ._gait import (
    BACKWARD_STRIDE_SHARE,
    LONGEST_SWING_S,
    MAX_CADENCE_HZ,
    SIDE_STRIDE_SHARE,
    TURN_PER_CYCLE_RAD,
    TWIST_FROM_MPS,
    TWIST_RAD,
)
from ._planned_gait import PlannedGait
from ._skeleton import LEFT, RIGHT

# Below both of these the body stands.
_STANDING_BELOW_MPS: Final = 0.004
_STANDING_BELOW_RADPS: Final = math.radians(0.6)
# A shorter pause is walked through. Feet this near to their neutral place take no step.
_MIN_PAUSE_S: Final = 0.8
_STAY_WITHIN_M: Final = 0.03
_STAY_WITHIN_RAD: Final = math.radians(8.0)
# Least cadence in a pause that is walked through, and in motion.
_PAUSE_HZ: Final = 0.6
_CREEPING_HZ: Final = 0.05
# Range of the cadence before the first and after the last step.
_MIN_START_HZ: Final = 0.7
_MAX_START_HZ: Final = 1.2
_MIN_STEP_S: Final = 0.2
# The first foot lands this part of a cycle after the body starts, the last after it stops.
_FIRST_LANDING_CYCLES: Final = 0.25
# The first and the last part of a motion take no steps: this much of a cycle each.
_TRIMMED_CYCLES: Final = 0.04
_DOUBLE_SUPPORT_S: Final = 0.04
_MAX_STANCE_SHARE: Final = 0.75
# As shares of stature: the longest step, how far a stance foot may be left behind, and how far
# ahead it may land. A foot that is left behind lifts off this long before the other one lands.
_MAX_STEP_SHARE: Final = 0.5
_MAX_BEHIND_SHARE: Final = 0.335
_MAX_AHEAD_SHARE: Final = 0.29
_FLIGHT_S: Final = 0.12
# Where the hips would sink below this share of their standing height, or a foot would be faster,
# the limits above are scaled down in turn.
_MIN_HIP_HEIGHT_SHARE: Final = 0.76
_MAX_FOOT_SPEED_MPS: Final = 9.9
_REACH_SCALES: Final = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
_SMOOTHING_S: Final = 0.30
# A start and a stop have the stance share of the walk within this time.
_START_STOP_S: Final = 0.35


@dataclass(slots=True)
class _Stance:
    """A foot on the floor: its flat place (x, y, yaw), its times, and the stride ratios of both."""

    place: FloatArray
    landing_s: float
    lift_off_s: float = math.inf
    landing_stride_ratio: float = 0.0
    lift_off_stride_ratio: float = 0.0


@dataclass(frozen=True, slots=True)
class _BodyMotion:
    """The body's motion on a grid of times, and the gait that goes with it."""

    times_s: FloatArray
    position_m: FloatArray
    heading_rad: FloatArray  # of the feet
    cadence_hz: FloatArray
    stride_ratio: FloatArray
    stance_share: FloatArray

    def interpolated(self, column: FloatArray, t_s: float) -> float:
        """Return a column's value at a time."""
        return float(np.interp(t_s, self.times_s, column))


def plan_footsteps(
    gait: PlannedGait,
    times_s: FloatArray,
    position_odom_m: FloatArray,
    heading_odom_rad: FloatArray,
    velocity_odom_mps: FloatArray,
) -> FloatArray:
    """Return (N, 17) rows of :class:`GaitPose` in odom for a known motion.

    The body may walk ahead, backwards, sideways and in curves, turn on the spot, start and stop.
    A stance foot never slides, and at the end the feet stand side by side. Quick steps may have a
    short flight of both feet.

    Args:
        gait: the body's gait.
        times_s: (N,) evenly spaced by at most 0.02 s, with a second of rest at both ends.
        position_odom_m: (N, 2) the body's centre line.
        heading_odom_rad: (N,) unwrapped.
        velocity_odom_mps: (N, 2).
    """
    dt_s = float(times_s[1] - times_s[0])
    window = 2 * round(0.5 * _SMOOTHING_S / dt_s) + 1
    speed = np.hypot(*velocity_odom_mps.T)
    turning = np.gradient(heading_odom_rad, dt_s)
    moving = (speed > _STANDING_BELOW_MPS) | (np.abs(turning) > _STANDING_BELOW_RADPS)
    # A body that walks askew turns its feet along the walk, forwards or backwards.
    course = np.arctan2(velocity_odom_mps[:, 1], velocity_odom_mps[:, 0])
    askew = TWIST_RAD * np.minimum(speed / TWIST_FROM_MPS, 1.0)
    twist = _moving_average(askew * np.sin(2.0 * (course - heading_odom_rad)), window)
    heading = heading_odom_rad + twist
    forward, left = speed * np.cos(course - heading), speed * np.sin(course - heading)
    stride_ratio = _moving_average(gait.stride_ratio(np.where(moving, forward, 0.0)), window)
    motion = _BodyMotion(
        times_s,
        position_odom_m,
        heading,
        np.maximum(
            _cadence_hz(gait, forward, left, turning), np.where(moving, _CREEPING_HZ, _PAUSE_HZ)
        ),
        stride_ratio,
        minimum_filter1d(gait.stance_share(speed), 2 * round(_START_STOP_S / dt_s) + 1),
    )
    walks = _walks(moving, dt_s)
    best, least_excess = np.empty(0), math.inf
    for reach_scale in _REACH_SCALES:
        feet, phase = _feet_and_phase(gait, motion, walks, reach_scale)
        table = gait.table(
            feet, position_odom_m, heading_odom_rad, phase, stride_ratio, dt_s, twist_rad=twist
        )
        foot_speed_mps = float(np.abs(np.diff(feet[..., :3], axis=1)).max()) / dt_s
        hip_share = float(table[:, 10].min()) / gait.standing_height_m
        excess = max(_MIN_HIP_HEIGHT_SHARE / hip_share, foot_speed_mps / _MAX_FOOT_SPEED_MPS)
        if excess < least_excess:
            best, least_excess = table, excess
        if excess <= 1.0:
            break
    return best


def _moving_average(values: FloatArray, window: int) -> FloatArray:
    return np.asarray(uniform_filter1d(values, window, mode="nearest"))


def _cadence_hz(
    gait: PlannedGait, forward_mps: FloatArray, left_mps: FloatArray, turning_radps: FloatArray
) -> FloatArray:
    """Return (N,) cycles per second that walking and turning need together."""
    speed = np.hypot(forward_mps, left_mps)
    forward = gait.stride_m(speed) * np.where(forward_mps < 0.0, BACKWARD_STRIDE_SHARE, 1.0)
    sideways = SIDE_STRIDE_SHARE * gait.skeleton.stature_m
    # Strides in all directions end on an ellipse, whose sideways axis does not grow with speed.
    walk = np.hypot(
        forward_mps / np.maximum(forward, 1e-6),
        left_mps / np.maximum(np.minimum(forward, sideways), 1e-6),
    )
    turn = turning_radps / TURN_PER_CYCLE_RAD
    return np.asarray(np.minimum(np.hypot(walk, turn), MAX_CADENCE_HZ))


def _walks(moving: FloatArray, dt_s: float) -> list[tuple[int, int]]:
    """Return the first and last row of each stretch in motion; short pauses are part of it."""
    rows = np.flatnonzero(moving)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) * dt_s > _MIN_PAUSE_S)
    firsts = np.concatenate([rows[:1], rows[breaks + 1]])
    lasts = np.concatenate([rows[breaks], rows[-1:]])
    end = len(moving) - 1
    return [
        (max(int(first) - 1, 0), min(int(last) + 1, end))
        for first, last in zip(firsts, lasts, strict=True)
    ]


def _feet_and_phase(
    gait: PlannedGait, motion: _BodyMotion, walks: list[tuple[int, int]], reach_scale: float
) -> tuple[FloatArray, FloatArray]:
    """Return (2, N, 5) ankles of both feet, and (N,) cycles since the left foot landed."""
    stances = tuple(
        [_Stance(_neutral(gait, side, motion, motion.times_s[0]), -math.inf)]
        for side in (LEFT, RIGHT)
    )
    phase = np.zeros(len(motion.times_s))
    for first, last in walks:
        if _needs_steps(gait, motion, first, last, stances):
            _add_steps(gait, motion, first, last, stances, phase, reach_scale)
    feet = [_ankles(gait, side, motion, stances[side]) for side in (LEFT, RIGHT)]
    return np.stack(feet), phase


def _needs_steps(
    gait: PlannedGait,
    motion: _BodyMotion,
    first: int,
    last: int,
    stances: tuple[list[_Stance], ...],
) -> bool:
    """Return whether the body moves too far from where its feet stand."""
    rows = slice(first, last + 1)
    for side in (LEFT, RIGHT):
        place = stances[side][-1].place
        neutral = gait.neutral(
            side, motion.position_m[rows], motion.heading_rad[rows], np.zeros(last + 1 - first)
        )
        if np.hypot(*(neutral[:, :2] - place[:2]).T).max() > _STAY_WITHIN_M:
            return True
        if np.abs(neutral[:, 2] - place[2]).max() > _STAY_WITHIN_RAD:
            return True
    return False


def _add_steps(
    gait: PlannedGait,
    motion: _BodyMotion,
    first: int,
    last: int,
    stances: tuple[list[_Stance], ...],
    phase: FloatArray,
    reach_scale: float,
) -> None:
    """Add the stances of one walk, and write its phase into ``phase``."""
    stature_m = gait.skeleton.stature_m
    end_s = motion.times_s[last]
    dt_s = float(motion.times_s[1] - motion.times_s[0])
    cycles = _cycles(motion.cadence_hz[first : last + 1], dt_s)
    trim = min(_TRIMMED_CYCLES, 0.2 * float(cycles[-1]))
    last = first + int(np.searchsorted(cycles, cycles[-1] - trim))
    first += int(np.searchsorted(cycles, trim, side="right")) - 1
    times, cadence = motion.times_s[first : last + 1], motion.cadence_hz[first : last + 1]
    cycles = _cycles(cadence, dt_s)
    steps = max(round(2.0 * float(cycles[-1])), 1)
    path_m = float(np.hypot(*np.diff(motion.position_m[first : last + 1], axis=0).T).sum())
    steps = max(steps, math.ceil(path_m / (reach_scale * _MAX_STEP_SHARE * stature_m)))
    stretch = 0.5 * steps / float(cycles[-1])
    # Before and after the walk the cycle continues at the cadence of the first and the last step.
    before, after = (
        float(np.clip(hz * stretch, _MIN_START_HZ, _MAX_START_HZ))
        for hz in (cadence[: len(cadence) // 4 + 1].max(), cadence[-len(cadence) // 4 :].max())
    )
    knots_s = np.concatenate([[times[0] - 1.0], times, [times[-1] + 1.0]])
    knots = np.concatenate([[-before], cycles * stretch, [0.5 * steps + after]])
    lead = _leading_side(motion, first, last)
    landings = 0.5 * np.arange(1, steps + 2) - _FIRST_LANDING_CYCLES
    landing_s = np.interp(landings, knots, knots_s)
    for n in range(1, len(landing_s)):
        landing_s[n] = max(landing_s[n], landing_s[n - 1] + _MIN_STEP_S)
    swing_s = np.empty(len(landings))
    for n, at_s in enumerate(landing_s):
        share = float(
            np.clip(np.interp(at_s, motion.times_s, motion.stance_share), 0.0, _MAX_STANCE_SHARE)
        )
        hz = float(np.interp(at_s - 0.1, times, cadence * stretch, before, after))
        swing_s[n] = min((1.0 - share) / max(hz, 1e-3), LONGEST_SWING_S)
        earliest_s = landing_s[n - 1] + _DOUBLE_SUPPORT_S if n else times[0] - 0.35
        swing_s[n] = min(swing_s[n], at_s - earliest_s)
    lift_off_s = landing_s - swing_s
    # Midstance is halfway by the distance that the body covers, not by time: speeds change.
    moved = np.hypot(*np.gradient(motion.position_m, axis=0).T)
    covered = np.cumsum(moved + 0.2 * np.abs(np.gradient(motion.heading_rad)) + 1e-9)
    for n, at_s in enumerate(landing_s):
        side = (lead + n) % 2
        stance = stances[side][-1]
        left_s = _latest_lift_off_s(motion, stance, float(lift_off_s[n]), stature_m, reach_scale)
        other_landing_s = float(landing_s[n - 1]) if n else -math.inf
        if left_s < lift_off_s[n]:
            other_landing_s -= _FLIGHT_S
        stance.lift_off_s = max(left_s, max(stance.landing_s, other_landing_s) + _DOUBLE_SUPPORT_S)
        stance.lift_off_stride_ratio = motion.interpolated(motion.stride_ratio, stance.lift_off_s)
        if n + 2 < len(landing_s):
            times_down_s = (float(at_s), float(lift_off_s[n + 2]))
            place = _landing_place(gait, side, motion, covered, times_down_s, reach_scale)
        else:
            place = _neutral(gait, side, motion, end_s)
        ratio = motion.interpolated(motion.stride_ratio, at_s)
        stances[side].append(_Stance(place, float(at_s), landing_stride_ratio=ratio))
    rows = slice(max(first - round(0.5 / dt_s), 0), last + 1 + round(0.5 / dt_s))
    left_landing = _FIRST_LANDING_CYCLES + 0.5 * (lead != LEFT)
    phase[rows] = np.interp(motion.times_s[rows], knots_s, knots) - left_landing


def _cycles(cadence_hz: FloatArray, dt_s: float) -> FloatArray:
    """Return (N,) cycles since the first row."""
    steps = 0.5 * (cadence_hz[1:] + cadence_hz[:-1]) * dt_s
    return np.concatenate([[0.0], np.cumsum(steps)])


def _leading_side(motion: _BodyMotion, first: int, last: int) -> int:
    """Return the foot on the side of the motion, which leads so that the feet do not cross."""
    row = first + (last - first) // 3
    heading = float(motion.heading_rad[first])
    dx, dy = (motion.position_m[row] - motion.position_m[first]).tolist()
    leftwards = -math.sin(heading) * dx + math.cos(heading) * dy
    turn = float(motion.heading_rad[row]) - heading
    return RIGHT if leftwards + 0.3 * turn < -0.02 else LEFT


def _latest_lift_off_s(
    motion: _BodyMotion, stance: _Stance, lift_off_s: float, stature_m: float, reach_scale: float
) -> float:
    """Return ``lift_off_s``, or an earlier time at which the body leaves the foot's reach."""
    first, last = np.searchsorted(motion.times_s, (stance.landing_s, lift_off_s))
    away = np.hypot(*(motion.position_m[first:last] - stance.place[:2]).T)
    if last - first < 2:
        return lift_off_s
    limit_m = reach_scale * _MAX_BEHIND_SHARE * stature_m
    # A foot ahead of the body comes nearer; only one that falls behind counts.
    behind = np.flatnonzero((away > limit_m) & (np.gradient(away) > 0.0))
    return float(motion.times_s[first + behind[0]]) if len(behind) else lift_off_s


def _landing_place(
    gait: PlannedGait,
    side: int,
    motion: _BodyMotion,
    covered: FloatArray,
    stance_s: tuple[float, float],
    reach_scale: float,
) -> FloatArray:
    """Return (3,) the place of a foot whose stance has these times: under the body at midstance."""
    midstance = gait.midstance_share(
        np.array(motion.interpolated(motion.stride_ratio, stance_s[0]))
    )
    here, there = (motion.interpolated(covered, t_s) for t_s in stance_s)
    midstance_s = float(
        np.interp(here + float(midstance) * (there - here), covered, motion.times_s)
    )
    place, under = (_neutral(gait, side, motion, t_s) for t_s in (midstance_s, stance_s[0]))
    ahead_m = math.dist(place[:2], under[:2])
    limit_m = reach_scale * _MAX_AHEAD_SHARE * gait.skeleton.stature_m
    return place if ahead_m <= limit_m else under + limit_m / ahead_m * (place - under)


def _neutral(gait: PlannedGait, side: int, motion: _BodyMotion, t_s: float) -> FloatArray:
    """Return (3,) the neutral place of a flat foot at a time."""
    position = np.array([[motion.interpolated(column, t_s) for column in motion.position_m.T]])
    heading = np.array([motion.interpolated(motion.heading_rad, t_s)])
    stride_ratio = np.array([motion.interpolated(motion.stride_ratio, t_s)])
    return np.asarray(gait.neutral(side, position, heading, stride_ratio)[0])


def _ankles(
    gait: PlannedGait, side: int, motion: _BodyMotion, stances: list[_Stance]
) -> FloatArray:
    """Return (N, 5) x, y, z, yaw, pitch of one ankle at all times."""
    times_s = motion.times_s
    body = np.column_stack([motion.position_m, motion.heading_rad])
    out = np.empty((len(times_s), 5))
    for stance, following in zip(stances, [*stances[1:], None], strict=True):
        # A foot that stands before the first or after the last row does not roll there.
        landing_s = max(stance.landing_s, times_s[0] - 10.0)
        lift_off_s = min(stance.lift_off_s, times_s[-1] + 10.0)
        first, last = np.searchsorted(times_s, (landing_s, lift_off_s))
        t_s = times_s[first:last]
        ratios = (stance.landing_stride_ratio, stance.lift_off_stride_ratio)
        out[first:last] = gait.stance(side, stance.place, t_s - landing_s, lift_off_s - t_s, ratios)
        if following is None:
            continue
        first, last = np.searchsorted(times_s, (lift_off_s, following.landing_s))
        swing_s = following.landing_s - lift_off_s
        out[first:last] = gait.swing(
            side,
            stance.place,
            following.place,
            (times_s[first:last] - lift_off_s) / swing_s,
            swing_s,
            lift_off_s - landing_s,
            (stance.lift_off_stride_ratio, following.landing_stride_ratio),
            body[first:last],
        )
    return out
