"""Settings besides radius and speed: reach, margins, time behaviour, alerts and requests."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from perception.anthropometry import BODY_RADIUS_M

from .._config import NavConfig


class ReachRules(NavConfig):
    """Rules of how people change their motion, and how far the robot may turn while it stops.

    Attributes:
        time_constant_s: τ, in which a person changes to another velocity. 0.54 s is the fit to
            recorded people who set off (docs/people.md).
        delay_s: δ, how long a person may have begun to do so before the sensors show it.
        turn_deg: the robot may turn by this much off its course, either way, while it stops; 0
            counts for a robot whose profile says ``brakes_on_curve``.
    """

    time_constant_s: float = Field(default=0.54, ge=0.05, le=5.0)
    delay_s: float = Field(default=0.15, ge=0.0, le=2.0)
    turn_deg: float = Field(default=30.0, ge=0.0, le=180.0)


class SafetyMargins(NavConfig):
    """Margins that hold for every α.

    Attributes:
        clearance_m: from footprint to body, in every direction; at least 0.10 m. Body radius
            (0.30 m) plus this is the floor of every obstacle radius.
        uncertainty_sigmas: number of standard deviations of a person's place and velocity (along
            the most uncertain direction) that enlarge obstacle and reach. 2 covers 98 % of a normal
            error towards the robot.
        unseen_sigmas: the number that enlarges the reach of a person unseen for longer than
            ``fresh_within_s``; at least ``uncertainty_sigmas`` count. No measurement corrects the
            prediction of an unseen person.
    """

    clearance_m: float = Field(default=0.10, ge=0.10, le=2.0)
    uncertainty_sigmas: float = Field(default=2.0, ge=0.0, le=5.0)
    unseen_sigmas: float = Field(default=2.5, ge=0.0, le=5.0)

    @property
    def floor_m(self) -> float:
        """Smallest radius of any obstacle: body radius plus clearance."""
        return BODY_RADIUS_M + self.clearance_m

    def within_m(self, speed_mps: float, unaware_mps: float) -> float:
        """Return how much of the reach of somebody with this U lies within the clearance.

        It is 0 at the U of unaware people, and the whole clearance at a U of 0.
        """
        return max(1.0 - speed_mps / unaware_mps, 0.0) * self.clearance_m if unaware_mps else 0.0


class TimeBehaviour(NavConfig):
    """Time behaviour of the adapter. Growth needs no setting: obstacles grow at once.

    Attributes:
        shrink_rate_mps: largest rate at which an obstacle shrinks, while frames show the person.
        fresh_within_s: a person unseen for longer counts as unaware. Must exceed the camera's
            period plus the delay of perception.
        hold_s: a confirmed person who disappears from the input is kept, as unaware and with
            constant velocity, until this time after the last sighting.
        lost_rise_mps2: when such a person is dropped, or one whom the tracker has given up out of
            sight, the limit that they set rises no faster than this. None: it rises at once.
        stale_after_s: if perception or the robot's state is older, everyone counts as unaware.
        stop_after_s: if either is older than this, the speed limit is 0.
    """

    shrink_rate_mps: float = Field(default=0.5, gt=0.0, le=5.0)
    fresh_within_s: float = Field(default=0.25, gt=0.0, le=1.0)
    hold_s: float = Field(default=1.0, ge=0.0, le=10.0)
    lost_rise_mps2: float | None = Field(default=0.7, gt=0.0, le=10.0)
    stale_after_s: float = Field(default=0.5, gt=0.0, le=5.0)
    stop_after_s: float = Field(default=1.5, gt=0.0, le=10.0)

    @model_validator(mode="after")
    def _check_order(self) -> TimeBehaviour:
        if not self.fresh_within_s <= self.stale_after_s <= self.stop_after_s:
            raise ValueError(
                "fresh_within_s <= stale_after_s <= stop_after_s must hold, got "
                f"{self.fresh_within_s:g} s, {self.stale_after_s:g} s, {self.stop_after_s:g} s"
            )
        return self


class AlertRules(NavConfig):
    """Rules for alerts: whom to warn, how, and how often at most.

    A person is warned if the lower bound of α is below 0.3 and the moving robot passes within
    ``miss_within_m``. Of the alerts whose time is reached, the loudest is given: horn before voice
    before light. The same person gets the same alert again after 3 s at the earliest. A sound
    comes at least 1 s after the last one that was as loud or louder.

    Attributes:
        miss_within_m: a person is warned if the gap between robot and body at the closest approach,
            at constant velocities, is at most this.
        light_within_s: time to the closest approach below which light is given; 0 for never.
        voice_within_s: the same for a spoken warning.
        horn_within_s: the same for the horn.
    """

    miss_within_m: float = Field(default=0.5, ge=0.0, le=5.0)
    light_within_s: float = Field(default=5.0, ge=0.0, le=30.0)
    voice_within_s: float = Field(default=3.5, ge=0.0, le=30.0)
    horn_within_s: float = Field(default=2.0, ge=0.0, le=30.0)


class AttentionRules(NavConfig):
    """Rules for requests for attention: whom to ask to look at the robot, and how often at most.

    A person is asked who sets the speed limit and has not noticed the robot, if their look would
    win ``min_gain_s`` or end a wait of both. People close together are asked once. A request that
    is not answered doubles the pause until the next one to the same person, which uses the next
    louder means. Only a look that perception measures raises a limit, never a request.

    Attributes:
        min_gain_s: the time that the robot would win must be at least this: the time behind the
            limit on its way past the person if they do not look, less the same if they do. Each is
            10 s at most, also for a robot and a person who stand and wait for each other.
        pause_s: time between the first two requests to the same person.
        per_minute: the robot makes at most so many requests in any minute.
        within_m: distance from the robot's base within which people are asked.
        means: what the robot has to ask with, the quietest first: ``"light"``, ``"voice"``. Light
            is left out for somebody who looks far past the robot (an α of at most 0.1).
    """

    min_gain_s: float = Field(default=2.0, ge=0.0, le=10.0)
    pause_s: float = Field(default=2.0, ge=1.0, le=60.0)
    per_minute: int = Field(default=6, ge=1, le=60)
    within_m: float = Field(default=8.0, gt=0.0, le=30.0)
    means: tuple[Literal["light", "voice"], ...] = Field(default=("light", "voice"), min_length=1)
