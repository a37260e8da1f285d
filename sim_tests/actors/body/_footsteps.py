"""Footsteps: each step is placed while the body moves.

A stance foot stays where it landed, rolls from heel to toe and lifts off. A swing foot aims at the
place under the body at midstance, which is predicted from the body's velocity and acceleration. All
arithmetic is scalar: NumPy is slow on two feet.

A stance begins with the loading response (the toes come down after the heel) and ends with the
roll-off (the heel lifts before the toes). Both take a share of the stance, up to a longest time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from ._gait import LONGEST_SWING_S, MAX_CADENCE_HZ, FootPose, Gait, GaitPose, PlanarPose
from ._skeleton import LEFT, RIGHT, SIGNS

_LOADING_SHARE: Final = 0.15
_LOADING_S: Final = 0.18
_ROLL_OFF_SHARE: Final = 0.43
_ROLL_OFF_S: Final = 0.45
# The weight is over the left foot at this phase, counted from its landing.
_MIDSTANCE_PHASE: Final = 0.30
# The body is over its foot earlier than halfway through a stance by this share of it.
_MIDSTANCE_SHIFT: Final = 0.12
# Lift of a foot in a swing as long as the comfortable stride.
_FOOT_LIFT_M: Final = 0.035
# A swing foot stays this much farther from the body's centre line than a stance foot.
_SWING_CLEARANCE_M: Final = 0.010
# A body that walks askew turns its feet towards the walk: at most by this angle, and less below
# this speed.
_TWIST_RAD: Final = math.radians(35.0)
_TWIST_FROM_MPS: Final = 0.3

# Amplitudes at the stride of a walk at 1.2 m/s.
_PELVIS_YAW_RAD: Final = 0.07
_PELVIS_LIST_RAD: Final = 0.035
_THORAX_YAW_RAD: Final = 0.06
_SWAY_M: Final = 0.016
_ARM_SWING_RAD: Final = 0.36
# Share of the angle between feet and heading that the pelvis follows.
_PELVIS_TWIST_SHARE: Final = 0.75

_LANDING_PITCH_RAD: Final = math.radians(-20.0)
_LIFT_OFF_PITCH_RAD: Final = math.radians(40.0)
# A backward step lands on the toes and lifts off from the heel.
_BACKWARD_LANDING_PITCH_RAD: Final = math.radians(16.0)
_BACKWARD_LIFT_OFF_PITCH_RAD: Final = math.radians(-12.0)
_MAX_PITCH_FACTOR: Final = 1.15

# Below both of these the body stands.
_STANDING_BELOW_MPS: Final = 0.05
_STANDING_BELOW_RADPS: Final = 0.15
# Feet this far from their neutral place take a step; walking ends once both are this near.
_STEP_FROM_M: Final = 0.07
_STEP_FROM_RAD: Final = math.radians(20.0)
_REST_WITHIN_M: Final = 0.05
_REST_WITHIN_RAD: Final = math.radians(12.0)
# A foot of a standing body this near to its neutral place does not lift off.
_STAY_WITHIN_M: Final = 0.03
_MIN_CADENCE_HZ: Final = 0.75
# A foot farther behind the body than this share of stature speeds up the cadence by this factor.
_MAX_BEHIND_SHARE: Final = 0.34
_CATCH_UP_FACTOR: Final = 1.6
_MAX_STANCE_SHARE: Final = 0.75
# The landing place is updated during this share of a swing, then it is fixed.
_AIMING_SHARE: Final = 0.75
# The body turns by no more than this while a foot swings and stands.
_MAX_TURN_RAD: Final = 0.7
_SMOOTHING_S: Final = 0.15
_HIPS_RISING_S: Final = 0.12
_MAX_PITCH_RATE_RADPS: Final = 8.0
# Longest time step of a steady walk.
_STEADY_STEP_S: Final = 1.0 / 60.0


@dataclass(slots=True)
class _Foot:
    """One foot, in stance or in swing; its phase is the share of the cycle since it landed."""

    place: PlanarPose
    target: PlanarPose
    swinging: bool = False
    phase: float = 0.0
    lift_off_phase: float = 0.0
    landed_for_s: float = math.inf
    pitch: float = 0.0
    lift_off_pitch: float = 0.0

    def copy(self) -> _Foot:
        """Return an independent foot in the same state."""
        return _Foot(
            self.place,
            self.target,
            self.swinging,
            self.phase,
            self.lift_off_phase,
            self.landed_for_s,
            self.pitch,
            self.lift_off_pitch,
        )


class OnlineFootsteps:
    """The feet of one body, placed step by step."""

    def __init__(self, gait: Gait, x_m: float, y_m: float, heading_rad: float) -> None:
        self._gait = gait
        places = [gait.neutral(side, x_m, y_m, heading_rad, 0.0) for side in (LEFT, RIGHT)]
        self._feet = [_Foot(place, place) for place in places]
        self._phase = 0.0
        self._walking = False
        self._stride_ratio = self._twist = 0.0
        self._hip_height_m = gait.standing.hip_height_m
        self._pose: GaitPose | None = None
        # All attributes before the last step.
        self._before_step: dict[str, Any] = {}

    def undo(self) -> None:
        """Take the last :meth:`step` back, because the body did not move."""
        vars(self).update(self._before_step)

    def translate(self, dx_m: float, dy_m: float) -> GaitPose | None:
        """Shift feet and body without a step; return the pose, None before the first step."""
        if self._pose is None:
            return None
        for foot in self._feet:
            foot.place = (foot.place[0] + dx_m, foot.place[1] + dy_m, foot.place[2])
            foot.target = (foot.target[0] + dx_m, foot.target[1] + dy_m, foot.target[2])
        self._before_step = {}
        self._pose = self._pose.moved(dx_m, dy_m)
        return self._pose

    def step(
        self,
        dt_s: float,
        place: PlanarPose,
        velocity: tuple[float, float, float],
        acceleration: tuple[float, float],
    ) -> GaitPose:
        """Advance by ``dt_s`` ≥ 0 and return the pose in odom."""
        left_foot, right_foot = self._feet
        feet_before = [left_foot.copy(), right_foot.copy()]
        self._before_step = {**vars(self), "_feet": feet_before, "_before_step": {}}
        x, y, heading = place
        vx, vy, turning = velocity
        speed = math.hypot(vx, vy)
        askew = 0.0
        if speed > 1e-3:
            askew = math.atan2(vy, vx) - heading
        blend = 1.0 - math.exp(-dt_s / _SMOOTHING_S)
        twist = _TWIST_RAD * min(speed / _TWIST_FROM_MPS, 1.0) * math.sin(2.0 * askew)
        self._twist += blend * (twist - self._twist)
        along = askew - self._twist
        forward, left = speed * math.cos(along), speed * math.sin(along)
        stride_ratio = self._gait.stride_ratio(forward)
        if speed <= _STANDING_BELOW_MPS:
            stride_ratio = 0.0
        self._stride_ratio += blend * (stride_ratio - self._stride_ratio)
        share = min(self._gait.stance_share(speed), _MAX_STANCE_SHARE)
        cadence = self._gait.cadence_hz(forward, left, turning)
        standing = speed <= _STANDING_BELOW_MPS and abs(turning) <= _STANDING_BELOW_RADPS
        facing = heading + self._twist
        if not self._walking and (
            not standing or self._misplaced(x, y, facing, _STEP_FROM_M, _STEP_FROM_RAD)
        ):
            self._start_walking(share, left, turning)
        if self._walking:
            body = (x, y, facing, vx, vy, turning)
            self._advance_cycle(dt_s, body, acceleration, cadence, share, standing)
            swings = self._feet[LEFT].swinging or self._feet[RIGHT].swinging
            if (
                standing
                and not swings
                and not self._misplaced(x, y, facing, _REST_WITHIN_M, _REST_WITHIN_RAD)
            ):
                self._walking = False
        rate = max(cadence, _MIN_CADENCE_HZ)
        ankles = (
            self._ankle(LEFT, dt_s, rate, share, place),
            self._ankle(RIGHT, dt_s, rate, share, place),
        )
        self._pose = self._gait_pose(dt_s, ankles, place)
        return self._pose

    def _misplaced(
        self, x: float, y: float, facing: float, limit_m: float, limit_rad: float
    ) -> bool:
        """Return whether a foot is too far from its neutral place in standing."""
        for side in (LEFT, RIGHT):
            nx, ny, nyaw = self._gait.neutral(side, x, y, facing, 0.0)
            px, py, pyaw = self._feet[side].place
            if math.hypot(nx - px, ny - py) > limit_m:
                return True
            if abs(math.remainder(nyaw - pyaw, math.tau)) > limit_rad:
                return True
        return False

    def _start_walking(self, share: float, left_mps: float, turning_radps: float) -> None:
        """Start with the foot on the side of the motion, so that the feet do not cross."""
        lead = RIGHT if left_mps + 0.3 * turning_radps < -0.02 else LEFT
        self._walking = True
        self._phase = share - 0.5 * lead
        for side in (LEFT, RIGHT):
            self._feet[side].phase = (self._phase + 0.5 * side) % 1.0

    def _advance_cycle(
        self,
        dt_s: float,
        body: tuple[float, float, float, float, float, float],
        acceleration: tuple[float, float],
        cadence: float,
        share: float,
        standing: bool,
    ) -> None:
        """Advance the cycle: feet land, lift off and aim at their next place."""
        x, y, facing = body[:3]
        rate = max(cadence, _MIN_CADENCE_HZ)
        limit = _MAX_BEHIND_SHARE * self._gait.stature_m
        for foot in self._feet:
            if not foot.swinging and math.hypot(x - foot.place[0], y - foot.place[1]) > limit:
                rate = max(rate, min(_CATCH_UP_FACTOR * rate, MAX_CADENCE_HZ))
        self._phase += rate * dt_s
        for side in (LEFT, RIGHT):
            foot = self._feet[side]
            before, foot.phase = foot.phase, (self._phase + 0.5 * side) % 1.0
            wrapped = foot.phase < before
            if foot.swinging and wrapped:
                foot.place, foot.swinging, foot.landed_for_s = foot.target, False, 0.0
            elif not foot.swinging:
                foot.landed_for_s += dt_s
                other = self._feet[RIGHT - side]
                if foot.phase >= share and not wrapped and not other.swinging:
                    neutral = self._gait.neutral(side, x, y, facing, 0.0)
                    if standing and _may_stay(foot.place, neutral):
                        continue
                    foot.swinging, foot.lift_off_phase = True, foot.phase
                    foot.lift_off_pitch = foot.pitch
                    foot.target = self._landing_place(side, body, acceleration, rate, share)
            if foot.swinging:
                left = 1.0 - foot.phase
                if left > (1.0 - _AIMING_SHARE) * (1.0 - foot.lift_off_phase):
                    foot.target = self._landing_place(side, body, acceleration, rate, share)

    def _landing_place(
        self,
        side: int,
        body: tuple[float, float, float, float, float, float],
        acceleration: tuple[float, float],
        rate: float,
        share: float,
    ) -> PlanarPose:
        """Return the place of the swing foot under the body's predicted position at midstance."""
        x, y, facing, vx, vy, turning = body
        midstance = 0.5 - _MIDSTANCE_SHIFT * min(max(2.0 * self._stride_ratio, -1.0), 1.0)
        ahead_s = (1.0 - self._feet[side].phase + midstance * share) / rate
        ax, ay = acceleration
        gain = vx * ax + vy * ay
        lasts_s = ahead_s
        if gain < -1e-6:  # a body that brakes stops, and does not go backwards
            lasts_s = min(ahead_s, -(vx * vx + vy * vy) / gain)
        elif gain > 0.0:  # a body that speeds up has nearly reached its speed
            ax, ay = 0.5 * ax, 0.5 * ay
        dx = vx * lasts_s + 0.5 * ax * lasts_s * lasts_s
        dy = vy * lasts_s + 0.5 * ay * lasts_s * lasts_s
        turn = min(max(turning * ahead_s, -_MAX_TURN_RAD), _MAX_TURN_RAD)
        goal = self._gait.neutral(side, x + dx, y + dy, facing + turn, self._stride_ratio)
        start = self._feet[side].place
        return goal[0], goal[1], start[2] + math.remainder(goal[2] - start[2], math.tau)

    def _ankle(
        self, side: int, dt_s: float, rate: float, share: float, place: PlanarPose
    ) -> FootPose:
        """Return the pose of a foot; advances its pitch."""
        foot = self._feet[side]
        stride_ratio = self._stride_ratio
        lift = 0.0
        x, y, yaw = foot.place
        if foot.swinging:
            u = min((foot.phase - foot.lift_off_phase) / max(1.0 - foot.lift_off_phase, 1e-6), 1.0)
            smooth = u * u * (3.0 - 2.0 * u)
            tx, ty, tyaw = foot.target
            reach = math.hypot(tx - x, ty - y) + 0.25 * abs(tyaw - yaw)
            x, y, yaw = x + smooth * (tx - x), y + smooth * (ty - y), yaw + smooth * (tyaw - yaw)
            lift_off, landing = foot.lift_off_pitch, _landing_pitch_rad(stride_ratio)
            swing_s = min((1.0 - share) / rate, LONGEST_SWING_S)
            roll_off_s = min(_ROLL_OFF_SHARE * share / rate, _ROLL_OFF_S)
            pitch = lift_off + (landing - lift_off) * smooth
            pitch += 2.0 * lift_off * swing_s / roll_off_s * u * (1.0 - u) ** 2
            # The swing foot goes round the stance foot.
            sin, cos = math.sin(place[2] + self._twist), math.cos(place[2] + self._twist)
            beside = cos * (y - place[1]) - sin * (x - place[0])
            clear = self._gait.half_width_m(side, stride_ratio) + _SWING_CLEARANCE_M
            bump = min(1.6 * math.sin(math.pi * u) ** 2, 1.0)
            aside = max(clear - SIGNS[side] * beside, 0.0) * bump
            x -= SIGNS[side] * aside * sin
            y += SIGNS[side] * aside * cos
            reach += 4.0 * aside
            strides = min(reach / self._gait.comfortable_stride_m, 1.5)
            lift = _FOOT_LIFT_M * math.sqrt(strides) * math.sin(math.pi * u)
        else:
            stance_s = share / rate
            landed = min(foot.landed_for_s / min(_LOADING_SHARE * stance_s, _LOADING_S), 1.0)
            landed = landed * landed * (3.0 - 2.0 * landed)
            pitch = _landing_pitch_rad(stride_ratio) * (1.0 - landed)
            if self._walking and foot.phase < share:
                until_lift_off_s = (share - foot.phase) / rate
                roll_off_s = min(_ROLL_OFF_SHARE * stance_s, _ROLL_OFF_S)
                rolled = max(1.0 - until_lift_off_s / roll_off_s, 0.0)
                pitch += _lift_off_pitch_rad(stride_ratio) * rolled * rolled
        most = _MAX_PITCH_RATE_RADPS * dt_s
        foot.pitch += min(max(pitch - foot.pitch, -most), most)
        ahead, height = self._gait.ankle(side, foot.pitch)
        return x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), height + lift, yaw, foot.pitch

    def _gait_pose(
        self, dt_s: float, feet: tuple[FootPose, FootPose], place: PlanarPose
    ) -> GaitPose:
        """Return the pose of hips and trunk over these feet; advances the hip height."""
        stride_ratio, size = self._stride_ratio, abs(self._stride_ratio)
        # The phase counts from the left foot's landing.
        turn = math.cos(math.tau * self._phase)
        weight = math.cos(math.tau * (self._phase - _MIDSTANCE_PHASE))
        sway = _SWAY_M * min(2.0 * size, 1.0) * weight
        yaw = -_PELVIS_YAW_RAD * stride_ratio * turn + _PELVIS_TWIST_SHARE * self._twist
        tilt = _PELVIS_LIST_RAD * size * weight
        highest = min(
            self._gait.hip_limit_m(feet, place, sway, yaw, tilt), self._gait.standing.hip_height_m
        )
        if highest < self._hip_height_m:
            self._hip_height_m = highest
        else:
            rise = 1.0 - math.exp(-dt_s / _HIPS_RISING_S)
            self._hip_height_m += rise * (highest - self._hip_height_m)
        return GaitPose(
            feet,
            self._hip_height_m,
            sway,
            yaw,
            tilt,
            _THORAX_YAW_RAD * stride_ratio * turn,
            stride_ratio,
            -_ARM_SWING_RAD * stride_ratio * turn,
        )


