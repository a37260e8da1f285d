"""Feet of a walk that nobody knows beforehand: steps are set as the body goes.

The same gait as :func:`footstep_table`: a stance foot stays where it landed, rolls from heel to toe
and lifts off; a swinging one aims at where the body will be over it. What comes is guessed from
the body's velocity and acceleration. Scalars throughout: NumPy is slow on two feet.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

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
    USED_REACH,
    WAY_ROUND_M,
    Gait,
    landing_rad,
    off_rad,
)
from ._skeleton import SIGNS

# Slower than this and the body only shifts its weight.
_MOVING_MPS: Final = 0.05
_MOVING_RADPS: Final = 0.15
# Feet so far from where they belong take a step, and rest once they are so near.
_STEP_M: Final = 0.07
_STEP_RAD: Final = math.radians(20.0)
_REST_M: Final = 0.05
_REST_RAD: Final = math.radians(12.0)
# Turning on the spot, so far in a cycle of two steps; sideways and backwards steps are short.
_TURN_PER_CYCLE_RAD: Final = math.radians(60.0)
_SIDE_STRIDE_SHARE: Final = 0.12
_BACK_STRIDE_SHARE: Final = 0.75
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
_TABLE_MPS: Final = 0.05
_FASTEST_MPS: Final = 3.5
_ROLL_RAD: Final = 0.005
_ROLL_MAX_RAD: Final = 0.9

_Place = tuple[float, float, float]  # x, y, yaw of a flat foot


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

    def __init__(self, place: _Place) -> None:
        self.place = self.target = place
        self.swinging = False
        self.own = 0.0  # of the cycle since it landed
        self.lifted_at = 0.0
        self.since_s = math.inf
        self.pitch = self.from_pitch = 0.0


class OnlineFeet:
    """Sets the feet of one body.

    Args:
        gait: of the body.
        x_m: where it stands.
        y_m: where it stands.
        heading_rad: which way it faces.
    """

    def __init__(self, gait: Gait, x_m: float, y_m: float, heading_rad: float) -> None:
        bones = gait.skeleton
        self._stature_m = bones.stature_m
        speeds = np.arange(0.0, _FASTEST_MPS + _TABLE_MPS, _TABLE_MPS)
        self._strides: list[float] = gait.stride_m(speeds).tolist()
        self._shares: list[float] = gait.stance_share(speeds).tolist()
        self._vigours: list[float] = gait.vigour(speeds).tolist()
        self._usual_m = float(gait.stride_m(1.2))
        self._standing_m = gait.standing_height_m
        here, level = np.zeros((2, 2)), np.zeros(2)
        # Ahead, and half the width standing and in a brisk walk.
        neutral = [gait.neutral(side, here, level, np.array([0.0, 1.0])) for side in (LEFT, RIGHT)]
        self._ahead = [float(rows[0, 0]) for rows in neutral]
        self._wide = [abs(float(rows[0, 1])) for rows in neutral]
        self._narrow = [abs(float(rows[1, 1])) for rows in neutral]
        self._out = [float(rows[0, 2]) for rows in neutral]
        pitches = np.arange(-_ROLL_MAX_RAD, _ROLL_MAX_RAD + _ROLL_RAD, _ROLL_RAD)
        rolls = [sole.ankle(pitches) for sole in bones.soles]
        self._rolls: list[tuple[list[float], list[float]]] = [
            (ahead.tolist(), height.tolist()) for ahead, height in rolls
        ]
        hips = [
            np.subtract(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in ("left", "right")
        ]
        self._hips: list[list[float]] = [hip.tolist() for hip in hips]
        self._reach_m = [USED_REACH * leg.reach_m for leg in bones.legs]
        self._feet = [
            _Foot(self._neutral(side, x_m, y_m, heading_rad, 0.0)) for side in (LEFT, RIGHT)
        ]
        self._phase = 0.0
        self._walking = False
        self._vigour = self._twist = 0.0
        self._height_m = self._standing_m

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
        vigour = math.copysign(_look_up(self._vigours, abs(ahead)), ahead)
        if speed <= _MOVING_MPS:
            vigour = 0.0
        self._vigour += blend * (vigour - self._vigour)
        share = min(_look_up(self._shares, speed), 0.75)
        cadence = self._cadence_hz(ahead, aside, turning)
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
        return self._footing(dt_s, (rows[0], rows[1]), place)

    def _cadence_hz(self, ahead: float, aside: float, turning: float) -> float:
        """Cycles a second that speed and turning ask for together."""
        forward = max(_look_up(self._strides, math.hypot(ahead, aside)), 1e-6)
        if ahead < 0.0:
            forward *= _BACK_STRIDE_SHARE
        sideways = min(forward, _SIDE_STRIDE_SHARE * self._stature_m)
        turn = turning / _TURN_PER_CYCLE_RAD
        return min(math.hypot(ahead / forward, aside / sideways, turn), _QUICKEST_HZ)

    def _misplaced(self, x: float, y: float, facing: float, far_m: float, far_rad: float) -> bool:
        """Whether a foot stands too far from where it belongs when standing."""
        for side in (LEFT, RIGHT):
            nx, ny, nyaw = self._neutral(side, x, y, facing, 0.0)
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
        limit = _BEHIND_SHARE * self._stature_m
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
                    goal = self._neutral(side, x, y, facing, 0.0)
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
    ) -> _Place:
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
        goal = self._neutral(side, x + dx, y + dy, facing + turn, self._vigour)
        start = self._feet[side].place
        return goal[0], goal[1], start[2] + math.remainder(goal[2] - start[2], math.tau)

    def _neutral(self, side: int, x: float, y: float, facing: float, vigour: float) -> _Place:
        """Where a flat foot belongs under a body."""
        width = self._half_width_m(side, vigour)
        cos, sin = math.cos(facing), math.sin(facing)
        ahead, across = self._ahead[side], SIGNS[side] * width
        return (
            x + cos * ahead - sin * across,
            y + sin * ahead + cos * across,
            facing + self._out[side],
        )

    def _half_width_m(self, side: int, vigour: float) -> float:
        wide, narrow = self._wide[side], self._narrow[side]
        return wide + min(abs(vigour), 1.0) * (narrow - wide)

    def _ankle(
        self, side: int, dt_s: float, cadence: float, share: float, place: _Place
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
            clear = self._half_width_m(side, vigour) + WAY_ROUND_M
            bump = min(1.6 * math.sin(math.pi * u) ** 2, 1.0)
            aside = max(clear - SIGNS[side] * beside, 0.0) * bump
            x -= SIGNS[side] * aside * sin
            y += SIGNS[side] * aside * cos
            reach += 4.0 * aside
            lift = LIFT_M * math.sqrt(min(reach / self._usual_m, 1.5)) * math.sin(math.pi * u)
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
        at = (foot.pitch + _ROLL_MAX_RAD) / _ROLL_RAD
        ahead, height = (_mixed(column, at) for column in self._rolls[side])
        return x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), height + lift, yaw, foot.pitch

    def _footing(
        self,
        dt_s: float,
        feet: tuple[
            tuple[float, float, float, float, float], tuple[float, float, float, float, float]
        ],
        place: _Place,
    ) -> Footing:
        """Hips and trunk to feet."""
        vigour, size = self._vigour, abs(self._vigour)
        # Phase counts from the left foot's landing.
        turn = math.cos(math.tau * self._phase)
        weight = math.cos(math.tau * (self._phase - MID_STANCE))
        sway = SWAY_M * min(2.0 * size, 1.0) * weight
        yaw = -PELVIS_YAW_RAD * vigour * turn + PELVIS_TWIST * self._twist
        tilt = PELVIS_LIST_RAD * size * weight
        highest = min(self._hip_limit_m(feet, place, sway, yaw, tilt), self._standing_m)
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

    def _hip_limit_m(
        self,
        feet: tuple[tuple[float, ...], tuple[float, ...]],
        place: _Place,
        sway: float,
        yaw: float,
        tilt: float,
    ) -> float:
        """The highest that the hips may be for both ankles to be in reach."""
        x, y, heading = place
        cos, sin = math.cos(heading + yaw), math.sin(heading + yaw)
        cos_tilt, sin_tilt = math.cos(tilt), math.sin(tilt)
        x, y = x - math.sin(heading) * sway, y + math.cos(heading) * sway
        lowest = math.inf
        for side in (LEFT, RIGHT):
            hip_x, hip_y, hip_z = self._hips[side]
            across = hip_y * cos_tilt - hip_z * sin_tilt
            dx = feet[side][0] - (x + cos * hip_x - sin * across)
            dy = feet[side][1] - (y + sin * hip_x + cos * across)
            reach = self._reach_m[side]
            up = math.sqrt(max(reach * reach - dx * dx - dy * dy, (0.5 * reach) ** 2))
            lowest = min(lowest, feet[side][2] + up - (hip_y * sin_tilt + hip_z * cos_tilt))
        return lowest


def _look_up(table: list[float], speed: float) -> float:
    return _mixed(table, speed / _TABLE_MPS)


def _mixed(table: list[float], at: float) -> float:
    """The table at a row that need not be whole, within its ends."""
    at = min(max(at, 0.0), len(table) - 1.001)
    row = int(at)
    return table[row] + (at - row) * (table[row + 1] - table[row])


def _near(goal: _Place, place: _Place) -> bool:
    return (
        math.hypot(goal[0] - place[0], goal[1] - place[1]) < 0.03
        and abs(math.remainder(goal[2] - place[2], math.tau)) < _REST_RAD
    )
