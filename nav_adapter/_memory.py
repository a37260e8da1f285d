"""The adapter's memory of one person from one update to the next."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from tracking import PersonTrack

Vector2 = tuple[float, float]
#: Sizes: (visible time until which it held, radius, length ahead).
History = tuple[tuple[float, float, float], ...]

# Standard deviations by which two positions of one person may differ. 4 are exceeded once in
# 3000 frames, which costs a moment of speed.
_EXPLAINED_SIGMAS: Final = 4.0
# Places closer than this are the same, also for a tracker that reports no uncertainty.
_SAME_PLACE_M: Final = 0.05

# Stamps closer than this are equal: the stamp of a sighting is a difference of floats, computed
# anew for every frame.
_SAME_STAMP_S: Final = 1e-6
# Tolerance for rounding where sums of frame periods are compared with a setting.
ROUNDING_S: Final = 1e-9


class PersonMemory(NamedTuple):
    """One person as of the adapter's last update.

    Values of the track that every rule needs are kept as floats, since reading them from their
    arrays again and again would take longer than the rules.

    Attributes:
        track: the latest track of this person.
        track_position_odom_m: position of the track, at its own stamp.
        position_odom_m: position predicted to the update.
        velocity_odom_mps: velocity of the track.
        seen_stamp_s: stamp of the latest frame that showed the person.
        awareness_lower: the lower bound of α that was used.
        radius_m: radius of the obstacle.
        sigma_m: standard deviation of the position along its most uncertain direction.
        visible_s: total time in which frames showed the person, as counted for shrinking.
        known_s: the same, with frames of a tentative track: time since the first sight.
        was_confirmed: whether the track has ever been more than tentative.
        ahead_m: length by which the obstacle's polygon reaches ahead of its circle.
        direction_odom: unit vector of the person's latest walking direction.
        history: latest sizes, newest last: (``visible_s`` until which it held, radius, ahead).
        inflation_held: whether the hysteresis of the inflation policy holds the person as aware.
        speed_held: the same for the speed policy.
        start_delay_s: how long before the track's stamp this person may have begun to walk
            unnoticed; infinite for anybody who does not count as standing.
        turn_delay_s: how long before the track's stamp this person may have begun to turn
            unnoticed; infinite for anybody who may turn at once.
        velocity_spread_mps: by how much this person may come nearer faster than the track; 0 for
            anybody who may turn at once.
    """

    track: PersonTrack
    track_position_odom_m: Vector2
    position_odom_m: Vector2
    velocity_odom_mps: Vector2
    seen_stamp_s: float
    awareness_lower: float
    radius_m: float
    sigma_m: float
    visible_s: float
    known_s: float
    was_confirmed: bool
    ahead_m: float
    direction_odom: Vector2
    history: History
    inflation_held: bool
    speed_held: bool
    start_delay_s: float = math.inf
    turn_delay_s: float = math.inf
    velocity_spread_mps: float = 0.0

    def newly_seen_s(self, seen_stamp_s: float) -> float:
        """Return the time from the last sighting to this one, or 0 if it is not a new one."""
        advance_s = seen_stamp_s - self.seen_stamp_s
        return advance_s if advance_s > _SAME_STAMP_S else 0.0

    def is_kept(self, stamp_s: float, hold_s: float) -> bool:
        """Return whether a person who is missing from the input must be kept at ``stamp_s``.

        The tracker of this project reports a coasting person before it deletes the track. Another
        tracker may delete a track as soon as a detection fails, which is when the person is most
        likely hidden and still there. A track that was never more than tentative may be clutter and
        is not kept.
        """
        return self.was_confirmed and stamp_s - self.seen_stamp_s <= hold_s


class LostPerson(NamedTuple):
    """A person who was dropped although no sensor has shown that they are gone.

    Attributes:
        memory: as of the last update.
        since_s: when they ceased to count in full.
        limit_mps: the limit that they set then; None until it is known.
    """

    memory: PersonMemory
    since_s: float
    limit_mps: float | None = None


def motion_at(track: PersonTrack, stamp_s: float) -> tuple[Vector2, Vector2, Vector2]:
    """Return the position (m) at the track's stamp and at ``stamp_s``, and the velocity (m/s)."""
    dt = stamp_s - track.stamp_s
    x, y = track.position_odom_m.tolist()
    vx, vy = track.velocity_odom_mps.tolist()
    return (x, y), (x + dt * vx, y + dt * vy), (vx, vy)


def position_sigma_m(track: PersonTrack, stamp_s: float) -> float:
    """Return the standard deviation of the position at ``stamp_s``.

    It is that of the most uncertain direction: the root of the larger eigenvalue of the position's
    part of F P Fᵀ, the covariance predicted with constant velocity (u, v).
    """
    dt = max(stamp_s - track.stamp_s, 0.0)
    (x_x, x_y, x_u, x_v), (_, y_y, _, y_v), (u_x, u_y, u_u, u_v), (_, v_y, _, v_v) = (
        track.covariance_odom.tolist()
    )
    xx = x_x + dt * (x_u + u_x) + dt * dt * u_u
    yy = y_y + dt * (y_v + v_y) + dt * dt * v_v
    xy = x_y + dt * (x_v + u_y) + dt * dt * u_v
    return math.sqrt(_larger_eigenvalue(xx, yy, xy))


def velocity_variance_m2ps2(track: PersonTrack) -> float:
    """Return the variance of the velocity along its most uncertain direction."""
    _, _, (_, _, u_u, u_v), (_, _, _, v_v) = track.covariance_odom.tolist()
    return _larger_eigenvalue(u_u, v_v, u_v)


def _larger_eigenvalue(xx: float, yy: float, xy: float) -> float:
    """Return the larger eigenvalue of a covariance on the plane; 0 if rounding makes it less."""
    return max(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy), 0.0)


def has_jumped(before: PersonMemory, track: PersonTrack, walking_mps: float) -> bool:
    """Return whether a track is where the person of the memory cannot be.

    The place is explained by the place of the memory's track, or by its prediction with constant
    velocity, within the covariances of both and the way walked at ``walking_mps``.
    """
    old, stamp_s = before.track, track.stamp_s
    elapsed_s = max(stamp_s - old.stamp_s, 0.0)
    x, y = track.position_odom_m.tolist()
    (old_x, old_y), (vx, vy) = before.track_position_odom_m, before.velocity_odom_mps
    apart_m = min(
        math.hypot(x - old_x, y - old_y),
        math.hypot(x - old_x - elapsed_s * vx, y - old_y - elapsed_s * vy),
    )
    way_m = walking_mps * elapsed_s + _SAME_PLACE_M
    if apart_m <= way_m:
        return False
    sigma_m = math.hypot(position_sigma_m(old, stamp_s), position_sigma_m(track, stamp_s))
    return apart_m > way_m + _EXPLAINED_SIGMAS * sigma_m


def extended_history(
    before: History, newest: tuple[float, float, float], within_s: float
) -> History:
    """Return the sizes of the last ``within_s`` that exceed the newest, and the newest.

    The size at one sighting holds until the next, so that the first sighting after an absence is no
    evidence for the time in between.
    """
    visible_s, radius_m, ahead_m = newest
    if len(before) == 1 and radius_m >= before[0][1] and ahead_m >= before[0][2]:
        return (newest,)
    extended = (*before[:-1], (visible_s, *before[-1][1:]))
    larger = (
        entry
        for entry in extended
        if visible_s - entry[0] < within_s - ROUNDING_S
        and (entry[1] > radius_m or entry[2] > ahead_m)
    )
    return (*larger, newest)
