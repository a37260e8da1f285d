"""Gaze of a person: when glances at the robot begin and end, and how head and eyes follow.

Glances and looking away alternate as a renewal process with lognormal durations. Between glances
the head points to one side, where a gaze plan says, or as recorded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...world.errors import SimError
from ..body import MAX_EYE_YAW_RAD, MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD, STAYING
from ._head import ON_TARGET_RAD, AnsweringLook, HeadAndEyes, angles_to, clipped
from ._hearing import FIELD_RAD, UPPER_QUARTILE, Heard
from ._spec import GazeKey, Glances
from ._surroundings import RobotBody, eye_height_m

# A robot that was noticed before is seen up to this distance.
_SEEN_WITHIN_M: Final = 25.0
# Eyes change their place in the head after this mean time, and with every glance.
_REST_S: Final = 1.5
# A recorded head is as recorded again this near to it after a look.
_SETTLED_RAD: Final = math.radians(1.0)


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
        return cls(median_s, math.log(upper / lower) / (2.0 * UPPER_QUARTILE))

    @property
    def mean_s(self) -> float:
        """Expected duration."""
        return self.median_s * math.exp(0.5 * self.sigma**2)

    def draw_s(self, rng: np.random.Generator) -> float:
        """Draw a duration."""
        return self.median_s * math.exp(self.sigma * rng.standard_normal())


class GlanceProcess:
    """Glances and looking away in turn, each of a random duration.

    With durations fitted to 686 annotated pedestrians, a person looks in the long run 45 % of the
    time, and 62, 74, 87 and 93 % have looked within the last 0.5, 1, 2 and 3 s. Before
    crossing, 41, 54, 75 and 82 % were observed. If a share of people never looks (least squares:
    19 %), the process gives 50, 60, 70 and 75 %: see :attr:`Glances.looker_share`.
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
    """The yaw in the head at which eyes come to rest, drawn anew with every shift of the gaze."""

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
            self._yaw_rad = clipped(yaw, MAX_EYE_YAW_RAD)
            self._left_s = float(self._rng.exponential(_REST_S))
        self._looking = looking
        return self._yaw_rad


def planned_gaze(
    plan: tuple[GazeKey, ...],
    t_s: float,
    place: tuple[float, float, float],
    camera_odom_m: tuple[float, float, float],
    eyes_m: float,
) -> tuple[float, float]:
    """Return yaw and pitch of the head from the body as a gaze plan says.

    A head turns through the front from one key to the next.
    """
    after = sum(key.t_s <= t_s for key in plan)
    first, second = plan[max(after - 1, 0)], plan[min(after, len(plan) - 1)]
    to_robot = angles_to(camera_odom_m, place, eyes_m)
    yaw, pitch = _key_angles(first, to_robot)
    if first is not second:
        next_yaw, next_pitch = _key_angles(second, to_robot)
        share = (t_s - first.t_s) / (second.t_s - first.t_s)
        share = share * share * (3.0 - 2.0 * share)
        yaw, pitch = yaw + share * (next_yaw - yaw), pitch + share * (next_pitch - pitch)
    return clipped(yaw, MAX_HEAD_YAW_RAD), clipped(pitch, MAX_HEAD_PITCH_RAD)


def _key_angles(key: GazeKey, to_robot: tuple[float, float]) -> tuple[float, float]:
    yaw, pitch = to_robot if key.look == "robot" else (0.0, 0.0)
    yaw = math.remainder(yaw + math.radians(key.yaw_deg), math.tau)
    return yaw, pitch + math.radians(key.pitch_deg)


