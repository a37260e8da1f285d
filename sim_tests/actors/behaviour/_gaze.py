"""When somebody looks and when not: an alternating renewal process with lognormal lengths.

Where a person looks: the glances as head and eyes carry them out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...world.errors import SimError
from ..body import MAX_EYE_PITCH_RAD, MAX_EYE_YAW_RAD, MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD
from ._person import RobotBody
from ._spec import Glances

# The upper quartile of a standard normal.
_QUARTILE: Final = 0.6744897501960817


@dataclass(frozen=True, slots=True)
class LogNormalDuration:
    """Lengths of time whose logarithm is normal.

    Attributes:
        median_s: > 0.
        sigma: standard deviation of the logarithm, ≥ 0.
    """

    median_s: float
    sigma: float

    @classmethod
    def fitted(cls, median_s: float, quartiles_s: tuple[float, float]) -> LogNormalDuration:
        """The one of this median and of this ratio of its quartiles.

        A lognormal's quartiles lie at median · exp(±0.6745 σ): their ratio alone gives σ. Quartiles
        that do not lie evenly about the median in logarithms keep their ratio, not their places.
        """
        lower, upper = quartiles_s
        if not (median_s > 0.0 and 0.0 < lower <= median_s <= upper):
            raise SimError(
                "quartiles must be positive and lie on either side of the median, got "
                f"{lower:g} and {upper:g} s about {median_s:g} s"
            )
        return cls(median_s, math.log(upper / lower) / (2.0 * _QUARTILE))

    @property
    def mean_s(self) -> float:
        """Expected length."""
        return self.median_s * math.exp(0.5 * self.sigma**2)

    def draw_s(self, rng: np.random.Generator) -> float:
        """One length."""
        return self.median_s * math.exp(self.sigma * rng.standard_normal())

    def residual_s(self, rng: np.random.Generator) -> float:
        """What is left of the length that an instant at random falls into.

        Long ones are met more often (a lognormal weighted by its length is a lognormal of median
        · exp(σ²)), and the instant falls anywhere in it.
        """
        met = self.median_s * math.exp(self.sigma**2 + self.sigma * rng.standard_normal())
        return met * rng.random()


class GlanceProcess:
    """Alternates glances and looking away, each of a length of its own.

    With the lengths fitted to the 686 annotated pedestrians and a stationary start it has somebody
    look 45 % of the time and 62, 74, 87 and 93 % of people have looked within the last 0.5, 1, 2
    and 3 s; observed before crossing were 41, 54, 75 and 82 %. A share of people who never look
    (least squares: 19 %) brings it to 50, 60, 70 and 75 %: see :class:`Glances.looker_share`.

    Args:
        glance: lengths of glances.
        away: lengths of looking away.
        rng: draws them.
    """

    def __init__(
        self, glance: LogNormalDuration, away: LogNormalDuration, rng: np.random.Generator
    ) -> None:
        self._glance, self._away, self._rng = glance, away, rng
        self._looking = False
        self._until_s = math.inf

    def begin(self, t_s: float) -> None:
        """Start with a glance at ``t_s``."""
        self._looking = True
        self._until_s = t_s + self._glance.draw_s(self._rng)

    def begin_anywhere(self, t_s: float) -> None:
        """Start in the middle of things at ``t_s``: the process is stationary from there on."""
        mean_s = self._glance.mean_s
        self._looking = self._rng.random() < mean_s / (mean_s + self._away.mean_s)
        length = self._glance if self._looking else self._away
        self._until_s = t_s + length.residual_s(self._rng)

    def looking(self, t_s: float) -> bool:
        """Whether a glance is on at ``t_s``, which never goes back; False before the start."""
        while t_s >= self._until_s:
            self._looking = not self._looking
            length = self._glance if self._looking else self._away
            self._until_s += length.draw_s(self._rng)
        return self._looking


# What moves is noticed so far to either side of where the head points: the horizontal field of both
# eyes is about 200 degrees (Strasburger et al. 2011, Journal of Vision 11(5):13).
_FIELD_RAD: Final = math.radians(100.0)
#: A robot that has been noticed is made out up to here.
_KNOWN_WITHIN_M: Final = 25.0
# Heads turn with some 200 degrees a second at most, eyes with several hundred (Freedman 2008,
# Experimental Brain Research 190, 369-387); the rest is what makes the turn smooth.
_HEAD_RADPS: Final = 3.2
_HEAD_RADPS2: Final = 25.0
_HEAD_RATE_HZ: Final = 6.0
_EYE_RADPS: Final = 8.0
# The robot has been seen once the gaze is this near to it.
_ON_TARGET_RAD: Final = math.radians(10.0)
# Eyes stand at about this part of the stature.
_EYE_SHARE: Final = 0.94


class Gaze:
    """Head and eyes of one person.

    Angles are left and up positive, of the head from the body and of the eyes from the head. The
    head turns relative to the body: from one side to the other it goes through the front.

    Args:
        glances: what the scenario says.
        stature_m: of the body.
        rng: draws glances.

    Attributes:
        noticed_s: when the person first looked at the robot; None until then.
        makes_out: whether the robot is in the person's field of view now with a free line of sight.
        looking: whether a glance at the robot is on.
    """

    def __init__(self, glances: Glances, stature_m: float, rng: np.random.Generator) -> None:
        self._glances = glances
        self._eyes_m = _EYE_SHARE * stature_m
        self._process = GlanceProcess(
            LogNormalDuration.fitted(glances.glance_median_s, glances.glance_quartiles_s),
            LogNormalDuration.fitted(glances.away_median_s, glances.away_quartiles_s),
            rng,
        )
        self._within_m = glances.notices_within_m
        if rng.random() >= glances.looker_share:
            self._within_m = 0.0
        self._visible_since_s: float | None = None
        self._first_s: float | None = None
        self._away = (math.radians(glances.away_yaw_deg), math.radians(glances.away_pitch_deg))
        self._head, self._eyes = self._away, (0.0, 0.0)
        self._head_rate, self._eye_rate = (0.0, 0.0), (0.0, 0.0)
        self.noticed_s: float | None = None
        self.makes_out = False
        self.looking = False

    def at(self, after_s: float) -> tuple[float, float, float, float]:
        """Yaw and pitch of the head, yaw and pitch of the eyes, so long after the last tick."""
        return (
            self._head[0] + self._head_rate[0] * after_s,
            self._head[1] + self._head_rate[1] * after_s,
            self._eyes[0] + self._eye_rate[0] * after_s,
            self._eyes[1] + self._eye_rate[1] * after_s,
        )

    def startle(self, t_s: float) -> None:
        """The robot has touched the person, who looks at it if it lies within sight."""
        if self._first_s is None:
            self._first_s = t_s
            self._process.begin(t_s)

    def tick(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float, float],
        robot: RobotBody,
        sees: bool,
    ) -> None:
        """Decide what to look at for the next ``dt_s`` and set head and eyes in motion.

        Args:
            t_s: now; the last tick was ``dt_s`` ago.
            dt_s: length of a tick.
            place: x, y and heading of the body.
            robot: where it is.
            sees: whether the line of sight is free; see :meth:`could_see`.
        """
        yaw, pitch, eye_yaw, eye_pitch = self.at(dt_s)
        self._head, self._eyes = (yaw, pitch), (eye_yaw, eye_pitch)
        self.makes_out = sees
        self.looking = self._decide(t_s, sees)
        target = self._away
        if self.looking:
            target = self._towards(place, robot)
            off = (target[0] - yaw - eye_yaw, target[1] - pitch - eye_pitch)
            if self.noticed_s is None and math.hypot(*off) < _ON_TARGET_RAD:
                self.noticed_s = t_s
        limits = (MAX_HEAD_YAW_RAD, MAX_HEAD_PITCH_RAD)
        eye_limits = (MAX_EYE_YAW_RAD, MAX_EYE_PITCH_RAD)
        rates, eye_rates = [], []
        for axis in (0, 1):
            head = self._head[axis]
            rate = _head_rate(head, self._head_rate[axis], target[axis], limits[axis], dt_s)
            # Eyes lead, and give way as the head arrives.
            wanted = _within(target[axis] - head - rate * dt_s, eye_limits[axis])
            step = _within(wanted - self._eyes[axis], _EYE_RADPS * dt_s)
            rates.append(rate)
            eye_rates.append(step / dt_s)
        self._head_rate = (rates[0], rates[1])
        self._eye_rate = (eye_rates[0], eye_rates[1])

    def could_see(
        self, after_s: float, place: tuple[float, float, float], robot: RobotBody
    ) -> bool:
        """Whether the robot is near enough and in the field of view, rays apart."""
        dx, dy = robot.camera_m[0] - place[0], robot.camera_m[1] - place[1]
        distance = math.hypot(dx, dy)
        within = self._within_m if self._first_s is None else _KNOWN_WITHIN_M
        if distance > within:
            return False
        facing = place[2] + self._head[0] + self._head_rate[0] * after_s
        return abs(math.remainder(math.atan2(dy, dx) - facing, math.tau)) <= _FIELD_RAD

    def _decide(self, t_s: float, sees: bool) -> bool:
        """Whether to look at the robot now."""
        glances = self._glances
        if self._first_s is None:
            if not sees:
                self._visible_since_s = None
                return False
            if self._visible_since_s is None:
                self._visible_since_s = t_s
            if t_s - self._visible_since_s < glances.first_glance_delay_s - 1e-9:
                return False
            self._first_s = t_s
            self._process.begin(t_s)
        gives_up = glances.gives_up_after_s
        if gives_up is not None and t_s - self._first_s > gives_up:
            return False
        # The process runs on while the robot is out of sight: its lengths stay what they are.
        glancing = self._process.looking(t_s)
        return sees and (glances.watches or glancing)

    def _towards(self, place: tuple[float, float, float], robot: RobotBody) -> tuple[float, float]:
        """Yaw and pitch of the robot's camera from the body."""
        x, y, z = robot.camera_m
        dx, dy = x - place[0], y - place[1]
        yaw = math.remainder(math.atan2(dy, dx) - place[2], math.tau)
        return yaw, math.atan2(z - self._eyes_m, max(math.hypot(dx, dy), 1e-3))


def _head_rate(angle: float, rate: float, target: float, limit: float, dt_s: float) -> float:
    """Rate of the next tick: towards the target, smoothly, and never past the limit."""
    wanted = _within(_HEAD_RATE_HZ * (_within(target, limit) - angle), _HEAD_RADPS)
    rate += _within(wanted - rate, _HEAD_RADPS2 * dt_s)
    return (_within(angle + rate * dt_s, limit) - angle) / dt_s


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
