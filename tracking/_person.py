"""One tracked person: place and velocity, presence, belief of awareness, looks, and size."""

from __future__ import annotations

import math
from typing import Final

from ._frame import Frame, Measurement, Spread
from .awareness_filter import PRIOR, AwarenessBelief
from .covariances import Upper, drifted

# χ² with two degrees of freedom: 90 % of the estimated velocities of a standing person pass.
_STANDING_CHI2: Final = 4.605
# A person no faster than this, with a velocity consistent with 0, counts as standing.
_STANDING_MPS: Final = 0.3
# A standing person is predicted with constant velocity for this long after the last sighting.
_STANDING_HOLD_S: Final = 0.5
# Time constant with which the velocity of an unseen standing person then decays.
_STANDING_DECAY_S: Final = 1.0
#: Standard deviation of a new track's velocity, per axis: how fast people may walk.
WALKER_STD_MPS: Final = 1.0
# For steps below this share of the time constant, the closed form loses digits; use its series.
_SHORT_SHARE: Final = 1e-3


class Track:
    """One person over time.

    The motion model is white acceleration in continuous time on the floor plane. Because the noise
    is continuous, it composes exactly: two steps of dt/2 equal one step of dt, so the frame rate
    does not matter. Source: Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking
    and Navigation* (2001), sections 6.2 (constant velocity) and 8.2 (the damped form, there for
    acceleration).

    Attributes:
        id: unique, increasing.
        x: in odom.
        y: in odom.
        vx: in odom.
        vy: in odom.
        p00: the covariance of x, y, vx, vy, its upper triangle from ``p00`` to ``p33``.
        confirmed: whether enough frames have shown the person.
        standing: whether the person stood still when last seen.
        born_s: stamp of the first frame that showed the person.
        last_seen_s: stamp of the latest frame that did.
        seen_s: of each sensor, stamp of the latest frame that showed the person; −∞ for none.
        presence: of each sensor, log-odds that the person is there (``_presence``); −∞ until it has
            seen them.
        lost: what the latest frame without the person took from the presence of its sensor.
        passed_s: of each sensor, stamp of the latest frame if it has shown the person's place empty
            (:class:`~tracking.RangedView`); −∞ if it has not.
        belief: of awareness.
        face_s: stamp of the latest evidence of awareness that was used; −∞ for none.
        looked_s: for how long the person has looked at the robot lately (``_noticed``).
        look_s: stamp of the latest look; −∞ for none.
        kept_mps: the velocity to which the person keeps, by their looks.
        averted_s: for how long frames since then have shown a face that looks away.
        pictured_s: stamp of the latest picture of any camera that has shown them since the first
            look.
        lasting_std: relative standard deviation of the range from the camera that lasts; it is not
            in the covariance (``_size``).
        size_log: ln of the range at which an adult would look as large, over the range.
        size_variance: of it; ∞ where nothing is known of the person's size.
    """

    def __init__(self, number: int, measured: Measurement, frame: Frame, sensors: int) -> None:
        self.id = number
        self.x, self.y, self.vx, self.vy = measured.x, measured.y, 0.0, 0.0
        noise, velocity_variance = measured.noise_m2, WALKER_STD_MPS**2
        self.p00, self.p01, self.p02, self.p03 = noise.xx, noise.xy, 0.0, 0.0
        self.p11, self.p12, self.p13 = noise.yy, 0.0, 0.0
        self.p22, self.p23, self.p33 = velocity_variance, 0.0, velocity_variance
        self.confirmed = self.standing = False
        self.born_s = self.last_seen_s = frame.stamp_s
        self.seen_s = [-math.inf] * sensors
        self.seen_s[frame.sensor] = frame.stamp_s
        self.presence = [-math.inf] * sensors
        self.presence[frame.sensor] = 0.0
        self.lost = 0.0
        self.passed_s = [-math.inf] * sensors
        self.belief: AwarenessBelief = PRIOR
        self.face_s = -math.inf
        self.looked_s = 0.0
        self.look_s = -math.inf
        self.kept_mps = (0.0, 0.0)
        self.averted_s = 0.0
        self.pictured_s = -math.inf
        self.lasting_std = measured.lasting_std
        self.size_log = 0.0
        self.size_variance = math.inf

    def copied(self) -> Track:
        """Return a track that goes on by itself."""
        copy = object.__new__(Track)
        copy.__dict__.update(self.__dict__)
        copy.seen_s = self.seen_s[:]
        copy.presence = self.presence[:]
        copy.passed_s = self.passed_s[:]
        return copy

    @property
    def spread_m2(self) -> Spread:
        """Covariance of the position."""
        return Spread(self.p00, self.p01, self.p11)

    @property
    def upper(self) -> Upper[float]:
        """Upper triangle of the covariance."""
        return (
            *(self.p00, self.p01, self.p02, self.p03, self.p11),
            *(self.p12, self.p13, self.p22, self.p23, self.p33),
        )

    @property
    def speed_mps(self) -> float:
        """Speed over the floor."""
        return math.hypot(self.vx, self.vy)

    def velocity_chi2(self, from_mps: tuple[float, float] = (0.0, 0.0), std: float = 0.0) -> float:
        """Return how far the velocity is from one that is known by ``std``: χ², two degrees."""
        spread = Spread(self.p22 + std * std, self.p23, self.p33 + std * std)
        return spread.distance2_and_log_det(self.vx - from_mps[0], self.vy - from_mps[1])[0]

    def predict(self, from_s: float, to_s: float, q: float) -> None:
        """Move on from one stamp to a later one, under white acceleration of density q.

        With constant velocity, an unseen standing person would drift off with the remaining
        estimated velocity, and its uncertainty, which grows with the cube of time, would cover the
        whole map. So from 0.5 s after the last sighting on, their velocity decays. The time counts
        from the last sighting, so that the number of frames since then does not matter.
        """
        damped_s = 0.0
        if self.standing:
            damped_s = max(to_s - max(self.last_seen_s + _STANDING_HOLD_S, from_s), 0.0)
        free_s = to_s - from_s - damped_s
        if free_s > 0.0:
            place_noise, cross_noise = q * free_s**3 / 3.0, q * free_s * free_s / 2.0
            self._move(free_s, 1.0, place_noise, cross_noise, q * free_s)
        if damped_s > 0.0:
            self._predict_damped(damped_s, q)

    def _predict_damped(self, dt: float, q: float) -> None:
        """Move on while the velocity decays with τ: an Ornstein–Uhlenbeck process.

        Its variance never exceeds q τ / 2, and the variance of the position grows in proportion to
        time, not to its cube.
        """
        tau = _STANDING_DECAY_S
        share = dt / tau
        decayed, decayed2 = -math.expm1(-share), -math.expm1(-2.0 * share)
        carried = tau * decayed
        if share < _SHORT_SHARE:
            place_noise = q * dt * dt * dt * (1.0 / 3.0 - 0.25 * share)
        else:
            place_noise = q * tau * tau * (dt - 2.0 * tau * decayed + 0.5 * tau * decayed2)
        cross_noise, velocity_noise = q * 0.5 * carried * carried, q * 0.5 * tau * decayed2
        self._move(carried, 1.0 - decayed, place_noise, cross_noise, velocity_noise)

    def _move(
        self, carried_s: float, kept: float, place_m2: float, cross_m2ps: float, speed_m2ps2: float
    ) -> None:
        """Add ``carried_s`` velocities to the place and keep a share of them; then add noise."""
        self.x += carried_s * self.vx
        self.y += carried_s * self.vy
        self.vx *= kept
        self.vy *= kept
        xx, self.p01, xu, xv, yy, yu, yv, uu, uv, vv = drifted(self.upper, carried_s)
        kept2 = kept * kept
        self.p00, self.p11 = xx + place_m2, yy + place_m2
        self.p02, self.p03 = kept * xu + cross_m2ps, kept * xv
        self.p12, self.p13 = kept * yu, kept * yv + cross_m2ps
        self.p22, self.p33 = kept2 * uu + speed_m2ps2, kept2 * vv + speed_m2ps2
        self.p23 = kept2 * uv

    def widen(self, b: tuple[float, float, float, float], factor: float) -> None:
        """Add factor · b bᵀ to the covariance."""
        b0, b1, b2, b3 = b
        self.p00 += factor * b0 * b0
        self.p01 += factor * b0 * b1
        self.p02 += factor * b0 * b2
        self.p03 += factor * b0 * b3
        self.p11 += factor * b1 * b1
        self.p12 += factor * b1 * b2
        self.p13 += factor * b1 * b3
        self.p22 += factor * b2 * b2
        self.p23 += factor * b2 * b3
        self.p33 += factor * b3 * b3

    def correct(self, x: float, y: float, noise_m2: Spread) -> None:
        """Take a measured place: the equations of filterpy's ``KalmanFilter``, H = [I 0]."""
        p00, p01, p02, p03 = self.p00, self.p01, self.p02, self.p03
        p11, p12, p13 = self.p11, self.p12, self.p13
        sxx, sxy, syy = p00 + noise_m2.xx, p01 + noise_m2.xy, p11 + noise_m2.yy
        scale = 1.0 / (sxx * syy - sxy * sxy)
        a, b, c = syy * scale, -sxy * scale, sxx * scale  # the inverse of S
        k00, k01 = p00 * a + p01 * b, p00 * b + p01 * c
        k10, k11 = p01 * a + p11 * b, p01 * b + p11 * c
        k20, k21 = p02 * a + p12 * b, p02 * b + p12 * c
        k30, k31 = p03 * a + p13 * b, p03 * b + p13 * c
        dx, dy = x - self.x, y - self.y
        self.x += k00 * dx + k01 * dy
        self.y += k10 * dx + k11 * dy
        self.vx += k20 * dx + k21 * dy
        self.vy += k30 * dx + k31 * dy
        # The block of the place is K R, which stays positive where P − K H P would lose its digits.
        self.p00 = k00 * noise_m2.xx + k01 * noise_m2.xy
        self.p01 = k00 * noise_m2.xy + k01 * noise_m2.yy
        self.p11 = k10 * noise_m2.xy + k11 * noise_m2.yy
        self.p02 = p02 - (k00 * p02 + k01 * p12)
        self.p03 = p03 - (k00 * p03 + k01 * p13)
        self.p12 = p12 - (k10 * p02 + k11 * p12)
        self.p13 = p13 - (k10 * p03 + k11 * p13)
        self.p22 -= k20 * p02 + k21 * p12
        self.p23 -= k20 * p03 + k21 * p13
        self.p33 -= k30 * p03 + k31 * p13

    def stands(self) -> bool:
        """Return whether the velocity is small, well known and consistent with 0."""
        limit2 = _STANDING_MPS * _STANDING_MPS
        if self.vx * self.vx + self.vy * self.vy > limit2 or self.p22 + self.p33 > 2.0 * limit2:
            return False
        return self.velocity_chi2() <= _STANDING_CHI2
