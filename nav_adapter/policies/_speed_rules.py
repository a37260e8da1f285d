"""Assumptions on motion, and rules beside speed and separation."""

from __future__ import annotations

import math
from typing import ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from .._errors import NavError


class NearCap(StrictConfig):
    """A top speed near people, in any direction and for every α.

    Attributes:
        within_m: the cap holds up to this distance from footprint to body, less uncertainty.
        speed_mps: the cap. Beyond ``within_m`` the limit rises with distance so that a braking
            robot has slowed down to the cap when it gets there.
    """

    error: ClassVar[type[ValueError]] = NavError

    within_m: float = Field(default=1.5, gt=0.0, le=20.0)
    speed_mps: float = Field(default=0.8, gt=0.0, le=10.0)

    def limit_mps(self, separation_m: ArrayLike, deceleration_mps2: float) -> FloatArray:
        """Return the limit at each separation (m) for this deceleration; NaN gives the cap."""
        beyond_m = np.asarray(separation_m, dtype=np.float64) - self.within_m
        beyond_m = np.where(beyond_m > 0.0, beyond_m, 0.0)
        return np.asarray(np.sqrt(self.speed_mps**2 + 2.0 * deceleration_mps2 * beyond_m))


class DistanceZones(StrictConfig):
    """A speed limit that falls linearly with distance, from full speed to a stop.

    Distances run from the footprint to the body, less uncertainty, as in speed and separation.

    Attributes:
        stop_within_m: the limit is 0 up to this distance.
        full_speed_beyond_m: the limit is the robot's maximum from this distance on.
    """

    error: ClassVar[type[ValueError]] = NavError

    stop_within_m: float = Field(default=0.3, ge=0.0, le=20.0)
    full_speed_beyond_m: float = Field(default=3.0, gt=0.0, le=50.0)

    @model_validator(mode="after")
    def _check_order(self) -> DistanceZones:
        if self.full_speed_beyond_m <= self.stop_within_m:
            raise ValueError(
                "full_speed_beyond_m must exceed stop_within_m, got "
                f"{self.full_speed_beyond_m:g} m and {self.stop_within_m:g} m"
            )
        return self

    def limit_mps(self, separation_m: ArrayLike, maximum_mps: float) -> FloatArray:
        """Return the limit at each separation (m) for this maximum speed; NaN gives 0."""
        span_m = self.full_speed_beyond_m - self.stop_within_m
        share = (np.asarray(separation_m, dtype=np.float64) - self.stop_within_m) / span_m
        share = np.where(share > 0.0, np.minimum(share, 1.0), 0.0)
        return np.asarray(maximum_mps * share)


# Rounding of a product of two settings.
_ROUNDING_MPS: Final = 1e-9


class StandingPeople(StrictConfig):
    """A bound on human acceleration, for people who stand.

    Speed and separation assumes that such a person reaches the assumed human speed at
    ``human_acceleration_mps2``, having begun ``start_delay_s`` before the frame. The way is never
    longer than without this rule. It holds for confirmed people beyond first sight, whom a frame of
    the last ``fresh_within_s`` shows standing; for everybody else nothing changes.

    Attributes:
        human_acceleration_mps2: of a person who sets off. 2 m/s² after 0.25 s is above the 99.9th
            percentile of recorded people (docs/safety.md).
        start_delay_s: longest time in which your sensors and tracker still show a person as
            standing who has begun to walk. Measure it; it decides what the rule is worth. At half
            the time of speeding up (0.4 s for 1.6 m/s and 2 m/s²) it is worth nothing.
        standing_below_mps: a person stands whose track is no faster, √(speed² + largest variance of
            the velocity). At most the speed reached in ``start_delay_s``, so that somebody who just
            counts as standing is covered.
        delay_from_tracks: True takes for each person the time since which they can have been
            walking by ``PersonTrack.moved_m``, and at least ``start_delay_s``. A person without
            ``moved_m`` then counts as walking. False takes ``start_delay_s`` for everybody.
    """

    error: ClassVar[type[ValueError]] = NavError

    human_acceleration_mps2: float = Field(default=2.0, ge=0.1, le=20.0)
    start_delay_s: float = Field(default=0.25, ge=0.0, le=2.0)
    standing_below_mps: float = Field(default=0.2, ge=0.0, le=2.0)
    delay_from_tracks: bool = False

    @model_validator(mode="after")
    def _check_reached_speed(self) -> StandingPeople:
        reached_mps = self.human_acceleration_mps2 * self.start_delay_s
        if self.standing_below_mps > reached_mps + _ROUNDING_MPS:
            raise ValueError(
                "standing_below_mps must be at most human_acceleration_mps2 × start_delay_s = "
                f"{reached_mps:g} m/s, got {self.standing_below_mps:g} m/s"
            )
        return self

    def delay_s(self, unseen_s: float, moved_m: float, moved_age_s: float) -> float:
        """Return how long before a track's stamp its person may have begun to walk.

        A person who has come by at most d with accelerations of at most a has been speeding up for
        √(2 d / a) at most, or is no faster than one who has. It is infinite for a person of whom
        ``moved_m`` says nothing, if the delay is from tracks.

        Args:
            unseen_s: time between the frame that showed the person and the stamp.
            moved_m: as :class:`~tracking.PersonTrack` has it.
            moved_age_s: the same.
        """
        least_s = self.start_delay_s + unseen_s
        if not self.delay_from_tracks:
            return least_s
        moving_s = math.sqrt(2.0 * moved_m / self.human_acceleration_mps2)
        return max(least_s, moved_age_s + moving_s)

    def is_standing(self, speed_mps: float, velocity_variance_m2ps2: float) -> bool:
        """Return whether a track of this speed stands; False for NaN.

        Args:
            speed_mps: length of the track's velocity.
            velocity_variance_m2ps2: its largest variance in any direction.
        """
        return speed_mps * speed_mps + velocity_variance_m2ps2 <= self.standing_below_mps**2


