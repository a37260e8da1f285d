"""A person who reacts: what a scenario says about one."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from ...world.errors import SimError
from ..body import MAX_STATURE_M, MIN_STATURE_M, ActivityName


class RoutePoint(StrictConfig):
    """A corner of a route; metres in odom."""

    error: ClassVar[type[ValueError]] = SimError

    x_m: float
    y_m: float


class Pause(StrictConfig):
    """A stop on the way: where, as length walked, and how long."""

    error: ClassVar[type[ValueError]] = SimError

    at_m: float = Field(ge=0.0)
    for_s: float = Field(ge=0.0)


class Glances(StrictConfig):
    """When a person looks at the robot: an alternating renewal process with lognormal lengths.

    The defaults were fitted to 686 annotated pedestrians in front of approaching vehicles.

    Attributes:
        notices_within_m: the first glance comes only when the robot is nearer than this and can be
            seen; 0 for a person who never looks.
        first_glance_delay_s: from then on.
        glance_median_s: length of a glance.
        glance_quartiles_s: of the same.
        away_median_s: length of looking away.
        away_quartiles_s: of the same.
        watches: once the robot has been noticed, keeps looking as long as it can be seen.
        gives_up_after_s: looks away for good so long after the first glance; None never.
        looker_share: probability that the person ever looks at the robot at all. 1 for somebody
            who does; about 0.81 brings the process nearest to the pedestrians that it was fitted
            to, see :class:`GlanceProcess`.
        away_yaw_deg: where the head points between glances, left of the way the body faces.
        away_pitch_deg: up; a phone is read at about −40.
    """

    error: ClassVar[type[ValueError]] = SimError

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


class Reactions(StrictConfig):
    """What a person on a conflicting course does who has seen the robot: shares of the whole.

    What a mapping does not name gets none: ``{wait: 1}`` always waits. Shares are taken relative to
    their sum.

    Attributes:
        walk_on: changes nothing.
        wait: lets the robot pass.
        hurry: passes in front, faster.
        pass_behind: passes behind the robot.
        claim: steps up to go first, without haste, and expects the robot to yield.
    """

    error: ClassVar[type[ValueError]] = SimError

    walk_on: float = Field(default=0.3, ge=0.0, le=1.0)
    wait: float = Field(default=0.25, ge=0.0, le=1.0)
    hurry: float = Field(default=0.15, ge=0.0, le=1.0)
    pass_behind: float = Field(default=0.15, ge=0.0, le=1.0)
    claim: float = Field(default=0.15, ge=0.0, le=1.0)

    @model_validator(mode="before")
    @classmethod
    def _unnamed_get_none(cls, data: Any) -> Any:
        if isinstance(data, dict) and data:
            return {**dict.fromkeys(cls.model_fields, 0.0), **data}
        return data

    @model_validator(mode="after")
    def _some(self) -> Reactions:
        shares = [getattr(self, name) for name in type(self).model_fields]
        if not sum(shares) > 0.0:
            raise ValueError("at least one share of reactions must be above 0, got all 0")
        return self


class PersonSpec(StrictConfig):
    """A person who walks a route, glances about and reacts.

    Attributes:
        name: unique in the scenario.
        stature_m: body height.
        look: name of a shipped worker; default the one of nearest stature.
        route: at least one point; one alone stands there.
        speed_mps: free walking speed.
        start_s: when the person sets out.
        heading_deg: the way the body faces while standing; default along the route.
        backwards: walks with the back ahead.
        pauses: stops on the way.
        turns_back_at_m: after so many metres walks back to the start; None never.
        activity: what the hands do.
        glances: when the person looks at the robot.
        reactions: what the person does about it.
        social: keeps away from racks, people and, once it has been noticed, the robot.
    """

    error: ClassVar[type[ValueError]] = SimError

    name: str = Field(min_length=1)
    stature_m: float = Field(default=1.75, ge=MIN_STATURE_M, le=MAX_STATURE_M)
    look: str | None = None
    route: tuple[RoutePoint, ...] = Field(min_length=1)
    speed_mps: float = Field(default=1.34, gt=0.0, le=3.0)
    start_s: float = Field(default=0.0, ge=0.0)
    heading_deg: float | None = None
    backwards: bool = False
    pauses: tuple[Pause, ...] = ()
    turns_back_at_m: float | None = Field(default=None, gt=0.0)
    activity: ActivityName = "none"
    glances: Glances = Glances()
    reactions: Reactions = Reactions()
    social: bool = True
