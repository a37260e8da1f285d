"""The adapter's knowledge of each person, now and at times ahead, as the rules ask for it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from tracking import PersonTrack
from tracking.prediction import PredictionModel

from ._people import Person, human_speed_mps
from ._places import position_sigma_m
from ._policy import AwarenessPolicy
from ._predicted import predicted_sigmas_m
from .reach import Reach, Spread
from .rules import Known, Lost, Sectors

# Ages count up to this one, with which a person may be anywhere near.
_OLDEST_S: Final = 10.0
# Ages closer than this are equal.
_SAME_AGE_S: Final = 1e-9


def known_now(
    policy: AwarenessPolicy, unaware_mps: float, key: int, person: Person, now: float
) -> Known:
    """Return what is known of a person at ``now``, the stamp of the update or later.

    The policy's U of unaware people is given, as it is the same for all.
    """
    track, velocity, margins = person.track, person.velocity_odom_mps, policy.margins
    speed_mps = unaware_mps
    if person.awareness_lower > 0.0:
        speed_mps = human_speed_mps(policy, person.awareness_lower)
        # At least what they show, whatever they have noticed.
        speed_mps = min(max(speed_mps, person.departed_mps), max(speed_mps, unaware_mps))
    later_mps = unaware_mps
    first_mps = speed_mps
    if person.is_at_first_sight:
        first_mps = unaware_mps
    within_m = margins.within_m(speed_mps, unaware_mps)
    walking_mps = math.hypot(*velocity)
    if walking_mps > unaware_mps > 0.0:
        # Faster people may stay so. In proportion, so that presets stay ordered.
        speed_mps *= walking_mps / unaware_mps
        later_mps = walking_mps
        first_mps *= walking_mps / unaware_mps
    # Between the frame that showed the person and the track's stamp nobody looked. The covariance
    # grows with it; what they began in the last moments it does not know.
    unseen_s = min(max(track.stamp_s - person.seen_stamp_s, 0.0), policy.timing.fresh_within_s)
    sigmas = margins.uncertainty_sigmas
    if now - _seen_s(person) > policy.timing.fresh_within_s:
        sigmas = max(sigmas, margins.unseen_sigmas)
    reach = Reach(
        *person.track_position_odom_m,
        *velocity,
        speed_mps,
        policy.reach.time_constant_s,
        policy.reach.delay_s + unseen_s,
        min(max(now - track.stamp_s, 0.0), _OLDEST_S),
        margins.floor_m,
        within_m,
        Spread.of(track.covariance_odom.tolist()).terms(sigmas),
        person.counts_for_s(),
        later_mps,
    )
    return Known(key, reach, first_mps, BODY_RADIUS_M + sigmas * person.sigma_m)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpeedBasis:
    """The values that one speed limit was computed from, for limits at other poses and times.

    It holds the adapter's own frozen values, so that keeping it costs an update next to nothing.
    :func:`nav_adapter.exporters.speed_limit_at` reads it, and the robot of the constraints. Its
    attributes are private.

    Attributes:
        stamp_s: of the update.
        policy: the adapter's.
        people: who count in full, by key.
        lost: people who were dropped and still limit the speed, by key.
        tracks: the input of the update; people of other tracks are missing.
        robot_age_s: age of the robot's state at the stamp.
        perception_age_s: age of the latest frame at the stamp.
        ceiling_mps: ceiling of the limit during the recovery after stale data, or None.
        prediction: of the adapter; None if places ahead are as certain as the present one.
        seen_s: stamps from which the sectors about the base are seen; empty if that is not known.
        velocity_base_mps: of the robot, forward and left; None if it stands.
    """

    stamp_s: float
    policy: AwarenessPolicy
    people: Mapping[int, Person]
    lost: Mapping[int, Person]
    tracks: tuple[PersonTrack, ...]
    robot_age_s: float
    perception_age_s: float
    ceiling_mps: float | None
    prediction: PredictionModel | None = None
    seen_s: Sectors = ()
    velocity_base_mps: tuple[float, float] | None = None

    @property
    def stands(self) -> bool:
        """True if the robot stands."""
        return self.velocity_base_mps is None

    @property
    def stopped(self) -> bool:
        """True if the data are so old that the limit is 0 everywhere."""
        oldest_s = max(self.robot_age_s, self.perception_age_s)
        return oldest_s > self.policy.timing.stop_after_s

    def known_ahead(
        self, times_s: FloatArray, aware_for_s: float = math.inf
    ) -> Iterator[list[Known]]:
        """Yield what will be known of each person at times (T,) after the stamp.

        People go straight on. Those whom the latest frame shows are seen as now; no later frame
        shows the others, so they are unaware from some time on, and less and less certain.
        """
        shown = {track.id: track for track in self.tracks}
        times = times_s.tolist()
        for key, person in self.people.items():
            is_shown = shown.get(person.track.id) is person.track
            yield self._ahead(times_s, times, aware_for_s, key, person, is_shown)
        rule = Lost(self.policy.timing.lost_rise_mps2)
        for key, person in self.lost.items():
            first_mps, lost_s = person.lost_limit_mps or 0.0, person.lost_for_s(self.stamp_s)
            ahead = self._ahead(times_s, times, aware_for_s, key, person, False)
            yield [
                known._replace(least_mps=rule.least_mps(first_mps, lost_s + time_s))
                for known, time_s in zip(ahead, times, strict=True)
            ]

    def _ahead(
        self,
        times_s: FloatArray,
        times: list[float],
        aware_for_s: float,
        key: int,
        person: Person,
        is_shown: bool,
    ) -> list[Known]:
        track, policy, now = person.track, self.policy, self.stamp_s
        timing, margins = policy.timing, policy.margins
        unaware_mps = human_speed_mps(policy, 0.0)
        present = known_now(policy, unaware_mps, key, person, now)
        reach, (vx, vy) = present.reach, person.velocity_odom_mps
        seen_s, age_s = _seen_s(person), max(now - track.stamp_s, 0.0)
        fresh_s = timing.fresh_within_s - _SAME_AGE_S
        is_seen = is_shown and track.status != "coasting" and now - seen_s <= fresh_s
        if is_seen:
            ahead = [present] * len(times)
            if vx or vy or reach.until_s < math.inf:
                ahead = [
                    present._replace(
                        reach=reach._replace(
                            x_m=reach.x_m + vx * t,
                            y_m=reach.y_m + vy * t,
                            until_s=person.counts_for_s(t),
                        )
                    )
                    for t in times
                ]
            if self.prediction is None and aware_for_s > times[-1]:
                return ahead
        else:
            ahead = [self._unseen(present, person, t, is_shown, seen_s, age_s) for t in times]
        predicted_m: list[float] = [0.0] * len(times)
        if self.prediction is not None:
            predicted_m = predicted_sigmas_m(track, age_s + times_s, self.prediction).tolist()
        unaware_mps = max(unaware_mps, math.hypot(vx, vy))
        rows = []
        for known, time_s, sigma_m in zip(ahead, times, predicted_m, strict=True):
            reach = known.reach
            sigmas = margins.uncertainty_sigmas
            if not is_seen and now + time_s - seen_s > fresh_s:
                sigmas = max(sigmas, margins.unseen_sigmas)
            a0, a1, a2 = reach.variances
            if time_s >= aware_for_s:
                reach = reach.at_least(unaware_mps)
            rows.append(
                known._replace(
                    reach=reach._replace(variances=(max(a0, (sigmas * sigma_m) ** 2), a1, a2)),
                    body_m=max(known.body_m, BODY_RADIUS_M + sigmas * sigma_m),
                )
            )
        return rows

    def _unseen(
        self,
        present: Known,
        person: Person,
        time_s: float,
        is_shown: bool,
        seen_s: float,
        age_s: float,
    ) -> Known:
        """Return what is known of a person at a time ahead if no later frame shows them."""
        track, policy, reach = person.track, self.policy, present.reach
        timing, margins = policy.timing, policy.margins
        (vx, vy), delay_s = person.velocity_odom_mps, reach.delay_s
        sigmas = margins.uncertainty_sigmas
        if self.stamp_s + time_s - seen_s > timing.fresh_within_s - _SAME_AGE_S:
            reach = reach.at_least(max(human_speed_mps(policy, 0.0), math.hypot(vx, vy)))
            sigmas = max(sigmas, margins.unseen_sigmas)
        spread = Spread.of(track.covariance_odom.tolist())
        variances = spread.terms(sigmas)
        until_s = max(age_s, timing.stop_after_s)
        if is_shown:
            later_s = min(track.stamp_s + time_s - seen_s, timing.fresh_within_s)
            delay_s = max(delay_s, policy.reach.delay_s + later_s)
            # A covariance may shrink at first; nobody says that this one does.
            ahead = spread.after(time_s).terms(sigmas)
            variances = (
                max(variances[0], ahead[0]),
                max(variances[1], ahead[1]),
                max(variances[2], ahead[2]),
            )
            until_s += time_s
        sigma_m = max(person.sigma_m, position_sigma_m(track, min(age_s + time_s, until_s)))
        moved_s, elapsed_s = (time_s, age_s) if is_shown else (0.0, age_s + time_s)
        return present._replace(
            reach=reach._replace(
                x_m=reach.x_m + vx * moved_s,
                y_m=reach.y_m + vy * moved_s,
                delay_s=delay_s,
                until_s=person.counts_for_s(moved_s),
                elapsed_s=min(elapsed_s, _OLDEST_S),
                variances=variances,
            ),
            body_m=BODY_RADIUS_M + sigmas * sigma_m,
        )


def _seen_s(person: Person) -> float:
    """Return the stamp of the frame that shows where the track is; it may be older than seen."""
    return min(person.seen_stamp_s, person.track.stamp_s - person.track.time_since_seen_s)
