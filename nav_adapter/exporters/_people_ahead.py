"""People as the adapter will know them if they go straight on, and how far they can come."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._people import OLDEST_S, Person
from .._places import position_sigma_m
from .._predicted import predicted_sigmas_m
from .._robot import RobotProfile
from .._speed_basis import SpeedBasis
from ..limit import STEPS
from ..reach import SAME_MPS, WALKING_ON_S, covariance_terms

Value = Any
#: Parts of a step of time: the step that decides is divided into these.
PARTS: Final = 16
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


@dataclass(frozen=True, slots=True)
class Reaches:
    """The reach of all people at all times, in tables over parts of a step of time ahead.

    A row is one person at one time. Tables (J, rows) have one column where all rows are equal.

    Attributes:
        people: in the order of their rows.
        first: (P,) the first row of each person.
        follows: (P,) 1 for a person with a row for each of the times, 0 for one row for all.
        x_m: (rows,) place.
        y_m: the same.
        velocity_x_mps: (rows,).
        velocity_y_mps: (rows,).
        body_m: (rows,) body radius and uncertainty of the present place.
        least_mps: (rows,) what a lost person allows at least, or -∞.
        elapsed_s: (rows,) age of the place.
        react_s: (rows,) reaction time of the robot and age of the place.
        ahead_s: (J,) times ahead.
        drift_s: (J, rows) m of :class:`~nav_adapter.reach.Reach`.
        reach_m: (J, rows) r and the uncertainty; the body is not in it.
        around_m: (J, rows) farthest place of the body from the place now, until then.
        need_mps: (J, rows) a faster robot still moves.
        braked_m: (J, rows) way that braking has saved.
    """

    people: tuple[PersonAhead, ...]
    first: Any
    follows: Any
    x_m: FloatArray
    y_m: FloatArray
    velocity_x_mps: Any
    velocity_y_mps: Any
    body_m: Any
    least_mps: FloatArray
    elapsed_s: Any
    react_s: Any
    ahead_s: Any
    drift_s: Any
    reach_m: Any
    around_m: Any
    need_mps: Any
    braked_m: Any

    @classmethod
    def of(
        cls, people: tuple[PersonAhead, ...], times: int, basis: SpeedBasis, robot: RobotProfile
    ) -> Reaches:
        """Return the tables of one or more people."""
        counts, columns = [], []
        for each in people:
            least_mps = -np.inf if each.least_mps is None else each.least_mps
            values = (*each[1:9], *each.variances, each.body_m, least_mps)
            count = times if any(np.ndim(value) for value in values) else 1
            counts.append(count)
            columns.append(np.stack([np.broadcast_to(value, count) for value in values]))
        x, y, *others, least = np.concatenate(columns, axis=1)
        # Most rows of a person differ in place alone.
        different, each_row = np.unique(np.stack(others), axis=1, return_inverse=True)
        each_row = each_row.reshape(-1)
        vx, vy, U, tau, delay, elapsed, a0, a1, a2, body = different
        follows = np.array(counts) > 1
        first = np.cumsum([0, *counts[:-1]])
        a, react = robot.max_deceleration_mps2, robot.reaction_time_s + elapsed
        step_s = robot.max_speed_mps / a / STEPS * 2  # twice that of the limit
        steps = math.ceil((react.max() + robot.max_speed_mps / a) / step_s + 1e-6)
        t = (step_s / PARTS) * np.arange(PARTS * steps + 1)[:, None]
        late = np.maximum(t - react, 0.0)
        walking = np.hypot(vx, vy)
        m, r = np.zeros((len(t), 1)), np.zeros((len(t), 1))
        if basis.policy.reach is not None:
            m = tau * -np.expm1(-(t + elapsed) / tau)
            since = t + elapsed + delay
            r = U * (since + tau * np.expm1(-since / tau))
            variance = np.maximum(a0 + m * (a1 + m * a2), 0.0)
            r = r + np.sqrt(np.maximum.accumulate(variance, axis=0))
        around = np.maximum.accumulate(r + (m + 0.5 * step_s) * walking, axis=0)
        margin = np.maximum(basis.policy.margins.floor_m, body + basis.policy.margins.clearance_m)
        around = around + margin + elapsed * walking
        # Single precision: its rounding counts as reach, and that of squares grows with them.
        largest_m = float(around.max()) + robot.max_speed_mps * float(t[-1, 0])
        largest_m += 2.0 * robot.circumscribed_radius_m
        slack = 2e-6 * (2.0 + largest_m) ** 2

        def table(values: FloatArray) -> Any:
            """Return values (…, rows), or (…, 1) where all rows are equal."""
            values = values.astype(np.float32)
            return values[..., :1] if values.shape[-1] == 1 else values[..., each_row]

        if np.ptp(react) == 0.0:
            react, late = react[:1], late[:, :1]
        return cls(
            *(people, first, follows.astype(np.intp), x, y, vx[each_row].astype(np.float32)),
            *(vy[each_row].astype(np.float32), (body + slack)[each_row].astype(np.float32), least),
            *(elapsed[each_row].astype(np.float32), table(react), t[:, 0].astype(np.float32)),
            *(table(m), table(r + slack), table(around + 2.0 * slack), table(a * late)),
            table(0.5 * a * late * late),
        )


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
