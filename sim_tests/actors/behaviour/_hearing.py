"""The hearing of people whom a robot asks for attention, and their answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from pydantic import Field, model_validator

from ...world.config import SimConfig

StartleKind = Literal["", "stop", "aside", "into_path"]
RequestMeans = Literal["light", "voice"]

#: The upper quartile of a standard normal distribution.
UPPER_QUARTILE: Final = 0.6744897501960817
# Requests that were heard this long ago have worn off.
_MEMORY_S: Final = 60.0
#: Motion is noticed up to this angle from the head's direction: the horizontal field of both eyes
#: is about 200 degrees (Strasburger et al. 2011, Journal of Vision 11(5):13).
FIELD_RAD: Final = math.radians(100.0)


class Hearing(SimConfig):
    """The hearing of people: figures of how they hear a request for attention and answer it.

    A request is heard with a probability: the product of the factors of distance, activity,
    repetition and, of a light, ``light_factor``. A person who hears it answers by a look with the
    probability ``answers``, and startles at a voice with the probability ``startles``. People who
    were not meant do both with ``bystander_factor`` times these. Most of these numbers have not
    been measured; ``docs/people.md`` names the sources.

    Attributes:
        answers: probability that a person who was addressed and has heard it looks at the robot.
        startles: probability that a person who has heard a voice startles.
        startles_into_path: share of those who startle that step into the robot's path; half of the
            others stop, and half of them step aside.
        phone_factor: of somebody with a phone.
        carrying_factor: of somebody who carries a box.
        distracted_factor: of any other activity, as of those who sit or kneel at their work.
        heard_within_m: distance up to which nothing is lost in the noise of the plant.
        not_heard_beyond_m: distance from which on nothing is heard; the factor falls evenly.
        light_factor: of a light, which must also be in the field of view, ±100° from the head's
            direction, with a free line of sight.
        bystander_factor: of people who are not addressed.
        habituation: factor for each request that the person has heard within the last minute.
        delay_median_s: median time from the request to the beginning of the answer.
        delay_spread: its upper quartile is this many times the median, and the median this many
            times the lower quartile; 1 always gives the median.
        look_median_s: median duration of the look, from the moment that it meets the robot.
        look_spread: as ``delay_spread``.
    """

    answers: float = Field(default=0.5, ge=0.0, le=1.0)
    startles: float = Field(default=0.05, ge=0.0, le=1.0)
    startles_into_path: float = Field(default=0.5, ge=0.0, le=1.0)
    phone_factor: float = Field(default=0.5, ge=0.0, le=1.0)
    carrying_factor: float = Field(default=0.9, ge=0.0, le=1.0)
    distracted_factor: float = Field(default=0.7, ge=0.0, le=1.0)
    heard_within_m: float = Field(default=6.0, ge=0.0, le=100.0)
    not_heard_beyond_m: float = Field(default=15.0, gt=0.0, le=200.0)
    light_factor: float = Field(default=0.5, ge=0.0, le=1.0)
    bystander_factor: float = Field(default=0.3, ge=0.0, le=1.0)
    habituation: float = Field(default=0.9, ge=0.0, le=1.0)
    delay_median_s: float = Field(default=0.7, ge=0.0, le=10.0)
    delay_spread: float = Field(default=1.4, ge=1.0, le=5.0)
    look_median_s: float = Field(default=1.0, gt=0.0, le=30.0)
    look_spread: float = Field(default=1.27, ge=1.0, le=5.0)

    @model_validator(mode="after")
    def _falls_off_outwards(self) -> Hearing:
        if self.heard_within_m > self.not_heard_beyond_m:
            raise ValueError(
                "heard_within_m must be at most not_heard_beyond_m, got "
                f"{self.heard_within_m:g} and {self.not_heard_beyond_m:g} m"
            )
        return self

    @property
    def changes_text(self) -> str:
        """The numbers that are not the default, as ``--population`` takes them."""
        changed = self.model_dump(exclude_defaults=True)
        return ",".join(f"{key}={value:g}" for key, value in changed.items())

    def activity_factor(self, activity: str) -> float:
        """Return the factor of an activity."""
        if activity == "none":
            return 1.0
        known = {"phone": self.phone_factor, "carry_box": self.carrying_factor}
        return known.get(activity, self.distracted_factor)

    def distance_factor(self, distance_m: float) -> float:
        """Return the share of requests that is not lost in the noise over a distance."""
        if distance_m <= self.heard_within_m:
            return 1.0
        width_m = self.not_heard_beyond_m - self.heard_within_m
        beyond_m = distance_m - self.heard_within_m
        return max(1.0 - beyond_m / width_m, 0.0) if width_m > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Request:
    """A request for attention as it reaches one person.

    Attributes:
        t_s: time.
        means: a light or a voice.
        distance_m: from the robot.
        off_rad: angle of the robot from the direction of the person's head.
        sighted: the line from the person's eyes to the robot is free; only a light needs it.
        activity: of the person.
        addressed: the person is meant.
    """

    t_s: float
    means: RequestMeans
    distance_m: float
    off_rad: float = 0.0
    sighted: bool = True
    activity: str = "none"
    addressed: bool = True


@dataclass(frozen=True, slots=True)
class Heard:
    """The answer of a person who has heard a request.

    Attributes:
        from_s: time at which the answer begins.
        looks_for_s: how long the person looks at the robot once their gaze has met it; 0 for not
            at all.
        startle: empty, ``"stop"``, ``"aside"`` or ``"into_path"``.
    """

    from_s: float
    looks_for_s: float = 0.0
    startle: StartleKind = ""

    @property
    def looks(self) -> bool:
        """True if the person looks at the robot."""
        return self.looks_for_s > 0.0


class Ears:
    """The hearing of one person.

    Every request draws the same random numbers in the same order, whatever comes of it. With one
    seed, a person who answers at one value of ``answers`` therefore also answers at any higher one,
    at the same time and for as long.
    """

    def __init__(self, hearing: Hearing, rng: np.random.Generator) -> None:
        self._hearing, self._rng = hearing, rng
        self._heard_s: list[float] = []

    def hear(self, request: Request) -> Heard | None:
        """Return what the person does; None for nothing."""
        hears, looks, startles, how = self._rng.random(4).tolist()
        delay, duration = self._rng.standard_normal(2).tolist()
        hearing, now_s = self._hearing, request.t_s
        self._heard_s = [t_s for t_s in self._heard_s if now_s - t_s < _MEMORY_S]
        if hears >= self._chance(request):
            return None
        self._heard_s.append(now_s)
        share = 1.0 if request.addressed else hearing.bystander_factor
        startle: StartleKind = ""
        if request.means == "voice" and startles < share * hearing.startles:
            into = hearing.startles_into_path
            startle = "into_path" if how < into else "stop" if how < 0.5 + 0.5 * into else "aside"
        answers = looks < share * hearing.answers
        if not answers and not startle:
            return None
        return Heard(
            now_s + _drawn_s(hearing.delay_median_s, hearing.delay_spread, delay),
            _drawn_s(hearing.look_median_s, hearing.look_spread, duration) if answers else 0.0,
            startle,
        )

    def _chance(self, request: Request) -> float:
        """Return the probability that the request is heard, or its light seen."""
        hearing = self._hearing
        chance = hearing.distance_factor(request.distance_m)
        chance *= hearing.activity_factor(request.activity)
        chance *= hearing.habituation ** len(self._heard_s)
        if request.means == "light":
            in_view = request.sighted and abs(request.off_rad) <= FIELD_RAD
            chance *= hearing.light_factor if in_view else 0.0
        return chance


def _drawn_s(median_s: float, spread: float, normal: float) -> float:
    """Return the lognormal duration of a standard normal number."""
    return median_s * math.exp(math.log(spread) / UPPER_QUARTILE * normal)
