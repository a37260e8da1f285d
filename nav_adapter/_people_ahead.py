"""People as the adapter will know them if they go straight on, and how far they can come."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._constraints import NavConstraints
from ._people import OLDEST_S, Person
from ._places import position_sigma_m
from ._predicted import predicted_sigmas_m
from ._speed_basis import SpeedBasis
from .reach import SAME_MPS, WALKING_ON_S, Reach, covariance_terms

Value = Any
# Ages closer than this are equal.
_SAME_AGE_S: Final = 1e-9


class PersonAhead(NamedTuple):
    """One person at T times, as the adapter will know them if they go straight on.

    Attributes:
        track_id: of the person.
        x_m: place ``elapsed_s`` before each time, a float or (T,) like all of them.
        y_m: the same.
        velocity_x_mps: a float.
        velocity_y_mps: a float.
        speed_mps: U.
        time_constant_s: τ; 0 under a policy that knows no motion.
        delay_s: δ.
        elapsed_s: age of the place.
        variances: a₀, a₁ and a₂ of :class:`~nav_adapter.reach.Reach`.
        body_m: body radius and uncertainty of the present place.
        least_mps: what a lost person allows at least, or None.
    """

    track_id: int
    x_m: Value
    y_m: Value
    velocity_x_mps: float
    velocity_y_mps: float
    speed_mps: Value
    time_constant_s: float
    delay_s: Value
    elapsed_s: Value
    variances: tuple[Value, Value, Value]
    body_m: Value
    least_mps: Value = None

    @property
    def walks_faster(self) -> bool:
        """True if this person walks faster than U at any of the times."""
        walking_mps = math.hypot(self.velocity_x_mps, self.velocity_y_mps)
        slowest_mps = float(np.min(self.speed_mps))
        return self.time_constant_s > 0.0 and walking_mps > slowest_mps + SAME_MPS

    def walking_on(self) -> PersonAhead:
        """Return the person if they walk straight on, as :meth:`Reach.walking_on` does."""
        a0, a1, _ = self.variances
        return self._replace(
            speed_mps=0.0,
            delay_s=0.0,
            time_constant_s=WALKING_ON_S,
            variances=(np.where(np.asarray(a1) >= 0.0, a0, 0.0), 0.0, 0.0),
        )

    def reaches(self, count: int) -> tuple[Reach, ...]:
        """Return the reach at each of the ``count`` times, in plain numbers, without the body.

        There is a single one, larger by the way between, for somebody who differs in place alone.
        """
        x, y = listed(self.x_m, count), listed(self.y_m, count)
        others = self.speed_mps, self.delay_s, self.elapsed_s, *self.variances
        margins_m = [0.0] * count
        if not any(map(varies, others)):
            margins_m = [0.5 * math.hypot(x[-1] - x[0], y[-1] - y[0])]
            x, y, count = [0.5 * (x[0] + x[-1])], [0.5 * (y[0] + y[-1])], 1
        return tuple(
            Reach(
                *(x_m, y_m, self.velocity_x_mps, self.velocity_y_mps, speed_mps),
                *(self.time_constant_s, delay_s, elapsed_s, margin_m, (a0, a1, a2)),
            )
            for x_m, y_m, margin_m, speed_mps, delay_s, elapsed_s, a0, a1, a2 in zip(
                x, y, margins_m, *(listed(each, count) for each in others), strict=True
            )
        )


def varies(value: Value) -> bool:
    """Return whether a value of a :class:`PersonAhead` has one number for each time."""
    return isinstance(value, np.ndarray) and value.ndim > 0


def listed(value: Value, count: int) -> list[float]:
    """Return a value of a :class:`PersonAhead` at each of the ``count`` times."""
    if isinstance(value, np.ndarray) and value.ndim:
        numbers: list[float] = value.tolist()
        return numbers
    return [float(value)] * count


def people_ahead(
    constraints: NavConstraints, times_s: FloatArray, aware_for_s: float
) -> Iterator[PersonAhead]:
    """Yield the people at times (T,) after the stamp of the constraints."""
    basis = constraints.speed_basis
    assert basis is not None
    now, shown = constraints.stamp_s, {track.id: track for track in basis.tracks}
    for track_id, person in basis.people.items():
        is_shown = shown.get(track_id) is person.track
        yield _ahead(basis, now, times_s, aware_for_s, track_id, person, is_shown)
    for track_id, person in basis.lost.items():
        rise_mps2 = basis.policy.timing.lost_rise_mps2 or 0.0
        lost_s = person.lost_for_s(now) + times_s
        least_mps = (person.lost_limit_mps or 0.0) + rise_mps2 * lost_s
        ahead = _ahead(basis, now, times_s, aware_for_s, track_id, person, False)
        yield ahead._replace(least_mps=least_mps)


def _ahead(
    basis: SpeedBasis,
    now: float,
    times_s: FloatArray,
    aware_for_s: float,
    track_id: int,
    person: Person,
    is_shown: bool,
) -> PersonAhead:
    """Return a person at times ahead. Those whom the latest frame shows are seen as now."""
    track, policy = person.track, basis.policy
    fresh_s, margins = policy.timing.fresh_within_s, policy.margins
    age_s = max(now - track.stamp_s, 0.0)
    seen_s = min(person.seen_stamp_s, track.stamp_s - track.time_since_seen_s)
    is_seen = is_shown and track.status != "coasting" and now - seen_s <= fresh_s - _SAME_AGE_S
    speed_mps: Value = 0.0
    delay_s: Value = 0.0
    unaware_mps = policy.speed.human_speed_mps(0.0)
    reach = basis.rules.reach(person, now)
    if reach is not None:
        speed_mps, delay_s = reach.speed_mps, reach.delay_s
    unaware_mps = max(unaware_mps, math.hypot(*person.velocity_odom_mps))
    sigmas: Value = basis.rules.sigmas(person, now)
    covariance = track.covariance_odom.tolist()
    variances: tuple[Value, ...] = covariance_terms(covariance, 1.0)
    sigma_m: Value = person.sigma_m
    if not is_seen:
        # No later frame shows them: unaware, and less and less certain.
        unseen = now + times_s - seen_s > fresh_s - _SAME_AGE_S
        speed_mps = np.where(unseen, max(unaware_mps, speed_mps), speed_mps)
        sigmas = np.where(unseen, max(sigmas, margins.unseen_sigmas), sigmas)
        if is_shown:
            if policy.reach is not None:
                later_s = np.minimum(track.stamp_s + times_s - seen_s, fresh_s)
                delay_s = np.maximum(delay_s, policy.reach.delay_s + later_s)
            ahead = [_terms_ahead(covariance, each) for each in times_s.tolist()]
            # A covariance may shrink at first; nobody says that this one does.
            variances = tuple(np.maximum(np.array(variances), np.array(ahead)).T)
        until_s = np.minimum(
            age_s + times_s, max(age_s, policy.timing.stop_after_s) + (times_s if is_shown else 0.0)
        )
        ahead_m = np.array([position_sigma_m(track, each) for each in until_s.tolist()])
        sigma_m = np.maximum(sigma_m, ahead_m)
    if basis.prediction is not None:
        ahead_m = predicted_sigmas_m(track, age_s + times_s, basis.prediction)
        sigma_m = np.maximum(sigma_m, ahead_m)
        variances = (np.maximum(variances[0], ahead_m**2), *variances[1:])
    if aware_for_s < times_s[-1]:
        speed_mps = np.where(times_s > aware_for_s, np.maximum(unaware_mps, speed_mps), speed_mps)
    x, y = person.track_position_odom_m
    vx, vy = person.velocity_odom_mps
    moves_s: Value = times_s if is_shown and (vx or vy) else 0.0
    a0, a1, a2 = (sigmas * sigmas * each for each in variances)
    return PersonAhead(
        *(track_id, x + vx * moves_s, y + vy * moves_s, vx, vy, speed_mps),
        0.0 if policy.reach is None else policy.reach.time_constant_s,
        delay_s,
        min(age_s, OLDEST_S) if is_shown else np.minimum(age_s + times_s, OLDEST_S),
        (a0, a1, a2),
        BODY_RADIUS_M + sigmas * sigma_m,
    )


def _terms_ahead(covariance: list[list[float]], ahead_s: float) -> tuple[float, float, float]:
    """Return the terms of a covariance that is predicted at constant velocity."""
    P = np.array(covariance)
    P[:2] += ahead_s * P[2:]
    P[:, :2] += ahead_s * P[:, 2:]
    return covariance_terms(P.tolist(), 1.0)