class Gaze:
    """Head and eyes of one person.

    Left and up are positive. The head's angles are relative to the body, those of the eyes relative
    to the head. The head turns from one side to the other through the front.

    Attributes:
        noticed_s: time of the first look that took the robot in; None before.
        take_in_s: looks of so long, in all, take it in; those of an answer, and a contact, at once.
        looks: whether a glance at the robot is on, and the gaze has reached it.
        looked_s: time of the last look at the robot; −∞ before the first.
        looking: whether a glance at the robot is on.
        away: yaw and pitch of the head from the body while the person does not look at the robot.
        answer: the last look that answers a request of the robot.
        turned: the head is not as recorded because of a look; see :meth:`follow`.
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
        self.away = (math.radians(glances.away_yaw_deg), math.radians(glances.away_pitch_deg))
        self._twists = activity not in STAYING
        self._posture = HeadAndEyes(self.away, (0.0, 0.0), twists=self._twists)
        self.noticed_s: float | None = None
        self.take_in_s = 0.0
        self.looks, self.looked_s = False, -math.inf
        self.looking = False
        self.answer: AnsweringLook | None = None
        self.turned = False

    def angles(self, after_s: float) -> tuple[float, float, float, float]:
        """Return yaw and pitch of the head and of the eyes, ``after_s`` after the last update."""
        return self._posture.angles(after_s)

    def twist_rad(self, after_s: float) -> float:
        """Return how far the trunk is turned to look back, from which the head's yaw counts."""
        return self._posture.twist_rad(after_s)

    def asked(self, t_s: float) -> bool:
        """Return whether the person looks for the robot that has asked for it."""
        return self.answer is not None and self.answer.lasts(t_s)

    def hear(self, heard: Heard) -> None:
        """Look for the robot that has asked for it."""
        self.answer = AnsweringLook.after(self.answer, heard.from_s, heard.looks_for_s)

    def startle(self, t_s: float) -> None:
        """Start glancing because the robot has touched the person, and take in what it is."""
        self.take_in_s = 0.0
        if self._first_glance_s is None:
            self._first_glance_s = t_s
            self._process.begin(t_s)

    def follow(self, head_rad: tuple[float, float]) -> None:
        """Let the head point there: at once, but after a look at the robot it turns back."""
        self.away = head_rad
        if self.turned and not self.looking:
            off = self._posture.off_rad(head_rad)
            self.turned = max(off, abs(self._posture.twist_rad(0.0))) > _SETTLED_RAD
        if not self.turned:
            self._posture = HeadAndEyes(head_rad, (0.0, 0.0), twists=self._twists)

    def update(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float, float],
        robot: RobotBody,
        visible: bool,
        answers: bool = False,
    ) -> None:
        """Choose the target of the gaze for the next ``dt_s`` and set head and eyes in motion.

        Args:
            t_s: now; the last update was ``dt_s`` ago.
            dt_s: time between updates.
            place: x, y and heading of the body.
            robot: the robot now.
            visible: whether it is in the field of view with a free line of sight.
            answers: whether the person answers its request, with a free line of sight.
        """
        self._posture.advance(dt_s)
        self.looking = self._glances_now(t_s, visible) or answers
        target = self.away
        if self.looking:
            self.turned = True
            target = angles_to(robot.camera_m, place, self._eyes_m)
            if answers:
                target = self._posture.unwrapped(target)
        self.looks = self.looking and self._posture.off_rad(target) < ON_TARGET_RAD
        if self.looks:
            self.looked_s = t_s
            if self.noticed_s is None and (answers or self.take_in_s <= 0.0):
                self.noticed_s = t_s
            self.take_in_s -= dt_s
            if answers and self.answer is not None:
                self.answer.meet(t_s)
        rest = (0.0 if self.eye_rest is None else self.eye_rest.yaw_rad(dt_s, self.looking), 0.0)
        self._posture.turn(target, rest, dt_s, back=answers)

    def in_field_of_view(
        self, after_s: float, place: tuple[float, float, float], robot: RobotBody
    ) -> bool:
        """Return whether the robot is near and in the field of view; obstacles are ignored."""
        dx, dy = robot.camera_m[0] - place[0], robot.camera_m[1] - place[1]
        distance = math.hypot(dx, dy)
        range_m = self._notices_within_m if self._first_glance_s is None else _SEEN_WITHIN_M
        if distance > range_m:
            return False
        yaw = self._posture.angles(after_s)[0]
        facing = place[2] + yaw + self._posture.twist_rad(after_s)
        return abs(math.remainder(math.atan2(dy, dx) - facing, math.tau)) <= FIELD_RAD

    def _glances_now(self, t_s: float, visible: bool) -> bool:
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
