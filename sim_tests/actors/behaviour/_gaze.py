"""Gaze of a person: when glances at the robot begin and end, and how head and eyes follow.

Glances and looking away alternate as a renewal process with lognormal durations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...world.errors import SimError
from ..body import MAX_EYE_PITCH_RAD, MAX_EYE_YAW_RAD, MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD
from ._person import RobotBody, eye_height_m
from ._spec import Glances

# The upper quartile of a standard normal distribution.
_UPPER_QUARTILE: Final = 0.6744897501960817
# Motion is noticed up to this angle from the head's direction: the horizontal field of both eyes is
# about 200 degrees (Strasburger et al. 2011, Journal of Vision 11(5):13).
_FIELD_RAD: Final = math.radians(100.0)
# A robot that was noticed before is seen up to this distance.
_SEEN_WITHIN_M: Final = 25.0
# Heads turn at about 200 degrees per second at most, eyes at several hundred (Freedman 2008,
# Experimental Brain Research 190, 369-387). The other figures make the turn smooth.
_HEAD_RADPS: Final = 3.2
_HEAD_RADPS2: Final = 25.0
_HEAD_RATE_HZ: Final = 6.0
_EYE_RADPS: Final = 8.0
# Eyes change their place in the head after this mean time, and with every glance.
_REST_S: Final = 1.5
# The robot is noticed once the gaze is this near to it.
_ON_TARGET_RAD: Final = math.radians(10.0)


@dataclass(frozen=True, slots=True)
class LogNormalDuration:
    """A duration whose logarithm is normally distributed.

    Attributes:
        median_s: > 0.
        sigma: standard deviation of the logarithm, ≥ 0.
    """

    median_s: float
    sigma: float

    @classmethod
    def fitted(cls, median_s: float, quartiles_s: tuple[float, float]) -> LogNormalDuration:
        """Fit the median and the ratio of the quartiles.

        The quartiles of a lognormal lie at median · exp(±0.6745 σ), so their ratio gives σ. The
        fitted quartiles equal the given ones only if those lie evenly around the median in
        logarithms.
        """
        lower, upper = quartiles_s
        if not (median_s > 0.0 and 0.0 < lower <= median_s <= upper):
            raise SimError(
                "quartiles must be positive and lie on either side of the median, got "
                f"{lower:g} and {upper:g} s about {median_s:g} s"
            )
        return cls(median_s, math.log(upper / lower) / (2.0 * _UPPER_QUARTILE))

    @property
    def mean_s(self) -> float:
        """Expected duration."""
        return self.median_s * math.exp(0.5 * self.sigma**2)

    def draw_s(self, rng: np.random.Generator) -> float:
        """Draw a duration."""
        return self.median_s * math.exp(self.sigma * rng.standard_normal())

    def residual_s(self, rng: np.random.Generator) -> float:
        """Draw the rest of the duration that a random instant falls into.

        A random instant falls into a duration with a probability proportional to its length. A
        lognormal weighted by its length is a lognormal of median · exp(σ²).
        """
        hit_s = self.median_s * math.exp(self.sigma**2 + self.sigma * rng.standard_normal())
        return hit_s * rng.random()


class GlanceProcess:
    """Glances and looking away in turn, each of a random duration.

    With durations fitted to 686 annotated pedestrians and a stationary start, a person looks 45 %
    of the time, and 62, 74, 87 and 93 % have looked within the last 0.5, 1, 2 and 3 s. Before
    crossing, 41, 54, 75 and 82 % were observed. If a share of people never looks (least squares:
    19 %), the process gives 50, 60, 70 and 75 %: see :attr:`Glances.looker_share`.

    Args:
        glance: duration of glances.
        away: duration of looking away.
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

    def begin_stationary(self, t_s: float) -> None:
        """Start at ``t_s`` in the stationary state of the process."""
        mean_s = self._glance.mean_s
        self._looking = self._rng.random() < mean_s / (mean_s + self._away.mean_s)
        duration = self._glance if self._looking else self._away
        self._until_s = t_s + duration.residual_s(self._rng)

    def looking(self, t_s: float) -> bool:
        """Return whether a glance is on at ``t_s``; False before the start.

        ``t_s`` must not decrease from call to call.
        """
        while t_s >= self._until_s:
            self._looking = not self._looking
            duration = self._glance if self._looking else self._away
            self._until_s += duration.draw_s(self._rng)
        return self._looking


