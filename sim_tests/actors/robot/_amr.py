"""A differential-drive robot with a camera on a post."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from nav_adapter import RobotProfile, RobotState
from perception.arrays import FloatArray, finite_array, finite_number

from ...world import ROBOT_GROUP, Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError

MAX_YAW_RATE_RADPS: Final = 1.5
MAX_YAW_ACCELERATION_RADPS2: Final = 3.0

#: Nova Carter's published outline; its centre is midway between the drive wheels.
NOVA_CARTER: Final = RobotProfile(
    footprint_m=np.array([[0.3625, 0.25], [-0.3625, 0.25], [-0.3625, -0.25], [0.3625, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
    max_yaw_rate_radps=MAX_YAW_RATE_RADPS,
    max_yaw_acceleration_radps2=MAX_YAW_ACCELERATION_RADPS2,
)

WHEEL_RADIUS_M: Final = 0.14
TRACK_M: Final = 0.414
CAMERA_HEIGHT_M: Final = 1.4
# Just ahead of the camera's housing, so that the robot does not see itself.
CAMERA_FORWARD_M: Final = 0.165

# Position of a camera that looks all around: above everything on the post.
_ABOVE_POST_M: Final = (0.12, 0.0, 1.55)

# More than 98 kg at 1 m/s² need on two wheels (7 N·m each), and too little to spin the tyres.
_MAX_WHEEL_TORQUE_NM: Final = 25.0
_TYRE_FRICTION: Final = 1.0
# The axes of the optical frame (x right, y down, z forward) in the base frame, as columns.
_ROTATION_BASE_OPTICAL: Final = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
_IDENTITY: Final = np.eye(4)


class _Motion(NamedTuple):
    """Pose and velocity of the base after one step of the physics."""

    rotation: FloatArray
    origin_m: FloatArray
    heading_rad: float
    speed_mps: float
    yaw_rate_radps: float


class Amr:
    """A differential-drive robot in a warehouse.

    The base frame lies on the floor midway between the drive wheels (REP-105's base_footprint):
    x forward, y left, z up. Only the motors of the two wheel joints move the robot. Their speeds
    follow the command within acceleration limits and a torque limit.

    Args:
        warehouse: the world to drive in.
        position_odom_m: (2,) start.
        heading_odom_rad: heading at the start, counter-clockwise from odom x.
        profile: limits of the motion; the body is always that of :data:`NOVA_CARTER`.
        camera_pitch_rad: pitch of the camera, down positive, in (−π/2, π/2).
        camera_mount: ``"front"`` or ``"top"`` of the post.

    Attributes:
        body: PyBullet's id of the robot.
        profile: as given.
        T_base_camera: (4, 4) pose of the optical frame in the base frame.

    Raises:
        SimError: for arguments that are not finite or out of range.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        position_odom_m: Any = (0.0, 0.0),
        heading_odom_rad: float = 0.0,
        profile: RobotProfile = NOVA_CARTER,
        camera_pitch_rad: float = 0.0,
        camera_mount: Literal["front", "top"] = "front",
    ) -> None:
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        pitch = finite_number(
            "camera_pitch_rad", camera_pitch_rad, SimError, minimum=-1.57, maximum=1.57
        )
        self.profile = profile
        self.T_base_camera = camera_pose(
            _ABOVE_POST_M if camera_mount == "top" else (CAMERA_FORWARD_M, 0.0, CAMERA_HEIGHT_M),
            pitch,
        )
        self._warehouse = warehouse
        self._client = warehouse.client
        source = resources.files("sim_tests.actors.robot") / "amr.urdf"
        with resources.as_file(source) as path:
            self.body: int = pybullet.loadURDF(
                str(path),
                basePosition=[x, y, 0.0],
                baseOrientation=[0.0, 0.0, math.sin(0.5 * heading), math.cos(0.5 * heading)],
                # A cylinder made of facets would roll bumpily.
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER,
                physicsClientId=self._client,
            )
        self._set_up_dynamics()
        # PyBullet reports the pose of the base link's centre of mass; this leads back to its frame.
        dynamics = pybullet.getDynamicsInfo(self.body, -1, physicsClientId=self._client)
        self._to_base_m = -np.array(dynamics[3])
        self._target_speed_mps = 0.0
        self._target_yaw_rate_radps = 0.0
        self._speed_mps = 0.0
        self._yaw_rate_radps = 0.0
        self._read_at_step = -1
        self._last_motion = _Motion(np.eye(3), np.zeros(3), 0.0, 0.0, 0.0)
        self._last_poses: tuple[_Motion | None, FloatArray, FloatArray] = None, np.eye(4), np.eye(4)
        self._drive()

    def command(self, speed_mps: float, yaw_rate_radps: float, lateral_mps: float = 0.0) -> None:
        """Set the target speed (m/s forwards) and yaw rate (rad/s counter-clockwise).

        Its wheels cannot move sideways: ``lateral_mps`` has no effect. A command beyond the
        robot's limits is clipped, as by its motor controller.
        """
        speed = finite_number("speed_mps", speed_mps, SimError)
        yaw_rate = finite_number("yaw_rate_radps", yaw_rate_radps, SimError)
        limit = self.profile.max_speed_mps
        self._target_speed_mps = min(max(speed, -limit), limit)
        self._target_yaw_rate_radps = min(max(yaw_rate, -MAX_YAW_RATE_RADPS), MAX_YAW_RATE_RADPS)

    def advance(self, dt_s: float) -> None:
        """Ramp the wheels towards the command for ``dt_s`` > 0; call it before a physics step."""
        dt = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        if (
            self._speed_mps == self._target_speed_mps
            and self._yaw_rate_radps == self._target_yaw_rate_radps
        ):
            return
        speed = ramped(
            self._speed_mps,
            self._target_speed_mps,
            self.profile.max_acceleration_mps2 * dt,
            self.profile.max_deceleration_mps2 * dt,
        )
        change = MAX_YAW_ACCELERATION_RADPS2 * dt
        yaw_rate = ramped(self._yaw_rate_radps, self._target_yaw_rate_radps, change, change)
        if speed != self._speed_mps or yaw_rate != self._yaw_rate_radps:
            self._speed_mps, self._yaw_rate_radps = speed, yaw_rate
            self._drive()

    @property
    def driven_speed_mps(self) -> float:
        """Present target speed of the motors; a push from outside does not change it."""
        return self._speed_mps

    def state(self, stamp_s: float) -> RobotState:
        """Return the robot's state in the physics."""
        motion = self._motion()
        return RobotState(
            stamp_s=stamp_s,
            position_odom_m=motion.origin_m[:2],
            heading_odom_rad=motion.heading_rad,
            speed_mps=motion.speed_mps,
            yaw_rate_radps=motion.yaw_rate_radps,
        )

    @property
    def velocity_odom_mps(self) -> FloatArray:
        """(2,) velocity of the base origin, which points along the heading."""
        motion = self._motion()
        heading, speed = motion.heading_rad, motion.speed_mps
        return np.array([speed * math.cos(heading), speed * math.sin(heading)])

    @property
    def T_odom_base(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the base frame in odom, with the slight pitch of its motion."""
        return self._poses()[0]

    @property
    def T_odom_camera(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the camera's optical frame in odom."""
        return self._poses()[1]

    def touches(self, body: int) -> bool:
        """Return whether another body touches the robot."""
        points = pybullet.getContactPoints(self.body, body, physicsClientId=self._client)
        return any(point[8] <= 0.0 for point in points)

    def _motion(self) -> _Motion:
        """Return the motion after the latest step; it is read once per step."""
        if self._read_at_step == self._warehouse.steps:
            return self._last_motion
        self._read_at_step = self._warehouse.steps
        com, quaternion = pybullet.getBasePositionAndOrientation(
            self.body, physicsClientId=self._client
        )
        velocity, angular = pybullet.getBaseVelocity(self.body, physicsClientId=self._client)
        entries = pybullet.getMatrixFromQuaternion(quaternion)
        rotation = np.array(entries).reshape(3, 3)
        # On so few numbers dot takes half the time of @.
        arm = rotation.dot(self._to_base_m)
        (wx, wy, wz), (x, y, z), (vx, vy, vz) = angular, arm.tolist(), velocity
        origin_velocity = np.array(
            [vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x)]
        )
        self._last_motion = _Motion(
            rotation,
            com + arm,
            math.atan2(entries[3], entries[0]),
            float(origin_velocity.dot(rotation[:, 0])),
            angular[2],
        )
        return self._last_motion

    def _poses(self) -> tuple[FloatArray, FloatArray]:
        """Return T_odom_base and T_odom_camera of the latest step."""
        motion = self._motion()
        if self._last_poses[0] is not motion:
            T = _IDENTITY.copy()
            T[:3, :3], T[:3, 3] = motion.rotation, motion.origin_m
            T.setflags(write=False)
            T_odom_camera = T.dot(self.T_base_camera)
            T_odom_camera.setflags(write=False)
            self._last_poses = motion, T, T_odom_camera
        return self._last_poses[1:]

    def _set_up_dynamics(self) -> None:
        links = {
            pybullet.getJointInfo(self.body, joint, physicsClientId=self._client)[
                12
            ].decode(): joint
            for joint in range(pybullet.getNumJoints(self.body, physicsClientId=self._client))
        }
        self._wheels = [links["left_wheel"], links["right_wheel"]]
        for link in (-1, *links.values()):
            rolls = link in self._wheels
            pybullet.changeDynamics(
                self.body,
                link,
                # Casters and body slide without friction.
                lateralFriction=_TYRE_FRICTION if rolls else 0.0,
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=self._client,
            )
            pybullet.setCollisionFilterGroupMask(
                self.body, link, ROBOT_GROUP, -1, physicsClientId=self._client
            )

    def _drive(self) -> None:
        turn = 0.5 * TRACK_M * self._yaw_rate_radps
        pybullet.setJointMotorControlArray(
            self.body,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[
                (self._speed_mps - turn) / WHEEL_RADIUS_M,
                (self._speed_mps + turn) / WHEEL_RADIUS_M,
            ],
            forces=[_MAX_WHEEL_TORQUE_NM, _MAX_WHEEL_TORQUE_NM],
            physicsClientId=self._client,
        )


def camera_pose(place_base_m: tuple[float, float, float], pitch_rad: float = 0.0) -> FloatArray:
    """Return T_base_camera of a camera that looks ahead, and down by ``pitch_rad``."""
    cos, sin = math.cos(pitch_rad), math.sin(pitch_rad)
    down = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])  # about base y
    pose = np.eye(4)
    pose[:3, :3] = down @ _ROTATION_BASE_OPTICAL
    pose[:3, 3] = place_base_m
    pose.setflags(write=False)
    return pose


def ramped(now: float, target: float, rise: float, fall: float) -> float:
    """Return a step from ``now`` to ``target``: by ``rise`` away from zero, by ``fall`` towards it.

    A change of sign stops at zero first.
    """
    if now * target < 0.0 or abs(target) < abs(now):
        end = target if now * target >= 0.0 else 0.0
        return max(now - fall, end) if now > 0.0 else min(now + fall, end)
    return min(now + rise, target) if target > now else max(now - rise, target)
