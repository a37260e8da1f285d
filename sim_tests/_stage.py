"""The stage of one crossing: hall, robot and scripted workers, and the truth about them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception import AttentionCone
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._bullet import pybullet
from ._closing import Closing
from ._metrics import SafetyMeter
from ._scenario import Scenario
from ._sight import sees
from ._warehouse import Warehouse
from .people._script import WorkerMotion, WorkerScript
from .people._worker import MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD, Worker
from .robot._amr import NOVA_CARTER, Amr
from .robot._amr_look import AmrLook

# Surfaces are measured exactly once centres are nearer than this; farther away a bound will do.
_EXACT_WITHIN_M: Final = 4.0
# How far the true separation of a body with arms down lies above its bound.
_NEARER_THAN_BOUND_M: Final = 0.45
# Bodies move at their full rate and physics looks for contacts once surfaces were nearer than this
# in the last control cycle; nobody closes it within one.
_TOUCH_WITHIN_M: Final = 0.8
_BODY_UPDATE_HZ: Final = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class TrueView:
    """The truth about one worker at one instant.

    Attributes:
        position_camera_m: (3,) centre line at chest height, camera frame.
        gaze_camera: (3,) unit vector of the gaze, eyes included.
        awareness: cone score of the true gaze at the robot; 0 without a line of sight.
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
    """

    position_camera_m: FloatArray
    gaze_camera: FloatArray
    awareness: float
    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray

    @property
    def d_fwd_m(self) -> float:
        """Distance along the robot's heading, from the camera."""
        return float(self.position_camera_m[2])

    @property
    def d_lat_m(self) -> float:
        """Lateral offset from the robot's heading, left positive."""
        return -float(self.position_camera_m[0])


