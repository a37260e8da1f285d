"""Feet of a walk that nobody knows beforehand: steps are set as the body goes.

The same gait as :func:`footstep_table`: a stance foot stays where it landed, rolls from heel to toe
and lifts off; a swinging one aims at where the body will be over it. What comes is guessed from
the body's velocity and acceleration. Scalars throughout: NumPy is slow on two feet.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from ._footing import Footing
from ._gait import (
    ARM_SWING_RAD,
    LEFT,
    LIFT_M,
    LOADING_S,
    LOADING_SHARE,
    LONGEST_SWING_S,
    MID_STANCE,
    PELVIS_LIST_RAD,
    PELVIS_TWIST,
    PELVIS_YAW_RAD,
    RIGHT,
    ROLLING_S,
    ROLLING_SHARE,
    SWAY_M,
    THORAX_YAW_RAD,
    WAY_ROUND_M,
    Gait,
    landing_rad,
    off_rad,
)
from ._gait_figures import GaitFigures, Place
from ._skeleton import SIGNS

# Slower than this and the body only shifts its weight.
_MOVING_MPS: Final = 0.05
_MOVING_RADPS: Final = 0.15
# Feet so far from where they belong take a step, and rest once they are so near.
_STEP_M: Final = 0.07
_STEP_RAD: Final = math.radians(20.0)
_REST_M: Final = 0.05
_REST_RAD: Final = math.radians(12.0)
_SLOWEST_HZ: Final = 0.75
_QUICKEST_HZ: Final = 1.8
# A foot farther behind than this part of the stature makes the next steps quicker.
_BEHIND_SHARE: Final = 0.34
_CATCH_UP: Final = 1.6
# Where a foot will land is settled for the rest of its swing.
_SETTLED: Final = 0.75
_TWIST_RAD: Final = math.radians(35.0)
_TWISTING_MPS: Final = 0.3
_SMOOTHING_S: Final = 0.15
_RISING_S: Final = 0.12
_PITCH_RADPS: Final = 8.0


class _Foot:
    """One foot, standing or swinging."""

    __slots__ = (
        "from_pitch",
        "lifted_at",
        "own",
        "pitch",
        "place",
        "since_s",
        "swinging",
        "target",
    )

    def __init__(self, place: Place) -> None:
        self.place = self.target = place
        self.swinging = False
        self.own = 0.0  # of the cycle since it landed
        self.lifted_at = 0.0
        self.since_s = math.inf
        self.pitch = self.from_pitch = 0.0

    def copied(self) -> _Foot:
        """The same state in a foot of its own."""
        other = _Foot(self.place)
        other.target, other.swinging, other.own = self.target, self.swinging, self.own
        other.lifted_at, other.since_s = self.lifted_at, self.since_s
        other.pitch, other.from_pitch = self.pitch, self.from_pitch
        return other


class OnlineFootsteps:
    """Sets the feet of one body.

    Args:
        gait: of the body.
        x_m: where it stands.
        y_m: where it stands.
        heading_rad: which way it faces.
    """

    def __init__(self, gait: Gait, x_m: float, y_m: float, heading_rad: float) -> None:
        self._figures = GaitFigures(gait)
        self._feet = [
            _Foot(self._figures.neutral(side, x_m, y_m, heading_rad, 0.0)) for side in (LEFT, RIGHT)
        ]
        self._phase = 0.0
        self._walking = False
        self._vigour = self._twist = 0.0
        self._height_m = self._figures.standing_m
        self._before: (
            tuple[float, bool, float, float, float, list[_Foot], Footing | None] | None
        ) = None
        self._last: Footing | None = None

    def undo(self) -> None:
        """Take the last step back: the body did not move."""
        if self._before is not None:
            (
                self._phase,
                self._walking,
                self._vigour,
                self._twist,
                self._height_m,
                self._feet,
                self._last,
            ) = self._before
            self._before = None

    def carried(self, dx_m: float, dy_m: float) -> Footing | None:
        """The last posture moved as it is: somebody is thrown back. None before the first step."""
        if self._last is None:
            return None
        for foot in self._feet:
            foot.place = (foot.place[0] + dx_m, foot.place[1] + dy_m, foot.place[2])
            foot.target = (foot.target[0] + dx_m, foot.target[1] + dy_m, foot.target[2])
        (ax, ay, az, ayaw, apitch), (bx, by, bz, byaw, bpitch) = self._last.feet
        left = (ax + dx_m, ay + dy_m, az, ayaw, apitch)
        right = (bx + dx_m, by + dy_m, bz, byaw, bpitch)
        self._before = None
        self._last = replace(self._last, feet=(left, right))
        return self._last

    def step(
        self,
        dt_s: float,
        place: tuple[float, float, float],
        velocity: tuple[float, float, float],
        acceleration: tuple[float, float],
    ) -> Footing:
        """Go on by ``dt_s`` ≥ 0; returns where feet and hips are, in odom.

        Args:
            dt_s: since the last step.
            place: x, y and heading of the body now.
            velocity: of the body, m/s and rad/s.
            acceleration: of the body, m/s².
        """
        self._before = (
            self._phase,
            self._walking,
            self._vigour,
            self._twist,
            self._height_m,
            [foot.copied() for foot in self._feet],
            self._last,
        )
        x, y, heading = place
        vx, vy, turning = velocity
        speed = math.hypot(vx, vy)
        askew = 0.0
        if speed > 1e-3:
            askew = math.atan2(vy, vx) - heading
        blend = 1.0 - math.exp(-dt_s / _SMOOTHING_S)
        twist = _TWIST_RAD * min(speed / _TWISTING_MPS, 1.0) * math.sin(2.0 * askew)
        self._twist += blend * (twist - self._twist)
        along = askew - self._twist
        ahead, aside = speed * math.cos(along), speed * math.sin(along)
        vigour = self._figures.vigour(ahead)
        if speed <= _MOVING_MPS:
            vigour = 0.0
        self._vigour += blend * (vigour - self._vigour)
        share = min(self._figures.stance_share(speed), 0.75)
        cadence = self._figures.cadence_hz(ahead, aside, turning)
        standing = speed <= _MOVING_MPS and abs(turning) <= _MOVING_RADPS
        facing = heading + self._twist
        if not self._walking and (
            not standing or self._misplaced(x, y, facing, _STEP_M, _STEP_RAD)
        ):
            self._set_out(share, aside, turning)
        if self._walking:
            body = (x, y, facing, vx, vy, turning)
            self._go_on(dt_s, body, acceleration, cadence, share, standing)
            swings = self._feet[LEFT].swinging or self._feet[RIGHT].swinging
            if standing and not swings and not self._misplaced(x, y, facing, _REST_M, _REST_RAD):
                self._walking = False
        rows = [self._ankle(side, dt_s, cadence, share, place) for side in (LEFT, RIGHT)]
        self._last = self._footing(dt_s, (rows[0], rows[1]), place)
        return self._last

    def _misplaced(self, x: float, y: float, facing: float, far_m: float, far_rad: float) -> bool:
        """Whether a foot stands too far from where it belongs when standing."""
        for side in (LEFT, RIGHT):
            nx, ny, nyaw = self._figures.neutral(side, x, y, facing, 0.0)
            px, py, pyaw = self._feet[side].place
            if math.hypot(nx - px, ny - py) > far_m:
                return True
            if abs(math.remainder(nyaw - pyaw, math.tau)) > far_rad:
                return True
        return False

    def _set_out(self, share: float, aside: float, turning: float) -> None:
        """Begin to walk with the foot on whose side the motion begins: feet must not cross."""
        lead = RIGHT if aside + 0.3 * turning < -0.02 else LEFT
        self._walking = True
        self._phase = share - 0.5 * lead
        for side in (LEFT, RIGHT):
            self._feet[side].own = (self._phase + 0.5 * side) % 1.0

    def _go_on(
        self,
        dt_s: float,
        body: tuple[float, float, float, float, float, float],
        acceleration: tuple[float, float],
        cadence: float,
        share: float,
        standing: bool,
    ) -> None:
        """Let the cycle go on: feet lift off, aim and land."""
        x, y, facing = body[:3]
        rate = max(cadence, _SLOWEST_HZ)
        limit = _BEHIND_SHARE * self._figures.stature_m
        for foot in self._feet:
            if not foot.swinging and math.hypot(x - foot.place[0], y - foot.place[1]) > limit:
                rate = max(rate, min(_CATCH_UP * rate, _QUICKEST_HZ))
        self._phase += rate * dt_s
        for side in (LEFT, RIGHT):
            foot = self._feet[side]
            before, foot.own = foot.own, (self._phase + 0.5 * side) % 1.0
            wrapped = foot.own < before
            if foot.swinging and wrapped:
                foot.place, foot.swinging, foot.since_s = foot.target, False, 0.0
            elif not foot.swinging:
                foot.since_s += dt_s
                other = self._feet[RIGHT - side]
                if foot.own >= share and not wrapped and not other.swinging:
                    goal = self._figures.neutral(side, x, y, facing, 0.0)
                    if standing and _near(goal, foot.place):
                        continue
                    foot.swinging, foot.lifted_at = True, foot.own
                    foot.from_pitch = foot.pitch
                    foot.target = self._aim(side, body, acceleration, rate, share)
            if foot.swinging:
                left = 1.0 - foot.own
                if left > (1.0 - _SETTLED) * (1.0 - foot.lifted_at):
                    foot.target = self._aim(side, body, acceleration, rate, share)

    def _aim(
        self,
        side: int,
        body: tuple[float, float, float, float, float, float],
        acceleration: tuple[float, float],
        rate: float,
        share: float,
    ) -> Place:
        """Where the swinging foot shall stand: under the body in the middle of its stance."""
        x, y, facing, vx, vy, turning = body
        over = 0.5 - 0.12 * min(max(2.0 * self._vigour, -1.0), 1.0)
        ahead_s = (1.0 - self._feet[side].own + over * share) / rate
        ax, ay = acceleration
        gain = vx * ax + vy * ay
        lasts_s = ahead_s
        if gain < -1e-6:  # brakes: nobody goes back for that
            lasts_s = min(ahead_s, -(vx * vx + vy * vy) / gain)
        elif gain > 0.0:
            lasts_s = ahead_s
            ax, ay = 0.5 * ax, 0.5 * ay  # the speed is nearly there
        dx = vx * lasts_s + 0.5 * ax * lasts_s * lasts_s
        dy = vy * lasts_s + 0.5 * ay * lasts_s * lasts_s
        turn = min(max(turning * ahead_s, -0.7), 0.7)
        goal = self._figures.neutral(side, x + dx, y + dy, facing + turn, self._vigour)
        start = self._feet[side].place
        return goal[0], goal[1], start[2] + math.remainder(goal[2] - start[2], math.tau)

    def _ankle(
        self, side: int, dt_s: float, cadence: float, share: float, place: Place
    ) -> tuple[float, float, float, float, float]:
        """Ankle of a foot: x, y, z, yaw, pitch."""
        foot = self._feet[side]
        rate = max(cadence, _SLOWEST_HZ)
        vigour = self._vigour
        lift = 0.0
        x, y, yaw = foot.place
        if foot.swinging:
            u = min((foot.own - foot.lifted_at) / max(1.0 - foot.lifted_at, 1e-6), 1.0)
            smooth = u * u * (3.0 - 2.0 * u)
            tx, ty, tyaw = foot.target
            reach = math.hypot(tx - x, ty - y) + 0.25 * abs(tyaw - yaw)
            x, y, yaw = x + smooth * (tx - x), y + smooth * (ty - y), yaw + smooth * (tyaw - yaw)
            off, land = foot.from_pitch, landing_rad(vigour)
            swing_s = min((1.0 - share) / rate, LONGEST_SWING_S)
            rolling = min(ROLLING_SHARE * share / rate, ROLLING_S)
            wanted = off + (land - off) * smooth
            wanted += 2.0 * off * swing_s / rolling * u * (1.0 - u) ** 2
            # The swinging foot makes way for the standing one.
            sin, cos = math.sin(place[2] + self._twist), math.cos(place[2] + self._twist)
            beside = cos * (y - place[1]) - sin * (x - place[0])
            clear = self._figures.half_width_m(side, vigour) + WAY_ROUND_M
            bump = min(1.6 * math.sin(math.pi * u) ** 2, 1.0)
            aside = max(clear - SIGNS[side] * beside, 0.0) * bump
            x -= SIGNS[side] * aside * sin
            y += SIGNS[side] * aside * cos
            reach += 4.0 * aside
            lift = (
                LIFT_M * math.sqrt(min(reach / self._figures.usual_m, 1.5)) * math.sin(math.pi * u)
            )
        else:
            stance_s = share / rate
            landed = min(foot.since_s / min(LOADING_SHARE * stance_s, LOADING_S), 1.0)
            landed = landed * landed * (3.0 - 2.0 * landed)
            wanted = landing_rad(vigour) * (1.0 - landed)
            if self._walking and foot.own < share:
                until_s = (share - foot.own) / rate
                rolled = max(1.0 - until_s / min(ROLLING_SHARE * stance_s, ROLLING_S), 0.0)
                wanted += off_rad(vigour) * rolled * rolled
        most = _PITCH_RADPS * dt_s
        foot.pitch += min(max(wanted - foot.pitch, -most), most)
        ahead, height = self._figures.rolled(side, foot.pitch)
        return x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), height + lift, yaw, foot.pitch

    def _footing(
        self,
        dt_s: float,
        feet: tuple[
            tuple[float, float, float, float, float], tuple[float, float, float, float, float]
        ],
        place: Place,
    ) -> Footing:
        """Hips and trunk to feet."""
        vigour, size = self._vigour, abs(self._vigour)
        # Phase counts from the left foot's landing.
        turn = math.cos(math.tau * self._phase)
        weight = math.cos(math.tau * (self._phase - MID_STANCE))
        sway = SWAY_M * min(2.0 * size, 1.0) * weight
        yaw = -PELVIS_YAW_RAD * vigour * turn + PELVIS_TWIST * self._twist
        tilt = PELVIS_LIST_RAD * size * weight
        highest = min(
            self._figures.hip_limit_m(feet, place, sway, yaw, tilt), self._figures.standing_m
        )
        if highest < self._height_m:
            self._height_m = highest
        else:
            self._height_m += (1.0 - math.exp(-dt_s / _RISING_S)) * (highest - self._height_m)
        return Footing(
            feet,
            self._height_m,
            sway,
            yaw,
            tilt,
            THORAX_YAW_RAD * vigour * turn,
            vigour,
            -ARM_SWING_RAD * vigour * turn,
        )


def _near(goal: Place, place: Place) -> bool:
    return (
        math.hypot(goal[0] - place[0], goal[1] - place[1]) < 0.03
        and abs(math.remainder(goal[2] - place[2], math.tau)) < _REST_RAD
    )
