"""Head, eyes and trunk of a person, which turn at human speeds."""

from __future__ import annotations

import math
from typing import Final

from ..body import (
    MAX_EYE_PITCH_RAD,
    MAX_EYE_YAW_RAD,
    MAX_HEAD_PITCH_RAD,
    MAX_HEAD_YAW_RAD,
    GaitPose,
)

# Heads turn at about 200 degrees per second at most, eyes at several hundred (Freedman 2008,
# Experimental Brain Research 190, 369-387). The other figures make the turn smooth.
_HEAD_RADPS: Final = 3.2
_HEAD_RADPS2: Final = 25.0
_HEAD_RATE_HZ: Final = 6.0
_EYE_RADPS: Final = 8.0
# The body turns at these rates, and so does the trunk of somebody who looks back, whose feet stay.
_TURN_RATE_HZ: Final = 4.0
_MAX_TURN_RADPS: Final = 2.6
_MAX_TURN_RADPS2: Final = 15.0
_MAX_TWIST_RAD: Final = math.radians(60.0)
# Share of a twist between pelvis and chest; the rest is between feet and pelvis.
_WAIST_SHARE: Final = 0.5
# Something that moves behind a person is followed over one shoulder up to this yaw.
_OVER_SHOULDER_RAD: Final = math.radians(195.0)
#: The robot is looked at, and noticed, once the gaze is this near to it.
ON_TARGET_RAD: Final = math.radians(10.0)
# Somebody who looks for the robot and does not find it gives up after this time and the look's.
_SEARCH_S: Final = 1.5


class AnsweringLook:
    """A look that answers a request; its duration counts from the moment it meets the robot."""

    def __init__(self, from_s: float, for_s: float) -> None:
        self._from_s, self._for_s = from_s, for_s
        self._until_s = from_s + for_s + _SEARCH_S
        self._met = False

    @classmethod
    def after(cls, before: AnsweringLook | None, from_s: float, for_s: float) -> AnsweringLook:
        """Return the look of a person asked again: the one ``before``, unless it is over by then.

        A later request does not stop anybody who turns to the robot already, but may be answered
        sooner.
        """
        if before is not None and before._from_s <= from_s < before._until_s:
            return before
        return cls(from_s, for_s)

    def lasts(self, t_s: float) -> bool:
        """Return whether the person turns to the robot, or looks at it, at ``t_s``."""
        return self._from_s <= t_s < self._until_s

    def meet(self, t_s: float) -> None:
        """Note that the gaze is on the robot."""
        if not self._met:
            self._met, self._until_s = True, t_s + self._for_s