class EyeRest:
    """The yaw in the head at which eyes come to rest, drawn anew with every shift of the gaze.

    Args:
        spread_rad: standard deviation.
        rng: draws it.
    """

    def __init__(self, spread_rad: float, rng: np.random.Generator) -> None:
        self._spread_rad, self._rng = spread_rad, rng
        self._looking = False
        self._left_s = 0.0
        self._yaw_rad = 0.0

    def yaw_rad(self, dt_s: float, looking: bool) -> float:
        """Return the yaw, ``dt_s`` after the last call; ``looking`` tells glances apart."""
        self._left_s -= dt_s
        if self._left_s <= 0.0 or looking != self._looking:
            yaw = self._spread_rad * float(self._rng.standard_normal())
            self._yaw_rad = _clipped(yaw, MAX_EYE_YAW_RAD)
            self._left_s = float(self._rng.exponential(_REST_S))
        self._looking = looking
        return self._yaw_rad


class Gaze:
    """Head and eyes of one person.

    Left and up are positive. The head's angles are relative to the body, those of the eyes relative
    to the head. The head turns from one side to the other through the front.

    Args:
        glances: the scenario's figures.
        stature_m: height of the body.
        rng: draws glances.
        activity: of the person, who may sit or kneel.

    Attributes:
        noticed_s: time of the first look at the robot; None before.
        looking: whether a glance at the robot is on.
        eye_rest: where the eyes come to rest in the head, which turns the rest of the way; None:
            in the middle.
    """

    def __init__(
        self,
        glances: Glances,
        stature_m: float,
        rng: np.random.Generator,
        *,
        activity: str = "none",
    ) -> None:
        self._glances = glances
        self.eye_rest: EyeRest | None = None
        self._eyes_m = eye_height_m(stature_m, activity)
        self._process = GlanceProcess(
            LogNormalDuration.fitted(glances.glance_median_s, glances.glance_quartiles_s),
            LogNormalDuration.fitted(glances.away_median_s, glances.away_quartiles_s),
            rng,
        )
        self._notices_within_m = glances.notices_within_m
        if rng.random() >= glances.looker_share:
            self._notices_within_m = 0.0
        self._visible_since_s: float | None = None
        self._first_glance_s: float | None = None
        self._away = (math.radians(glances.away_yaw_deg), math.radians(glances.away_pitch_deg))
        self._head, self._eyes = self._away, (0.0, 0.0)
        self._head_rates, self._eye_rates = (0.0, 0.0), (0.0, 0.0)
        self.noticed_s: float | None = None
        self.looking = False

    def angles(self, after_s: float) -> tuple[float, float, float, float]:
        """Return yaw and pitch of the head and of the eyes, ``after_s`` after the last update."""
        return (
            self._head[0] + self._head_rates[0] * after_s,
            self._head[1] + self._head_rates[1] * after_s,
            self._eyes[0] + self._eye_rates[0] * after_s,
            self._eyes[1] + self._eye_rates[1] * after_s,
        )

    def startle(self, t_s: float) -> None:
        """Start glancing because the robot has touched the person."""
        if self._first_glance_s is None:
            self._first_glance_s = t_s
            self._process.begin(t_s)

    def update(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float, float],
        robot: RobotBody,
        visible: bool,
    ) -> None:
        """Choose the target of the gaze for the next ``dt_s`` and set head and eyes in motion.

        Args:
            t_s: now; the last update was ``dt_s`` ago.
            dt_s: time between updates.
            place: x, y and heading of the body.
            robot: the robot now.
            visible: whether it is in the field of view with a free line of sight.
        """
        yaw, pitch, eye_yaw, eye_pitch = self.angles(dt_s)
        self._head, self._eyes = (yaw, pitch), (eye_yaw, eye_pitch)
        self.looking = self._glances_now(t_s, visible)
        target = self._away
        if self.looking:
            target = self._robot_angles(place, robot)
            off = (target[0] - yaw - eye_yaw, target[1] - pitch - eye_pitch)
            if self.noticed_s is None and math.hypot(*off) < _ON_TARGET_RAD:
                self.noticed_s = t_s
        rest = (0.0 if self.eye_rest is None else self.eye_rest.yaw_rad(dt_s, self.looking), 0.0)
        limits = (MAX_HEAD_YAW_RAD, MAX_HEAD_PITCH_RAD)
        eye_limits = (MAX_EYE_YAW_RAD, MAX_EYE_PITCH_RAD)
        rates, eye_rates = [], []
        for axis in (0, 1):
            head = self._head[axis]
            head_target = target[axis] - rest[axis]
            rate = _head_rate(head, self._head_rates[axis], head_target, limits[axis], dt_s)
            # Eyes reach the target first and turn back while the head follows.
            eye_target = _clipped(target[axis] - head - rate * dt_s, eye_limits[axis])
            step = _clipped(eye_target - self._eyes[axis], _EYE_RADPS * dt_s)
            rates.append(rate)
            eye_rates.append(step / dt_s)
        self._head_rates = (rates[0], rates[1])
        self._eye_rates = (eye_rates[0], eye_rates[1])

    def in_field_of_view(
        self, after_s: float, place: tuple[float, float, float], robot: RobotBody
    ) -> bool:
        """Return whether the robot is near enough and in the field of view; obstacles are ignored.

        Args:
            after_s: time since the last update.
            place: x, y and heading of the body.
            robot: the robot now.
        """
        dx, dy = robot.camera_m[0] - place[0], robot.camera_m[1] - place[1]
        distance = math.hypot(dx, dy)
        range_m = self._notices_within_m if self._first_glance_s is None else _SEEN_WITHIN_M
        if distance > range_m:
            return False
        facing = place[2] + self._head[0] + self._head_rates[0] * after_s
        return abs(math.remainder(math.atan2(dy, dx) - facing, math.tau)) <= _FIELD_RAD

    def _glances_now(self, t_s: float, visible: bool) -> bool:
        """Return whether the person looks at the robot now."""
        glances = self._glances
        if self._first_glance_s is None:
            if not visible:
                self._visible_since_s = None
                return False
            if self._visible_since_s is None:
                self._visible_since_s = t_s
            if t_s - self._visible_since_s < glances.first_glance_delay_s - 1e-9:
                return False
            self._first_glance_s = t_s
            self._process.begin(t_s)
        gives_up = glances.gives_up_after_s
        if gives_up is not None and t_s - self._first_glance_s > gives_up:
            return False
        # The process continues while the robot is out of sight, so that its durations are kept.
        glancing = self._process.looking(t_s)
        return visible and (glances.watches or glancing)

    def _robot_angles(
        self, place: tuple[float, float, float], robot: RobotBody
    ) -> tuple[float, float]:
        """Return yaw and pitch of the robot's camera from the body."""
        x, y, z = robot.camera_m
        dx, dy = x - place[0], y - place[1]
        yaw = math.remainder(math.atan2(dy, dx) - place[2], math.tau)
        return yaw, math.atan2(z - self._eyes_m, max(math.hypot(dx, dy), 1e-3))


def _head_rate(angle: float, rate: float, target: float, limit: float, dt_s: float) -> float:
    """Return the next rate of the head, smoothly towards the target and never past the limit."""
    target_rate = _clipped(_HEAD_RATE_HZ * (_clipped(target, limit) - angle), _HEAD_RADPS)
    rate += _clipped(target_rate - rate, _HEAD_RADPS2 * dt_s)
    return (_clipped(angle + rate * dt_s, limit) - angle) / dt_s


def _clipped(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
