"""What the adapter remembers of one person from one update to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

from tracking import PersonTrack

Pair = tuple[float, float]

# Two stamps closer than this are one instant: a sighting's stamp is recomputed as a difference of
# floats in every frame.
_SAME_INSTANT_S = 1e-6


class PersonMemory(NamedTuple):
    """One person as of the adapter's last update.

    Numbers of the track that every rule asks for are kept as floats: taking them out of their
    arrays again and again would cost more than the rules.

    Attributes:
        track: the latest track given for this person.
        place_odom_m: its position, at its own stamp.
        here_odom_m: its position carried on to the update.
        velocity_odom_mps: its velocity.
        seen_stamp_s: when a frame last showed the person.
        awareness_lower: the bound that was acted on.
        radius_m: the obstacle's radius.
        sigma_m: standard deviation of the position along its most uncertain direction.
        visible_s: time in sight that has been counted for this person.
        ahead_m: how far the obstacle's polygon reaches ahead of its circle.
        facing_odom: unit vector of the way the person walks, or last walked.
        history: latest sizes, newest last: (``visible_s`` until which it held, radius, ahead).
        inflation_held: whether the inflation policy's hysteresis holds the person "aware".
        speed_held: the same of the speed policy.
    """

    track: PersonTrack
    place_odom_m: Pair
    here_odom_m: Pair
    velocity_odom_mps: Pair
    seen_stamp_s: float
    awareness_lower: float
    radius_m: float
    sigma_m: float
    visible_s: float
    ahead_m: float
    facing_odom: Pair
    history: tuple[tuple[float, float, float], ...]
    inflation_held: bool
    speed_held: bool

    def newly_seen_s(self, seen_stamp_s: float) -> float:
        """Time from the last sighting to this one; 0 when it is no new one."""
        advance_s = seen_stamp_s - self.seen_stamp_s
        return advance_s if advance_s > _SAME_INSTANT_S else 0.0

    def is_held(self, stamp_s: float, hold_s: float) -> bool:
        """Whether a person missing from the input must still be kept at ``stamp_s``.

        The tracker of this project lets a person coast visibly before it drops them. Another one
        may drop a person the moment a detection fails, which is when they are most likely hidden
        behind something and still there. A tentative track may be clutter and is let go.
        """
        return self.track.status != "tentative" and stamp_s - self.seen_stamp_s <= hold_s


def motion_at(track: PersonTrack, stamp_s: float) -> tuple[Pair, Pair, Pair]:
    """Position (m) at the track's stamp and at ``stamp_s``, and velocity (m/s), all in odom."""
    dt = stamp_s - track.stamp_s
    x, y = track.position_odom_m.tolist()
    vx, vy = track.velocity_odom_mps.tolist()
    return (x, y), (x + dt * vx, y + dt * vy), (vx, vy)


def position_sigma_m(track: PersonTrack, stamp_s: float) -> float:
    """Standard deviation at ``stamp_s`` of the position along its most uncertain direction.

    The root of the larger eigenvalue of the position covariance, carried on with the
    velocity (u, v) covariance: F P Fᵀ of a constant velocity.
    """
    dt = max(stamp_s - track.stamp_s, 0.0)
    (x_x, x_y, x_u, x_v), (_, y_y, _, y_v), (u_x, u_y, u_u, u_v), (_, v_y, _, v_v) = (
        track.covariance_odom.tolist()
    )
    xx = x_x + dt * (x_u + u_x) + dt * dt * u_u
    yy = y_y + dt * (y_v + v_y) + dt * dt * v_v
    xy = x_y + dt * (x_v + u_y) + dt * dt * u_v
    return math.sqrt(max(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy), 0.0))
