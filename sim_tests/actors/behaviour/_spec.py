"""Specification of a person who walks a route and reacts, as a scenario gives it."""

from __future__ import annotations

import itertools
from typing import Any, Literal

from pydantic import Field, model_validator

from ...world.config import SimConfig
from ..body import MAX_STATURE_M, MIN_STATURE_M, STAYING, ActivityName
from ._hearing import Hearing


class RoutePoint(SimConfig):
    """A corner of a route in odom.

    Attributes:
        x_m: position.
        y_m: position.
    """

    x_m: float
    y_m: float


class Pause(SimConfig):
    """A stop after a length of route, and its duration.

    Attributes:
        at_m: length of the route from its start to the stop.
        for_s: duration of the stop.
        heading_deg: heading during the stop; default that of the person who stands.
    """

    at_m: float = Field(ge=0.0)
    for_s: float = Field(ge=0.0)
    heading_deg: float | None = None


class Glances(SimConfig):
    """Glances at the robot: an alternating renewal process with lognormal durations.

    The defaults were fitted to 686 annotated pedestrians in front of approaching vehicles.

    Attributes:
        notices_within_m: largest distance for the first glance; 0 for a person who never looks.
        first_glance_delay_s: delay of the first glance after the robot becomes visible within that
            distance.
        glance_median_s: median duration of a glance.
        glance_quartiles_s: lower and upper quartile of it.
        away_median_s: median duration of looking away.
        away_quartiles_s: lower and upper quartile of it.
        watches: after the first glance, look at the robot as long as it is visible.
        gives_up_after_s: stop looking for good this long after the first glance; None never.
        looker_share: probability that the person ever looks at the robot. About 0.81 brings the
            process nearest to the pedestrians that it was fitted to, see :class:`GlanceProcess`.
        away_yaw_deg: yaw of the head between glances, left of the body's heading.
        away_pitch_deg: pitch of the head between glances, up; about −40 reads a phone.
    """

    notices_within_m: float = Field(default=12.0, ge=0.0)
    first_glance_delay_s: float = Field(default=0.3, ge=0.0)
    glance_median_s: float = Field(default=0.83, gt=0.0)
    glance_quartiles_s: tuple[float, float] = (0.47, 1.50)
    away_median_s: float = Field(default=1.03, gt=0.0)
    away_quartiles_s: tuple[float, float] = (0.63, 1.98)
    watches: bool = False
    gives_up_after_s: float | None = Field(default=None, ge=0.0)
    looker_share: float = Field(default=1.0, ge=0.0, le=1.0)
    away_yaw_deg: float = Field(default=0.0, ge=-80.0, le=80.0)
    away_pitch_deg: float = Field(default=0.0, ge=-40.0, le=40.0)

    @model_validator(mode="after")
    def _quartiles_about_the_median(self) -> Glances:
        for name in ("glance", "away"):
            lower, upper = getattr(self, f"{name}_quartiles_s")
            median = getattr(self, f"{name}_median_s")
            if not 0.0 < lower <= median <= upper:
                raise ValueError(
                    f"{name}_quartiles_s must be above 0 and on either side of the median "
                    f"{median:g} s, got {lower:g} and {upper:g} s"
                )
        return self


class GazeKey(SimConfig):
    """Direction of the head at a time, in the gaze plan of a person.

    ``look: ahead`` is the heading of the body, ``look: robot`` the direction to the robot's camera.
    The head points ``yaw_deg`` to the left of it and ``pitch_deg`` above it, and turns smoothly
    from one key to the next.

    Attributes:
        t_s: time from the start of the episode.
        look: direction that the angles are counted from.
        yaw_deg: yaw of the head, left positive.
        pitch_deg: pitch of the head, up positive.
    """

    t_s: float
    look: Literal["ahead", "robot"] = "ahead"
    yaw_deg: float = 0.0
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0)


class Reactions(SimConfig):
    """Shares of the reactions of a person who has seen the robot on a conflicting course.

    A reaction that a mapping does not name has share 0: ``{wait: 1}`` always waits. The shares are
    divided by their sum.

    Attributes:
        walk_on: change nothing.
        wait: let the robot pass.
        hurry: pass in front of the robot, faster.
        pass_behind: pass behind the robot.
        claim: go first a little faster, and expect the robot to yield.
    """

    walk_on: float = Field(default=0.3, ge=0.0, le=1.0)
    wait: float = Field(default=0.25, ge=0.0, le=1.0)
    hurry: float = Field(default=0.15, ge=0.0, le=1.0)
    pass_behind: float = Field(default=0.15, ge=0.0, le=1.0)
    claim: float = Field(default=0.15, ge=0.0, le=1.0)

    @model_validator(mode="before")
    @classmethod
    def _unnamed_shares_are_zero(cls, data: Any) -> Any:
        if isinstance(data, dict) and data:
            return {**dict.fromkeys(cls.model_fields, 0.0), **data}
        return data

    @model_validator(mode="after")
    def _sum_is_positive(self) -> Reactions:
        shares = [getattr(self, name) for name in type(self).model_fields]
        if not sum(shares) > 0.0:
            raise ValueError("at least one share of reactions must be above 0, got all 0")
        return self