class Stage(Closing):
    """Everything that moves in one crossing.

    Args:
        scenario: what happens.
        start_offsets_s: how much later each worker starts.
    """

    def __init__(self, scenario: Scenario, start_offsets_s: FloatArray) -> None:
        self.scenario = scenario
        self.warehouse = Warehouse(scenario.layout)
        try:
            task = scenario.robot
            self.amr = Amr(
                self.warehouse,
                (task.start_x_m, task.start_y_m),
                math.radians(task.start_heading_deg),
                NOVA_CARTER,
            )
            self.scripts: tuple[WorkerScript, ...] = scenario.workers
            self.workers = tuple(
                Worker(self.warehouse, script.stature_m, look=script.look, stride_m=script.stride_m)
                for script in self.scripts
            )
        except BaseException:
            self.warehouse.close()
            raise
        self.warehouse.add_actor(AmrLook.of(self.warehouse, self.amr))
        self._walks = tuple(script.walk() for script in self.scripts)
        self._offsets_s = start_offsets_s
        self._motions: tuple[WorkerMotion, ...] = ()
        steps = 1.0 / (_BODY_UPDATE_HZ * self.warehouse.physics_dt_s)
        self._steps_per_body_update = max(round(steps), 1)
        self._close = [False] * len(self.workers)
        self._velocity_mps: FloatArray | None = None
        self._place_workers()

    def close(self) -> None:
        """End the physics world."""
        self.warehouse.close()

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self.warehouse.time_s

    def advance(self, until_s: float, meter: SafetyMeter) -> None:
        """Run physics to ``until_s``, moving the workers and recording contacts."""
        while self.t_s < until_s - 0.5 * self.warehouse.physics_dt_s:
            # Far from the robot a body that moves once a control cycle touches nobody either.
            if any(self._close) and self.warehouse.steps % self._steps_per_body_update == 0:
                self._place_workers()
            self.amr.advance(self.warehouse.physics_dt_s)
            # A collision slows the robot in the step that finds it, and in the one before, which
            # lets it come just as far as the body: what counts is how it came.
            earlier, now = self._velocity_mps, None
            if any(self._close):
                now = self.robot_velocity_odom_mps
            self._velocity_mps = now
            self.warehouse.step()
            if now is None:
                continue
            came = now
            if earlier is not None and earlier @ earlier > now @ now:
                came = earlier
            for index, close in enumerate(self._close):
                if close:
                    self._look_for_contact(index, came, meter)
        self._place_workers()

    def measure(self, meter: SafetyMeter, dt_s: float) -> tuple[float, ...]:
        """Account for the separation of every worker; returns the separation margins."""
        velocity = self.robot_velocity_odom_mps
        margins = []
        meter.separations_m.clear()
        for index, motion in enumerate(self._motions):
            separation, towards = self._separation(index)
            self._close[index] = separation < _TOUCH_WITHIN_M
            margins.append(
                meter.separation(separation, velocity, motion.velocity_odom_mps, towards, dt_s)
            )
        return tuple(margins)

    @property
    def robot_velocity_odom_mps(self) -> FloatArray:
        """(2,) velocity of the base origin."""
        state = self.amr.state(self.t_s)
        heading = state.heading_odom_rad
        return state.speed_mps * np.array([math.cos(heading), math.sin(heading)])

    def truth(self, cone: AttentionCone, T_odom_camera: FloatArray) -> tuple[TrueView, ...]:
        """The truth about every worker, from the robot's camera."""
        rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
        views = []
        for worker, motion in zip(self.workers, self._motions, strict=True):
            gaze = worker.gaze_odom
            alpha = float(cone.scores(worker.eyes_odom_m, gaze, origin))
            if alpha > 0.0 and not sees(worker, origin, through=frozenset({self.amr.body})):
                alpha = 0.0
            views.append(
                TrueView(
                    (worker.chest_odom_m - origin) @ rotation,
                    gaze @ rotation,
                    alpha,
                    motion.position_odom_m,
                    motion.velocity_odom_mps,
                )
            )
        return tuple(views)

    def _place_workers(self) -> None:
        camera_x, camera_y, camera_z = self.amr.T_odom_camera[:3, 3].tolist()
        motions = []
        for worker, script, walk, offset in zip(
            self.workers, self.scripts, self._walks, self._offsets_s, strict=True
        ):
            t_s = self.t_s - float(offset)
            motion = walk.motion(t_s)
            x, y = motion.position_odom_m.tolist()
            # Eyes stand at about 0.94 of the stature.
            up = camera_z - 0.94 * script.stature_m
            azimuth, elevation = script.gaze_angles(
                t_s,
                motion.heading_odom_rad,
                (
                    math.atan2(camera_y - y, camera_x - x),
                    math.atan2(up, math.hypot(camera_x - x, camera_y - y)),
                ),
            )
            eye_yaw, eye_pitch = script.eye_angles(t_s)
            yaw = math.remainder(azimuth - motion.heading_odom_rad, 2.0 * math.pi)
            worker.place(
                motion.position_odom_m,
                motion.heading_odom_rad,
                motion.walked_m,
                math.hypot(*motion.velocity_odom_mps.tolist()),
                min(max(yaw, -MAX_HEAD_YAW_RAD), MAX_HEAD_YAW_RAD),
                min(max(elevation, -MAX_HEAD_PITCH_RAD), MAX_HEAD_PITCH_RAD),
                eye_yaw_rad=eye_yaw,
                eye_pitch_rad=eye_pitch,
                activity=script.activity(t_s),
                feet=motion.feet,
            )
            motions.append(motion)
        self._motions = tuple(motions)

    def _separation(self, index: int) -> tuple[float, FloatArray]:
        """Distance between the surfaces and the direction (2,) from robot to worker."""
        base = self.amr.T_odom_base[:2, 3]
        centre = self._motions[index].position_odom_m - base
        distance = float(np.linalg.norm(centre))
        towards = centre / max(distance, 1e-9)
        bound = distance - self.amr.profile.circumscribed_radius_m - BODY_RADIUS_M
        if distance > _EXACT_WITHIN_M:
            return bound, towards
        # Pairs of shapes farther apart than asked for cost nothing, and one is always nearer than
        # this, but for what is carried on the far side.
        for within in (max(bound, 0.0) + _NEARER_THAN_BOUND_M, _EXACT_WITHIN_M):
            pairs = pybullet.getClosestPoints(
                self.amr.body,
                self.workers[index].body,
                within,
                physicsClientId=self.warehouse.client,
            )
            if pairs:
                break
        else:
            return bound, towards
        closest = min(pairs, key=lambda pair: pair[8])
        gap = np.array(closest[6][:2]) - np.array(closest[5][:2])
        length = float(np.linalg.norm(gap))
        separation = max(float(closest[8]), 0.0)
        return separation, gap / length if separation > 0.0 and length > 1e-3 else towards

    def _look_for_contact(
        self, index: int, robot_velocity_mps: FloatArray, meter: SafetyMeter
    ) -> None:
        touching = pybullet.getContactPoints(
            self.amr.body, self.workers[index].body, physicsClientId=self.warehouse.client
        )
        if any(point[8] <= 0.0 for point in touching):
            _, towards = self._separation(index)
            meter.touch(self.t_s, index, robot_velocity_mps, towards)
        else:
            meter.release(index)
