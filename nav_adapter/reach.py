"""The reach of people: the one model of their motion that limit and proof rest on.

Somebody at p with velocity u may change, from now on, to any velocity up to U, with the time
constant τ, after going unnoticed for δ. At time t they are within

    r(t) = U (t + δ − τ (1 − e^{−(t + δ)/τ}))   of   p + u τ (1 − e^{−t/τ}),

plus the body, the clearance C and the uncertainty of place and velocity. What people who have
noticed the robot do at first, a lean or half a step, may lie within the clearance: with λ, their U
as a share of that of unaware people, reach and clearance are max(C, r(t) + λ C) together. That is
r + C for unaware people, never less than r, and it grows with t, U and C. τ = 0.54 s and
U = 1.34 m/s fit recorded people who set off (``docs/people.md``). Somebody who stands needs time to
start, somebody who walks away time to turn, and a brisk walker time to swerve: all three are this
one statement.

What somebody knows of the robot lasts until a time s from now. From then on they may change to the
velocities of unaware people, so r has a knee: beyond s − δ it grows by the rest of U,

    r(t) + (U′ − U) (t′ − τ (1 − e^{−t′/τ})),   t′ = t + δ − s ≥ 0,   U′ that of unaware people,

and only what was reached before s lies within the clearance. At s = 0 that is the reach of unaware
people, and with s → ∞ that of aware ones. Somebody who walks on keeps u until s, and only then may
change: u carries the middle for min(t, s) + τ (1 − e^{−(t − s)₊/τ}) seconds, and r is the second
term alone. ``docs/safety.md`` derives it.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from perception.anthropometry import BODY_RADIUS_M
from perception.matrices import larger_eigenvalue

# Speeds closer than this are equal: U may be the sum of another speed and the rest of theirs.
_SAME_MPS: Final = 1e-9
# Somebody slower than this stands, and sways.
_SWAYS_MPS: Final = 0.1


class Reach(NamedTuple):
    """The reach of one person, in odom, as plain floats.

    Attributes:
        x_m: place p of the body's centre line, ``elapsed_s`` before the present.
        y_m: the same.
        velocity_x_mps: velocity u at the same time.
        velocity_y_mps: the same.
        speed_mps: U ≥ 0, the highest speed that they may change to.
        time_constant_s: τ > 0.
        delay_s: δ ≥ 0, how long a change of velocity may have gone unnoticed.
        elapsed_s: ≥ 0, age of place and velocity.
        margin_m: body radius and clearance.
        within_m: how much of r lies within the clearance, (1 − λ) C; 0 for unaware people.
        variances: a₀, a₁, a₂ of the variance a₀ + a₁ m + a₂ m² (m²) of the place after a drift of
            m = τ (1 − e^{−t/τ}) seconds, with the standard deviations that count already squared
            in.
        until_s: s ≥ 0, until when ``speed_mps`` holds, from the time of place and velocity on.
        later_mps: U′ ≥ U, the highest speed that they may change to after that.
        keeps_s: k ≥ 0, until when they keep u, from the time of place and velocity on.
    """

    x_m: float
    y_m: float
    velocity_x_mps: float
    velocity_y_mps: float
    speed_mps: float
    time_constant_s: float
    delay_s: float
    elapsed_s: float = 0.0
    margin_m: float = BODY_RADIUS_M
    within_m: float = 0.0
    variances: tuple[float, float, float] = (0.0, 0.0, 0.0)
    until_s: float = math.inf
    later_mps: float = 0.0
    keeps_s: float = 0.0

    @property
    def may_walk_on(self) -> bool:
        """True if walking on is not within the reach: by more than U, or with all the clearance."""
        walking_mps = math.hypot(self.velocity_x_mps, self.velocity_y_mps)
        least_mps = _SWAYS_MPS if self.within_m > 0.0 else self.speed_mps + _SAME_MPS
        return walking_mps > least_mps

    def at_least(self, unaware_mps: float) -> Reach:
        """Return the reach of this person if they are unaware, with a U of at least this."""
        return self._replace(
            speed_mps=max(self.speed_mps, unaware_mps), until_s=math.inf, within_m=0.0
        )

    def walking_on(self) -> Reach:
        """Return the reach of this person if they walk straight on while awareness lasts."""
        a0, a1, a2 = variances = self.variances
        if a1 < 0.0:
            # The same people, unaware, must not come less far: the least of their variances.
            least_s = (
                min(-0.5 * a1 / a2, self.time_constant_s) if a2 > 0.0 else self.time_constant_s
            )
            variances = (max(a0 + least_s * (a1 + least_s * a2), 0.0), 0.0, 0.0)
        return self._replace(speed_mps=0.0, keeps_s=self.until_s, variances=variances)

    def changes_s(self, ahead_s: float) -> float:
        """Return m, by which a u that may change carries the middle until ``ahead_s`` from now."""
        tau = self.time_constant_s
        return tau * -math.expm1(-max(ahead_s + self.elapsed_s - self.keeps_s, 0.0) / tau)

    def drift_s(self, ahead_s: float) -> float:
        """Return by how much u carries the middle of the reach until ``ahead_s`` from now."""
        return min(ahead_s + self.elapsed_s, self.keeps_s) + self.changes_s(ahead_s)

    def radius_m(self, ahead_s: float) -> float:
        """Return r, how far from that middle the body's centre line may be ``ahead_s`` from now."""
        since_s = ahead_s + self.elapsed_s + self.delay_s
        late_s = max(since_s - self.until_s, 0.0)
        rest_mps = max(self.later_mps - self.speed_mps, 0.0)
        tau = self.time_constant_s
        return float(self.speed_mps * changed_s(tau, since_s) + rest_mps * changed_s(tau, late_s))

    def margin_after_m(self, ahead_s: float) -> float:
        """Return body and the clearance that r leaves: it falls with time, its sum with r rises."""
        since_s = min(ahead_s + self.elapsed_s + self.delay_s, self.until_s)
        aware_m = self.speed_mps * changed_s(self.time_constant_s, since_s)
        return float(self.margin_m - min(aware_m, self.within_m))

    def uncertainty_m(self, changes_s: float) -> float:
        """Return by how much the middle may be wrong after m seconds."""
        a0, a1, a2 = self.variances
        return math.sqrt(max(a0 + changes_s * (a1 + changes_s * a2), 0.0))

    def farthest_m(self, ahead_s: float) -> float:
        """Return how far the body's centre line may come from p until ``ahead_s`` from now."""
        walked_m = self.drift_s(ahead_s) * math.hypot(self.velocity_x_mps, self.velocity_y_mps)
        uncertainty_m = max(self.uncertainty_m(self.changes_s(ahead_s)), self.uncertainty_m(0.0))
        return self.radius_m(ahead_s) + walked_m + uncertainty_m