class Lapse(SimConfig):
    """The end of a person's attention, some time after the first look at the robot.

    From then on the person walks as if no robot were there, until it touches them.

    Attributes:
        after_look_s: time from the first look at the robot to the lapse.
        looks_away: the person does not look at the robot any more.
        halts: the person stands from the first look on, and sets off at the lapse, also where
            ``start_s`` or a pause would come later.
    """

    after_look_s: float = Field(default=2.0, ge=0.0)
    looks_away: bool = True
    halts: bool = False


class PersonSpec(SimConfig):
    """A person who walks a route, glances at the robot and reacts to it.

    Attributes:
        name: unique in the scenario.
        stature_m: body height.
        look: name of a shipped worker; default the one of nearest stature.
        route: at least one point. With one point the person stands there.
        speed_mps: free walking speed.
        start_s: time of the start.
        sets_off_within_m: the person stands until the robot's nearest edge is this near to the line
            of the first piece of the route, before or after them, whether or not they see it. Then
            (not before ``start_s``) they set off, look away and walk as if no robot were there,
            until it touches them. None: at ``start_s``.
        heading_deg: heading while standing; default along the route.
        end_heading_deg: heading at the end of the route; default that of the person who stands.
        backwards: walk backwards.
        pauses: stops on the way.
        turns_back_at_m: length of route after which the person walks back to the start; None never.
        activity: activity of the hands; or ``sitting`` or ``kneeling``, at a route of one point.
            Seated and kneeling people look, but never move.
        glances: glances at the robot.
        gaze: a gaze plan in order of time, in place of glances: the person looks as planned,
            whether or not they see the robot, and does not react to it.
        reactions: shares of the reactions to it.
        lapse: when the person forgets the robot after a look at it; None never.
        keeps_off_m: distance from the body's centre that the person keeps from a known robot ahead;
            more for a person who walks behind the robot.
        social: social forces of racks, people and, once it has been noticed, the robot.
        hearing: how this person hears a request for attention; None as the scenario says.
        as_written: a population that draws speeds and glances keeps those of this person.
    """

    name: str = Field(min_length=1)
    stature_m: float = Field(default=1.75, ge=MIN_STATURE_M, le=MAX_STATURE_M)
    look: str | None = None
    route: tuple[RoutePoint, ...] = Field(min_length=1)
    speed_mps: float = Field(default=1.34, gt=0.0, le=3.0)
    start_s: float = Field(default=0.0, ge=0.0)
    sets_off_within_m: float | None = Field(default=None, ge=0.0)
    heading_deg: float | None = None
    end_heading_deg: float | None = None
    backwards: bool = False
    pauses: tuple[Pause, ...] = ()
    turns_back_at_m: float | None = Field(default=None, gt=0.0)
    activity: ActivityName = "none"
    glances: Glances = Glances()
    gaze: tuple[GazeKey, ...] = ()
    reactions: Reactions = Reactions()
    lapse: Lapse | None = None
    keeps_off_m: float = Field(default=0.45, ge=0.3, le=3.0)
    social: bool = True
    hearing: Hearing | None = None
    as_written: bool = False

    @model_validator(mode="after")
    def _gaze_in_order_of_time(self) -> PersonSpec:
        times = [key.t_s for key in self.gaze]
        if any(later <= earlier for earlier, later in itertools.pairwise(times)):
            raise ValueError(f"gaze must have increasing t_s, got {times}")
        return self

    @model_validator(mode="after")
    def _low_people_stay(self) -> PersonSpec:
        if self.stays and len(self.route) > 1:
            raise ValueError(
                f"a person with activity {self.activity!r} stays at one place: route must have one "
                f"point, got {len(self.route)}"
            )
        return self

    @model_validator(mode="after")
    def _who_sets_off_has_a_way(self) -> PersonSpec:
        if self.sets_off_within_m is not None and len(self.route) < 2:
            raise ValueError("sets_off_within_m needs a route of at least two points, got one")
        return self

    @property
    def stays(self) -> bool:
        """True if the person sits or kneels."""
        return self.activity in STAYING