class HeadAndEyes:
    """Head, eyes and trunk in motion.

    Left and up are positive. Targets are relative to the body, whose feet stay. The twist of the
    trunk is relative to it as well, the head's angles are relative to the trunk, and those of the
    eyes relative to the head. The head turns from one side to the other through the front.

    Args:
        head_rad: yaw and pitch of the head.
        eyes_rad: yaw and pitch of the eyes.
        twists: the trunk can turn.
    """

    def __init__(
        self, head_rad: tuple[float, float], eyes_rad: tuple[float, float], *, twists: bool = True
    ) -> None:
        self._head, self._eyes, self._twist = head_rad, eyes_rad, 0.0
        self._head_rates, self._eye_rates, self._twist_rate = (0.0, 0.0), (0.0, 0.0), 0.0
        self._twists = twists
        self._side = 0.0  # on which the person looks back: +1 left, −1 right

    def angles(self, after_s: float) -> tuple[float, float, float, float]:
        """Return yaw and pitch of the head and of the eyes, ``after_s`` after the last turn."""
        return (
            self._head[0] + self._head_rates[0] * after_s,
            self._head[1] + self._head_rates[1] * after_s,
            self._eyes[0] + self._eye_rates[0] * after_s,
            self._eyes[1] + self._eye_rates[1] * after_s,
        )

    def twist_rad(self, after_s: float) -> float:
        """Return the twist of the trunk, ``after_s`` after the last turn."""
        return self._twist + self._twist_rate * after_s

    def off_rad(self, target: tuple[float, float]) -> float:
        """Return the distance of the gaze from a target (yaw, pitch)."""
        yaw = target[0] - self._head[0] - self._eyes[0] - self._twist
        return math.hypot(yaw, target[1] - self._head[1] - self._eyes[1])

    def unwrapped(self, target: tuple[float, float]) -> tuple[float, float]:
        """Return a target behind the person as seen over the shoulder over which they look back."""
        yaw = target[0]
        self._side = self._side or math.copysign(1.0, yaw)
        over_shoulder = math.copysign(math.tau, self._side) + yaw
        if yaw * self._side < 0.0 and abs(over_shoulder) < _OVER_SHOULDER_RAD:
            return over_shoulder, target[1]
        return target

    def advance(self, dt_s: float) -> None:
        """Move on by ``dt_s`` at the present rates."""
        yaw, pitch, eye_yaw, eye_pitch = self.angles(dt_s)
        self._head, self._eyes = (yaw, pitch), (eye_yaw, eye_pitch)
        self._twist = self.twist_rad(dt_s)

    def turn(
        self,
        target: tuple[float, float],
        rest: tuple[float, float],
        dt_s: float,
        *,
        back: bool = False,
    ) -> None:
        """Set the rates for the next ``dt_s``.

        Args:
            target: yaw and pitch of the gaze from the body.
            rest: yaw and pitch at which the eyes come to rest in the head.
            dt_s: > 0, time until the next turn.
            back: turn the trunk where the head alone cannot; otherwise the trunk turns ahead again.
        """
        twist_to = 0.0
        if not back:
            self._side = 0.0
        if back and self._twists:
            beyond = max(abs(target[0]) - MAX_HEAD_YAW_RAD, 0.0)
            twist_to = math.copysign(min(beyond, _MAX_TWIST_RAD), target[0])
        self._twist_rate = turn_rate(twist_to - self._twist, self._twist_rate, dt_s)
        limits = (MAX_HEAD_YAW_RAD, MAX_HEAD_PITCH_RAD)
        eye_limits = (MAX_EYE_YAW_RAD, MAX_EYE_PITCH_RAD)
        rates, eye_rates = [], []
        for axis, ahead in enumerate((target[0] - self._twist, target[1])):
            head = self._head[axis]
            rate = _head_rate(head, self._head_rates[axis], ahead - rest[axis], limits[axis], dt_s)
            # Eyes reach the target first and turn back while the head follows.
            eye_target = clipped(ahead - head - rate * dt_s, eye_limits[axis])
            step = clipped(eye_target - self._eyes[axis], _EYE_RADPS * dt_s)
            rates.append(rate)
            eye_rates.append(step / dt_s)
        self._head_rates = (rates[0], rates[1])
        self._eye_rates = (eye_rates[0], eye_rates[1])


def twisted(feet: GaitPose, twist_rad: float) -> GaitPose:
    """Return the gait pose of a body whose heading is turned by the twist while the feet stay."""
    if twist_rad == 0.0:
        return feet
    return feet._replace(pelvis_yaw_rad=feet.pelvis_yaw_rad - _WAIST_SHARE * twist_rad)


def angles_to(
    target_odom_m: tuple[float, float, float], place: tuple[float, float, float], eyes_m: float
) -> tuple[float, float]:
    """Return yaw and pitch of a target from the body."""
    x, y, z = target_odom_m
    dx, dy = x - place[0], y - place[1]
    yaw = math.remainder(math.atan2(dy, dx) - place[2], math.tau)
    return yaw, math.atan2(z - eyes_m, max(math.hypot(dx, dy), 1e-3))


def turn_rate(off_rad: float, rate_radps: float, dt_s: float) -> float:
    """Return the next rate of a body that turns by ``off_rad``, from its present rate."""
    rate = clipped(_TURN_RATE_HZ * off_rad, _MAX_TURN_RADPS)
    most = _MAX_TURN_RADPS2 * dt_s
    return rate_radps + clipped(rate - rate_radps, most)


def clipped(value: float, limit: float) -> float:
    """Return the value within ±limit."""
    return min(max(value, -limit), limit)


def _head_rate(angle: float, rate: float, target: float, limit: float, dt_s: float) -> float:
    """Return the next rate of the head, smoothly towards the target and never past the limit."""
    target_rate = clipped(_HEAD_RATE_HZ * (clipped(target, limit) - angle), _HEAD_RADPS)
    rate += clipped(target_rate - rate, _HEAD_RADPS2 * dt_s)
    return (clipped(angle + rate * dt_s, limit) - angle) / dt_s