def changed_s(tau: Any, since_s: Any, xp: Any = math) -> Any:
    """Return t − τ (1 − e^{−t/τ}), r over U, for floats or arrays (``xp``: NumPy)."""
    return since_s + tau * xp.expm1(-since_s / tau)


class Spread(NamedTuple):
    """The covariance of a place that drifts for m seconds: P + m (C + Cᵀ) + m² V, in blocks.

    It is the place's part of F P Fᵀ. Each block is xx, xy and yy of a symmetric matrix.

    Attributes:
        place: P.
        cross: C + Cᵀ.
        velocity: V.
    """

    place: tuple[float, float, float]
    cross: tuple[float, float, float]
    velocity: tuple[float, float, float]

    @classmethod
    def of(cls, covariance_odom: list[list[float]]) -> Spread:
        """Return that of a track's covariance (4, 4), x, y, vx, vy."""
        (xx, xy, xu, xv), (_, yy, yu, yv), (_, _, uu, uv), (_, _, _, vv) = covariance_odom
        return cls((xx, xy, yy), (2.0 * xu, xv + yu, 2.0 * yv), (uu, uv, vv))

    def after(self, drift_s: float) -> Spread:
        """Return the spread of the same track predicted at constant velocity."""
        p, c, v = self
        return Spread(
            (
                p[0] + drift_s * (c[0] + drift_s * v[0]),
                p[1] + drift_s * (c[1] + drift_s * v[1]),
                p[2] + drift_s * (c[2] + drift_s * v[2]),
            ),
            (c[0] + 2.0 * drift_s * v[0], c[1] + 2.0 * drift_s * v[1], c[2] + 2.0 * drift_s * v[2]),
            v,
        )

    @property
    def sigma_m(self) -> float:
        """The standard deviation of the place along its most uncertain direction."""
        return math.sqrt(max(larger_eigenvalue(*self.place), 0.0))

    def terms(self, sigmas: float) -> tuple[float, float, float]:
        """Return :attr:`Reach.variances`: the eigenvalue of a sum is at most that of the three."""
        factor = sigmas * sigmas
        return (
            factor * larger_eigenvalue(*self.place),
            factor * larger_eigenvalue(*self.cross),
            factor * larger_eigenvalue(*self.velocity),
        )
