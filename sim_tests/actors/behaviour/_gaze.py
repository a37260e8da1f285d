"""Gaze of a person: when glances at the robot begin and end, and how head and eyes follow.

Glances and looking away alternate as a renewal process with lognormal durations.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ..body import MAX_EYE_YAW_RAD, STAYING
from ._duration import LogNormalDuration
from ._head import ON_TARGET_RAD, AnsweringLook, HeadAndEyes, angles_to, clipped
from ._hearing import FIELD_RAD, Heard
from ._person import RobotBody, eye_height_m
from ._spec import Glances

# A robot that was noticed before is seen up to this distance.
_SEEN_WITHIN_M: Final = 25.0
# Eyes change their place in the head after this mean time, and with every glance.
_REST_S: Final = 1.5


class GlanceProcess:
    """Glances and looking away in turn, each of a random duration.

    With durations fitted to 686 annotated pedestrians, a person looks in the long run 45 % of the
    time, and 62, 74, 87 and 93 % have looked within the last 0.5, 1, 2 and 3 s. Before
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
            self._yaw_rad = clipped(yaw, MAX_EYE_YAW_RAD)
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
        answer: the last look that answers a request of the robot.
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
        self._posture = HeadAndEyes(self._away, (0.0, 0.0), twists=activity not in STAYING)
        self.noticed_s: float | None = None
        self.looking = False
        self.answer: AnsweringLook | None = None

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
        target = self._away
        if self.looking:
            target = angles_to(robot.camera_m, place, self._eyes_m)
            if answers:
                target = self._posture.unwrapped(target)
            if self._posture.off_rad(target) < ON_TARGET_RAD:
                if self.noticed_s is None:
                    self.noticed_s = t_s
                if answers and self.answer is not None:
                    self.answer.meet(t_s)
        rest = (0.0 if self.eye_rest is None else self.eye_rest.yaw_rad(dt_s, self.looking), 0.0)
        self._posture.turn(target, rest, dt_s, back=answers)

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
        yaw = self._posture.angles(after_s)[0]
        facing = place[2] + yaw + self._posture.twist_rad(after_s)
        return abs(math.remainder(math.atan2(dy, dx) - facing, math.tau)) <= FIELD_RAD

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
