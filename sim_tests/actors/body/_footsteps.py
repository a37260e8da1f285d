"""Footsteps of a whole scripted walk: where and when each foot stands, so that none ever slides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from perception.arrays import FloatArray

from ._footing import HIP_HEIGHT_COLUMN
from ._gait import LEFT, LONGEST_SWING_S, RIGHT, Gait

# Slower than this and the body only shifts its weight.
_MOVING_MPS: Final = 0.004
_MOVING_RADPS: Final = math.radians(0.6)
# A pause shorter than this is walked through; a shift smaller than this takes no step.
_PAUSE_S: Final = 0.8
_NO_STEP_M: Final = 0.03
_NO_STEP_RAD: Final = math.radians(8.0)
# Turning on the spot: so far in a cycle of two steps. Sideways, feet must not cross.
_TURN_PER_CYCLE_RAD: Final = math.radians(60.0)
_SIDE_STRIDE_SHARE: Final = 0.12
# No step of a short dash is longer than this part of the stature.
_LONGEST_STEP_SHARE: Final = 0.5
_BACK_STRIDE_SHARE: Final = 0.75
# Steps of a start and a stop follow each other no slower than this and no faster.
_SLOWEST_HZ: Final = 0.7
_FASTEST_HZ: Final = 1.2
# Nobody's feet go faster, whatever a script asks for.
_QUICKEST_HZ: Final = 1.8
_QUICKEST_STEP_S: Final = 0.2
# One foot lands this part of a cycle after the body has begun to move, the last after it stopped.
_QUARTER: Final = 0.25
_BOTH_FEET_S: Final = 0.04
# A foot is not left farther behind than this part of the stature: the body then runs, the other
# foot still in the air for so long. Nor does one land farther ahead.
_BEHIND_SHARE: Final = 0.335
_AHEAD_SHARE: Final = 0.29
_FLIGHT_S: Final = 0.12
# Where the hips would sink below this part of their height, or a foot be too quick, steps keep
# ever nearer to the body.
_LOWEST_HIPS: Final = 0.76
_TOO_QUICK_MPS: Final = 9.9
_REACHES: Final = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
_TRIMMED_CYCLES: Final = 0.04
# In a pause that is walked through, the feet go on so fast.
_PAUSE_HZ: Final = 0.6
_CREEPING_HZ: Final = 0.05
_VIGOUR_SMOOTHING_S: Final = 0.30
_TWIST_RAD: Final = math.radians(35.0)
_TWISTING_MPS: Final = 0.3
_EARLIER_S: Final = 0.35


@dataclass(slots=True)
class _Contact:
    """A foot on the floor: x, y, yaw lying flat, from when to when, and the vigour of its steps."""

    place: FloatArray
    land_s: float
    off_s: float = math.inf
    land_vigour: float = 0.0
    off_vigour: float = 0.0


@dataclass(frozen=True, slots=True)
class _Track:
    """The motion of the body on a grid of times, and what the gait makes of it."""

    times_s: FloatArray
    position_m: FloatArray
    heading_rad: FloatArray  # of the feet
    cadence_hz: FloatArray
    vigour: FloatArray
    share: FloatArray


def footstep_table(
    gait: Gait,
    times_s: FloatArray,
    position_odom_m: FloatArray,
    heading_odom_rad: FloatArray,
    velocity_odom_mps: FloatArray,
) -> FloatArray:
    """(N, 17) rows of :class:`Footing` in odom for a motion that is known beforehand.

    The body may walk ahead, backwards, sideways and in curves, turn on the spot, start and stop.
    A stance stays where it is, steps follow each other as the speed asks, feet end side by side.
    Where steps are quick both feet may be in the air for a moment.

    Args:
        gait: of the body.
        times_s: (N,) evenly spaced, at most 0.02 s apart, at rest for a second at either end.
        position_odom_m: (N, 2) of the body's centre line.
        heading_odom_rad: (N,) unwrapped.
        velocity_odom_mps: (N, 2).
    """
    dt_s = float(times_s[1] - times_s[0])
    window = 2 * round(0.5 * _VIGOUR_SMOOTHING_S / dt_s) + 1
    speed = np.hypot(*velocity_odom_mps.T)
    turning = np.gradient(heading_odom_rad, dt_s)
    moving = (speed > _MOVING_MPS) | (np.abs(turning) > _MOVING_RADPS)
    # Whoever walks askew sets the feet along the walk, forwards or backwards.
    course = np.arctan2(velocity_odom_mps[:, 1], velocity_odom_mps[:, 0])
    askew = _TWIST_RAD * np.minimum(speed / _TWISTING_MPS, 1.0)
    twist = _smoothed(askew * np.sin(2.0 * (course - heading_odom_rad)), window)
    heading = heading_odom_rad + twist
    ahead, aside = speed * np.cos(course - heading), speed * np.sin(course - heading)
    vigour = _smoothed(gait.vigour(np.where(moving, ahead, 0.0)), window)
    track = _Track(
        times_s,
        position_odom_m,
        heading,
        np.maximum(
            _cadence_hz(gait, ahead, aside, turning), np.where(moving, _CREEPING_HZ, _PAUSE_HZ)
        ),
        vigour,
        # Around a start and a stop steps are those of the walk.
        minimum_filter1d(gait.stance_share(speed), 2 * round(_EARLIER_S / dt_s) + 1),
    )
    walks = _walks(moving, dt_s)
    best, best_strain = np.empty(0), math.inf
    for reach in _REACHES:
        feet, phase = _feet_and_phase(gait, track, walks, reach)
        table = gait.table(
            feet, position_odom_m, heading_odom_rad, phase, vigour, dt_s, twist_rad=twist
        )
        quickest = float(np.abs(np.diff(feet[..., :3], axis=1)).max()) / dt_s
        lowest = float(table[:, HIP_HEIGHT_COLUMN].min()) / gait.standing_height_m
        strain = max(_LOWEST_HIPS / lowest, quickest / _TOO_QUICK_MPS)
        if strain < best_strain:
            best, best_strain = table, strain
        if strain <= 1.0:
            break
    return best


def _feet_and_phase(
    gait: Gait, track: _Track, walks: list[tuple[int, int]], reach: float
) -> tuple[FloatArray, FloatArray]:
    """(2, N, 5) of both feet, and (N,) cycles since the left one landed."""
    contacts = tuple(
        [_Contact(_neutral(gait, side, track, track.times_s[0]), -math.inf)]
        for side in (LEFT, RIGHT)
    )
    phase = np.zeros(len(track.times_s))
    for first, last in walks:
        if _needs_steps(track, first, last, contacts, gait):
            _step_through(gait, track, first, last, contacts, phase, reach)
    return np.stack([_foot(gait, side, contacts[side], track) for side in (LEFT, RIGHT)]), phase


def _smoothed(values: FloatArray, window: int) -> FloatArray:
    return np.asarray(uniform_filter1d(values, window, mode="nearest"))


def _cadence_hz(
    gait: Gait, ahead_mps: FloatArray, aside_mps: FloatArray, turning_radps: FloatArray
) -> FloatArray:
    """Cycles a second that speed and turning ask for together."""
    speed = np.hypot(ahead_mps, aside_mps)
    forward = gait.stride_m(speed) * np.where(ahead_mps < 0.0, _BACK_STRIDE_SHARE, 1.0)
    sideways = _SIDE_STRIDE_SHARE * gait.skeleton.stature_m
    # Strides in all directions end on an ellipse; sideways ones are short even at speed.
    walk = np.hypot(
        ahead_mps / np.maximum(forward, 1e-6),
        aside_mps / np.maximum(np.minimum(forward, sideways), 1e-6),
    )
    turn = turning_radps / _TURN_PER_CYCLE_RAD
    return np.asarray(np.minimum(np.hypot(walk, turn), _QUICKEST_HZ))


def _walks(moving: FloatArray, dt_s: float) -> list[tuple[int, int]]:
    """First and last rows of the stretches in motion, short pauses walked through."""
    rows = np.flatnonzero(moving)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) * dt_s > _PAUSE_S)
    firsts = np.concatenate([rows[:1], rows[breaks + 1]])
    lasts = np.concatenate([rows[breaks], rows[-1:]])
    end = len(moving) - 1
    return [
        (max(int(first) - 1, 0), min(int(last) + 1, end))
        for first, last in zip(firsts, lasts, strict=True)
    ]


def _needs_steps(
    track: _Track, first: int, last: int, contacts: tuple[list[_Contact], ...], gait: Gait
) -> bool:
    """Whether the body gets too far from where its feet stand."""
    rows = slice(first, last + 1)
    for side in (LEFT, RIGHT):
        place = contacts[side][-1].place
        neutral = gait.neutral(
            side, track.position_m[rows], track.heading_rad[rows], np.zeros(last + 1 - first)
        )
        if np.hypot(*(neutral[:, :2] - place[:2]).T).max() > _NO_STEP_M:
            return True
        if np.abs(neutral[:, 2] - place[2]).max() > _NO_STEP_RAD:
            return True
    return False


def _step_through(
    gait: Gait,
    track: _Track,
    first: int,
    last: int,
    contacts: tuple[list[_Contact], ...],
    phase: FloatArray,
    reach: float,
) -> None:
    """Add the steps of one stretch of motion; fills ``phase`` from the left foot's landings."""
    stature_m = gait.skeleton.stature_m
    end_s = track.times_s[last]
    dt_s = float(track.times_s[1] - track.times_s[0])
    cycles = _cycles(track.cadence_hz[first : last + 1], dt_s)
    # Feet do not wait for the last of a motion that dies away, nor step for the first of it.
    trim = min(_TRIMMED_CYCLES, 0.2 * float(cycles[-1]))
    last = first + int(np.searchsorted(cycles, cycles[-1] - trim))
    first += int(np.searchsorted(cycles, trim, side="right")) - 1
    times, cadence = track.times_s[first : last + 1], track.cadence_hz[first : last + 1]
    cycles = _cycles(cadence, dt_s)
    steps = max(round(2.0 * float(cycles[-1])), 1)
    way_m = float(np.hypot(*np.diff(track.position_m[first : last + 1], axis=0).T).sum())
    steps = max(steps, math.ceil(way_m / (reach * _LONGEST_STEP_SHARE * stature_m)))
    stretch = 0.5 * steps / float(cycles[-1])
    # Before and after, the feet go on at the pace of the first and the last step.
    before, after = (
        float(np.clip(pace * stretch, _SLOWEST_HZ, _FASTEST_HZ))
        for pace in (cadence[: len(cadence) // 4 + 1].max(), cadence[-len(cadence) // 4 :].max())
    )
    knots_s = np.concatenate([[times[0] - 1.0], times, [times[-1] + 1.0]])
    knots = np.concatenate([[-before], cycles * stretch, [0.5 * steps + after]])
    lead = _leading_side(track, first, last)
    landings = 0.5 * np.arange(1, steps + 2) - _QUARTER
    land_s = np.interp(landings, knots, knots_s)
    for n in range(1, len(land_s)):
        land_s[n] = max(land_s[n], land_s[n - 1] + _QUICKEST_STEP_S)
    swing_s = np.empty(len(landings))
    for n, at in enumerate(land_s):
        share = float(np.clip(np.interp(at, track.times_s, track.share), 0.0, 0.75))
        pace = float(np.interp(at - 0.1, times, cadence * stretch, before, after))
        swing_s[n] = min((1.0 - share) / max(pace, 1e-3), LONGEST_SWING_S)
        latest = land_s[n - 1] + _BOTH_FEET_S if n else times[0] - 0.35
        swing_s[n] = min(swing_s[n], at - latest)
    off_s = land_s - swing_s
    # Midway is by the distance that the body covers, not by time: paces change.
    moved = np.hypot(*np.gradient(track.position_m, axis=0).T)
    covered = np.cumsum(moved + 0.2 * np.abs(np.gradient(track.heading_rad)) + 1e-9)
    for n, at in enumerate(land_s):
        side = (lead + n) % 2
        contact = contacts[side][-1]
        left_s = _left_behind_s(track, contact, float(off_s[n]), stature_m, reach)
        other_s = float(land_s[n - 1]) if n else -math.inf
        if left_s < off_s[n]:
            other_s -= _FLIGHT_S
        contact.off_s = max(left_s, max(contact.land_s, other_s) + _BOTH_FEET_S)
        contact.off_vigour = _at(track, track.vigour, contact.off_s)
        place = (
            _landing_place(gait, side, track, covered, (float(at), float(off_s[n + 2])), reach)
            if n + 2 < len(land_s)
            else _neutral(gait, side, track, end_s)
        )
        contacts[side].append(_Contact(place, float(at), land_vigour=_at(track, track.vigour, at)))
    rows = slice(max(first - round(0.5 / dt_s), 0), last + 1 + round(0.5 / dt_s))
    left_landing = _QUARTER + 0.5 * (lead != LEFT)
    phase[rows] = np.interp(track.times_s[rows], knots_s, knots) - left_landing


def _landing_place(
    gait: Gait,
    side: int,
    track: _Track,
    covered: FloatArray,
    stance_s: tuple[float, float],
    reach: float,
) -> FloatArray:
    """(3,) where a foot lands that stands for ``stance_s``: under the body's place midway."""
    over = float(gait.over_share(np.array(_at(track, track.vigour, stance_s[0]))))
    here, there = (_at(track, covered, t) for t in stance_s)
    middle_s = float(np.interp(here + over * (there - here), covered, track.times_s))
    place, under = (_neutral(gait, side, track, t) for t in (middle_s, stance_s[0]))
    ahead_m = math.dist(place[:2], under[:2])
    furthest_m = reach * _AHEAD_SHARE * gait.skeleton.stature_m
    return place if ahead_m <= furthest_m else under + furthest_m / ahead_m * (place - under)


def _left_behind_s(
    track: _Track, contact: _Contact, off_s: float, stature_m: float, reach: float
) -> float:
    """When a stance foot has to go: at ``off_s``, or sooner if the body gets out of its reach."""
    first, last = np.searchsorted(track.times_s, (contact.land_s, off_s))
    away = np.hypot(*(track.position_m[first:last] - contact.place[:2]).T)
    # What is ahead at first comes nearer; only what falls behind counts.
    if last - first < 2:
        return off_s
    furthest_m = reach * _BEHIND_SHARE * stature_m
    behind = np.flatnonzero((away > furthest_m) & (np.gradient(away) > 0.0))
    return float(track.times_s[first + behind[0]]) if len(behind) else off_s


def _cycles(cadence_hz: FloatArray, dt_s: float) -> FloatArray:
    """Cycles since the first row."""
    steps = 0.5 * (cadence_hz[1:] + cadence_hz[:-1]) * dt_s
    return np.concatenate([[0.0], np.cumsum(steps)])


def _leading_side(track: _Track, first: int, last: int) -> int:
    """The foot on whose side the motion begins, so that it does not cross the other."""
    row = first + (last - first) // 3
    heading = float(track.heading_rad[first])
    dx, dy = (track.position_m[row] - track.position_m[first]).tolist()
    leftwards = -math.sin(heading) * dx + math.cos(heading) * dy
    turn = float(track.heading_rad[row]) - heading
    return RIGHT if leftwards + 0.3 * turn < -0.02 else LEFT


def _neutral(gait: Gait, side: int, track: _Track, at_s: float) -> FloatArray:
    """(3,) where a flat foot belongs at a time."""
    position = np.array([[_at(track, column, at_s) for column in track.position_m.T]])
    heading = np.array([_at(track, track.heading_rad, at_s)])
    vigour = np.array([_at(track, track.vigour, at_s)])
    return np.asarray(gait.neutral(side, position, heading, vigour)[0])


def _at(track: _Track, column: FloatArray, at_s: float) -> float:
    return float(np.interp(at_s, track.times_s, column))


def _foot(gait: Gait, side: int, contacts: list[_Contact], track: _Track) -> FloatArray:
    """(N, 5) of one ankle over all times."""
    times_s = track.times_s
    body = np.column_stack([track.position_m, track.heading_rad])
    out = np.empty((len(times_s), 5))
    for contact, following in zip(contacts, [*contacts[1:], None], strict=True):
        # A foot that always stood, or will, does not roll.
        land_s = max(contact.land_s, times_s[0] - 10.0)
        off_s = min(contact.off_s, times_s[-1] + 10.0)
        first, last = np.searchsorted(times_s, (land_s, off_s))
        at = times_s[first:last]
        vigour = (contact.land_vigour, contact.off_vigour)
        out[first:last] = gait.stance(side, contact.place, at - land_s, off_s - at, vigour)
        if following is None:
            continue
        first, last = np.searchsorted(times_s, (off_s, following.land_s))
        swing_s = following.land_s - off_s
        out[first:last] = gait.swing(
            side,
            contact.place,
            following.place,
            (times_s[first:last] - off_s) / swing_s,
            swing_s,
            off_s - land_s,
            (contact.off_vigour, following.land_vigour),
            body[first:last],
        )
    return out