class WalkingPeople(StrictConfig):
    """A bound on human acceleration, for people who walk: who walks away must first turn round.

    Speed and separation then counts from the velocity of the track, which changes by at most
    ``human_acceleration_mps2`` in any direction, up to the assumed human speed. The way is never
    longer than without this rule. It holds for confirmed people beyond first sight whom a frame of
    the last ``fresh_within_s`` shows, at every α.

    Attributes:
        human_acceleration_mps2: of a person who turns to the robot. With 2 m/s² after 0.25 s no
            recorded person got farther off their course (docs/safety.md).
        turn_delay_s: longest time for which your sensors and tracker may still show the velocity
            from before the turn, beyond ``velocity_sigmas``.
        velocity_sigmas: so many standard deviations, in the most uncertain direction, the velocity
            towards the robot may be above that of the track.
    """

    error: ClassVar[type[ValueError]] = NavError

    human_acceleration_mps2: float = Field(default=2.0, ge=0.1, le=20.0)
    turn_delay_s: float = Field(default=0.25, ge=0.0, le=2.0)
    velocity_sigmas: float = Field(default=2.0, ge=0.0, le=10.0)


class StartReserve(StrictConfig):
    """A reserve for people who set off, however aware they are.

    Of aware people speed and separation assumes little or no motion, and a look is no promise. With
    this rule the robot is never faster than it can stop before somebody reaches it who sets off
    now: at ``human_acceleration_mps2`` up to the speed assumed for unaware people, from the speed
    at which the track comes nearer already. The robot's reaction time covers the time until the
    track shows a start. The rule counts no clearance, and a robot that keeps its course: nobody is
    touched, but the separation may be used up. It only lowers the limit.

    Attributes:
        human_acceleration_mps2: as in :class:`StandingPeople`.
        start_delay_s: time until the track shows a start, beyond the robot's reaction time.
    """

    error: ClassVar[type[ValueError]] = NavError

    human_acceleration_mps2: float = Field(default=2.0, ge=0.1, le=20.0)
    start_delay_s: float = Field(default=0.0, ge=0.0, le=2.0)


class NoticedPeople(StrictConfig):
    """A rule for people who have noticed the robot, and do not look at it now.

    ``PersonTrack.noticed`` is the belief that they know of the robot. While it is high enough, the
    lower bound of α is at least ``counts_as_awareness``, for obstacle and speed limit. Hysteresis
    of a policy is held by looks alone.

    Attributes:
        at_least: the belief from which it counts.
        counts_as_awareness: in [0, 1]. Where there is a level for people who watch the robot, keep
            it at ``aware_above``: who watches stands still, who has noticed may walk on.
    """

    error: ClassVar[type[ValueError]] = NavError

    at_least: float = Field(default=0.5, gt=0.0, le=1.0)
    counts_as_awareness: float = Field(default=0.6, ge=0.0, le=1.0)


class ProtectiveField(StrictConfig):
    """A field like that of a safety laser scanner, for comparisons with today's robots.

    Only people in the straight path of the robot limit its speed, and the speed of their tracks
    does not count, as such a scanner knows neither people nor speeds. So this is the one rule that
    raises the limit above speed and separation: with it the safety argument does not hold.

    Attributes:
        beside_m: supplement to the width of the robot on either side.
    """

    error: ClassVar[type[ValueError]] = NavError

    beside_m: float = Field(default=0.10, ge=0.0, le=5.0)


class SpeedRules(StrictConfig):
    """Assumptions on the motion of robot and people, and rules beside speed and separation.

    ``standing`` and ``walking`` raise the limit where people need time to set off or to turn, and
    ``protective_field`` replaces it. The other rules only lower it.

    Attributes:
        turn_within_stop_deg: largest turn of the robot off its direction of travel while it stops.
            Towards a person farther off than this, the robot advances by less than its stopping
            distance, and towards a person straight behind not at all: such people limit the speed
            less. At 180 every person counts as straight ahead; robots that can drive sideways need
            that.
        people_turn_deg: largest turn of a brisk walker towards the robot while it stops. The speed
            after that turn counts, for every α. It holds in full for people as fast as an unaware
            person is assumed to be, not at all below three quarters of that, and in proportion in
            between. At 0 only the present closing speed counts.
        protective_field: a field like that of a safety laser scanner, for the baseline ``scanner``,
            or None.
        standing: how far people get who stand, or None for people who walk at once.
        walking: how fast people change their velocity, or None for people who turn at once.
        start_reserve: a reserve for people who set off, however aware they are, or None.
        zones: a limit over distance, or None.
        near_cap: a limit near people, or None.
    """

    error: ClassVar[type[ValueError]] = NavError

    turn_within_stop_deg: float = Field(default=90.0, ge=45.0, le=180.0)
    people_turn_deg: float = Field(default=45.0, ge=0.0, le=180.0)
    protective_field: ProtectiveField | None = None
    standing: StandingPeople | None = None
    walking: WalkingPeople | None = None
    start_reserve: StartReserve | None = None
    zones: DistanceZones | None = None
    near_cap: NearCap | None = None