def _may_stay(place: PlanarPose, neutral: PlanarPose) -> bool:
    """Return whether a foot of a standing body is near enough to its neutral place."""
    return (
        math.hypot(neutral[0] - place[0], neutral[1] - place[1]) < _STAY_WITHIN_M
        and abs(math.remainder(neutral[2] - place[2], math.tau)) < _REST_WITHIN_RAD
    )


def steady_walk(gait: Gait, walked_m: float, speed_mps: float) -> GaitPose:
    """Return the pose in a straight walk at one speed, in the body's frame.

    The feet have walked two to three cycles from standing; the distance gives the phase.
    """
    if speed_mps <= _STANDING_BELOW_MPS:
        return gait.standing
    cycle_m = speed_mps / max(gait.cadence_hz(speed_mps, 0.0, 0.0), _MIN_CADENCE_HZ)
    start_m = -cycle_m * (2.0 + walked_m / cycle_m % 1.0)
    steps = math.ceil(-start_m / speed_mps / _STEADY_STEP_S)
    feet = OnlineFootsteps(gait, start_m, 0.0, 0.0)
    pose = gait.standing
    for step in range(steps):
        x = start_m * (1.0 - (step + 1) / steps)
        pose = feet.step(
            -start_m / speed_mps / steps, (x, 0.0, 0.0), (speed_mps, 0.0, 0.0), (0.0, 0.0)
        )
    return pose


def _landing_pitch_rad(stride_ratio: float) -> float:
    """Return the pitch of a landing foot; toes down is positive."""
    size = min(abs(stride_ratio), _MAX_PITCH_FACTOR)
    return size * (_LANDING_PITCH_RAD if stride_ratio >= 0.0 else _BACKWARD_LANDING_PITCH_RAD)


def _lift_off_pitch_rad(stride_ratio: float) -> float:
    """Return the pitch of a foot that lifts off; toes down is positive."""
    size = min(abs(stride_ratio), _MAX_PITCH_FACTOR)
    return size * (_LIFT_OFF_PITCH_RAD if stride_ratio >= 0.0 else _BACKWARD_LIFT_OFF_PITCH_RAD)
