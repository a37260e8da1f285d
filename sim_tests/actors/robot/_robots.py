"""Robots in the physics: the Nova Carter on driven wheels, and any outline moved within its limits.

The base frame lies on the floor (REP-105's base_footprint): x forward, y left, z up.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from importlib import resources
from typing import Any, Final, Literal

import numpy as np
import shapely

from nav_adapter import RobotProfile, RobotState
from nav_adapter.rigid import Motion
from perception.arrays import FloatArray, finite_array, finite_number

from ...world import ROBOT_GROUP, Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError
from ._model import (
    CAMERA_FORWARD_M,
    CAMERA_HEIGHT_M,
    NOVA_CARTER,
    TRACK_M,
    WHEEL_RADIUS_M,
    RobotModel,
)

# Position of a camera that looks all around: above everything on the Nova Carter's post.
_ABOVE_POST_M: Final = (0.12, 0.0, 1.55)
# More than 98 kg at 1 m/s² need on two wheels (7 N·m each), and too little to spin the tyres.
_MAX_WHEEL_TORQUE_NM: Final = 25.0
_TYRE_FRICTION: Final = 1.0
# The axes of the optical frame (x right, y down, z forward) in the base frame, as columns.
_ROTATION_BASE_OPTICAL: Final = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
_IDENTITY: Final = np.eye(4)
# A kinematic body ends this far above the floor.
_FLOOR_GAP_M: Final = 0.02
# A robot that is stopped again within this distance has not gone away meanwhile.
_SAME_PLACE_M: Final = 0.05


class Robot(ABC):
    """A robot in a warehouse, with a camera that looks ahead.

    Its speed (of a holonomic robot its velocity) follows the command within the accelerations of
    the profile, its yaw rate within the yaw acceleration. The curve of a robot that steers is never
    tighter than its turning radius.

    Args:
        warehouse: the world to drive in.
        profile: footprint and limits, with those of the yaw rate.
        camera_m: (x, y, z) of the camera in the base frame.

    Attributes:
        body: PyBullet's id of the robot.
        bumps: number of contacts with racks, walls and props.
        T_base_camera: (4, 4) pose of the optical frame in the base frame.
    """

    body: int

    def __init__(
        self, warehouse: Warehouse, profile: RobotProfile, camera_m: tuple[float, float, float]
    ) -> None:
        self.profile = profile
        T_base_camera = np.eye(4)
        T_base_camera[:3, :3], T_base_camera[:3, 3] = _ROTATION_BASE_OPTICAL, camera_m
        T_base_camera.setflags(write=False)
        self.T_base_camera: FloatArray = T_base_camera
        self._warehouse, self._client = warehouse, warehouse.client
        self.bumps = 0
        self._bumped_at_m: tuple[float, ...] | None = None
        # Speed forward and to the left, and yaw rate: as commanded, and now.
        self._targets = (0.0, 0.0, 0.0)
        self._forward_mps, self._left_mps, self._yaw_rate_radps = 0.0, 0.0, 0.0
        # T_odom_base and T_odom_camera of the same instant.
        self._last_view: tuple[FloatArray | None, FloatArray] = None, np.eye(4)

    def command(self, speed_mps: float, yaw_rate_radps: float, lateral_mps: float = 0.0) -> None:
        """Set the target speed forward, yaw rate, and speed to the left of a holonomic robot.

        A command beyond the robot's limits is clipped, as by its motor controller. Other robots
        ignore ``lateral_mps``.

        Raises:
            SimError: for a number that is not finite; the targets stay.
        """
        forward = finite_number("speed_mps", speed_mps, SimError)
        yaw_rate = finite_number("yaw_rate_radps", yaw_rate_radps, SimError)
        left = finite_number("lateral_mps", lateral_mps, SimError)
        limit, most = self.profile.max_speed_mps, self.profile.max_yaw_rate_radps or 0.0
        if self.profile.drive == "holonomic":
            over = max(math.hypot(forward, left) / limit, 1.0)
            forward, left = forward / over, left / over
        else:
            forward, left = min(max(forward, -limit), limit), 0.0
        self._targets = forward, left, min(max(yaw_rate, -most), most)

    @abstractmethod
    def advance(self, dt_s: float, beside: Sequence[int] = ()) -> None:
        """Follow the command for ``dt_s`` > 0; call it before a physics step.

        ``beside`` are the bodies of people whom the robot may touch in this step.
        """

    def _count_bump(self) -> None:
        """Count a contact with a rack or a wall, once for as long as the robot pushes on."""
        here = self.motion[:2]
        last, self._bumped_at_m = self._bumped_at_m, here
        self.bumps += last is None or math.dist(here, last) > _SAME_PLACE_M

    @property
    def driven_mps(self) -> float:
        """Bound of the speed of all points of the outline, by the drive alone.

        A push from outside does not change it.
        """
        driven = Motion(*(0.0, 0.0, 0.0), self._forward_mps, self._left_mps, self._yaw_rate_radps)
        return driven.fastest_mps(self.profile.circumscribed_radius_m)

    @property
    @abstractmethod
    def motion(self) -> Motion:
        """The robot's motion now."""

    def state(self, stamp_s: float) -> RobotState:
        """Return the robot's state."""
        now, holonomic = self.motion, self.profile.drive == "holonomic"
        return RobotState(
            stamp_s=stamp_s,
            position_odom_m=np.array([now.x_m, now.y_m]),
            heading_odom_rad=math.remainder(now.heading_rad, math.tau),
            speed_mps=now.forward_mps,
            yaw_rate_radps=now.yaw_rate_radps,
            velocity_base_mps=np.array([now.forward_mps, now.left_mps]) if holonomic else None,
        )

    @property
    @abstractmethod
    def T_odom_base(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the base frame in odom."""

    @property
    def T_odom_camera(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the camera's optical frame in odom."""
        T_odom_base = self.T_odom_base
        if self._last_view[0] is not T_odom_base:
            T_odom_camera = T_odom_base.dot(self.T_base_camera)
            T_odom_camera.setflags(write=False)
            self._last_view = T_odom_base, T_odom_camera
        return self._last_view[1]

    @abstractmethod
    def touches(self, body: int) -> bool:
        """Return whether another body touches the robot."""

    def _ramp(self, dt_s: float) -> bool:
        """Bring speeds and yaw rate nearer to the command; return whether they change."""
        before = self._forward_mps, self._left_mps, self._yaw_rate_radps
        if before == self._targets:
            return False
        profile, (forward, left, yaw_rate) = self.profile, self._targets
        rise, fall = profile.max_acceleration_mps2 * dt_s, profile.max_deceleration_mps2 * dt_s
        if profile.drive == "holonomic":
            change = forward - self._forward_mps, left - self._left_mps
            size = math.hypot(*change)
            slows = math.hypot(forward, left) < math.hypot(self._forward_mps, self._left_mps)
            share = min((fall if slows else rise) / max(size, 1e-12), 1.0)
            self._forward_mps += share * change[0]
            self._left_mps += share * change[1]
        else:
            self._forward_mps = _ramped(self._forward_mps, forward, rise, fall)
        step = (profile.max_yaw_acceleration_radps2 or 0.0) * dt_s
        self._yaw_rate_radps = _ramped(self._yaw_rate_radps, yaw_rate, step, step)
        if profile.min_turning_radius_m is not None:  # the yaw rate falls with the speed
            most = abs(self._forward_mps) / profile.min_turning_radius_m
            self._yaw_rate_radps = min(max(self._yaw_rate_radps, -most), most)
        return before != (self._forward_mps, self._left_mps, self._yaw_rate_radps)


class Amr(Robot):
    """The Nova Carter, a differential drive with a camera on a post; see :data:`NOVA_CARTER`.

    The base frame lies midway between the drive wheels. Only the motors of the two wheel joints
    move the robot, and their torque is limited.

    Args:
        warehouse: the world to drive in.
        position_odom_m: (2,) start.
        heading_odom_rad: heading at the start, counter-clockwise from odom x.
        camera_mount: ``"front"`` or ``"top"`` of the post.

    Raises:
        SimError: for arguments that are not finite or out of range.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        position_odom_m: Any = (0.0, 0.0),
        heading_odom_rad: float = 0.0,
        camera_mount: Literal["front", "top"] = "front",
    ) -> None:
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        front_m = (CAMERA_FORWARD_M, 0.0, CAMERA_HEIGHT_M)
        camera_m = _ABOVE_POST_M if camera_mount == "top" else front_m
        super().__init__(warehouse, NOVA_CARTER, camera_m)
        source = resources.files("sim_tests.actors.robot") / "amr.urdf"
        with resources.as_file(source) as path:
            self.body = pybullet.loadURDF(
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
        self._read_at_step = -1
        self._last_pose: tuple[FloatArray, Motion] = np.eye(4), Motion(0.0, 0.0)
        self._drive()

    def advance(self, dt_s: float, beside: Sequence[int] = ()) -> None:
        """Ramp the wheels towards the command for ``dt_s`` > 0; physics keeps bodies apart."""
        dt = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        if self._ramp(dt):
            self._drive()
        # Of the last step. The wheels touch the floor, the body racks, walls and people alone.
        points = pybullet.getContactPoints(self.body, linkIndexA=-1, physicsClientId=self._client)
        obstacles = self._warehouse.obstacle_bodies
        if any(point[2] in obstacles and _touch(point) for point in points):
            self._count_bump()

    @property
    def motion(self) -> Motion:
        """The motion in the physics; the velocity points along the heading."""
        return self._pose()[1]

    @property
    def T_odom_base(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the base frame in odom, with the slight pitch of its motion."""
        return self._pose()[0]

    @property
    def wheel_angles_rad(self) -> tuple[float, float]:
        """Rotation of the left and the right wheel about base y."""
        left, right = pybullet.getJointStates(self.body, self._wheels, physicsClientId=self._client)
        return left[0], right[0]

    def touches(self, body: int) -> bool:
        """Return whether another body touches the robot."""
        points = pybullet.getContactPoints(self.body, body, physicsClientId=self._client)
        return any(_touch(point) for point in points)

    def _pose(self) -> tuple[FloatArray, Motion]:
        """Return pose and motion after the latest step; they are read once per step."""
        if self._read_at_step == self._warehouse.steps:
            return self._last_pose
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
        T = _IDENTITY.copy()
        T[:3, :3], T[:3, 3] = rotation, com + arm
        T.setflags(write=False)
        heading, forward = math.atan2(entries[3], entries[0]), origin_velocity.dot(rotation[:, 0])
        x, y = T[:2, 3].tolist()
        self._last_pose = T, Motion(x, y, heading, float(forward), 0.0, angular[2])
        return self._last_pose

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
                (self._forward_mps - turn) / WHEEL_RADIUS_M,
                (self._forward_mps + turn) / WHEEL_RADIUS_M,
            ],
            forces=[_MAX_WHEEL_TORQUE_NM, _MAX_WHEEL_TORQUE_NM],
            physicsClientId=self._client,
        )


class KinematicRobot(Robot):
    """Any robot that drives as its profile says, without wheels and motors.

    The outline, extruded up to the height of the body, is what people touch. Racks, walls and
    people stop it.

    Args:
        warehouse: the world to drive in.
        model: the robot.
        position_odom_m: (2,) start of the base origin.
        heading_odom_rad: heading at the start, counter-clockwise from odom x.

    Raises:
        SimError: for a position or heading that is not finite.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        model: RobotModel,
        position_odom_m: Any = (0.0, 0.0),
        heading_odom_rad: float = 0.0,
    ) -> None:
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        self._at = Motion(x, y, heading)
        super().__init__(warehouse, model.profile, model.camera_m)
        self.model = model
        self._outline_m = model.outline_m
        self._boxes = shapely.STRtree(shapely.box(*warehouse.obstacle_boxes_odom.T))
        self.body = self._make_body()
        self._place()

    def advance(self, dt_s: float, beside: Sequence[int] = ()) -> None:
        """Move the body for ``dt_s`` > 0, but no deeper into people whom it touches."""
        dt = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        self._ramp(dt)
        if self._forward_mps == self._left_mps == self._yaw_rate_radps == 0.0:
            return
        before, touched = self._at, [each for each in beside if self.touches(each)]
        deep_m = [self._depth_m(each) for each in touched]
        self._at = self.motion.at(dt)
        bumps = self._hits_a_box()
        if not bumps:
            self._place()
        if bumps or any(self._depth_m(b) > d for b, d in zip(touched, deep_m, strict=True)):
            self._at = before
            self._forward_mps = self._left_mps = self._yaw_rate_radps = 0.0
            self._place()
        if bumps:
            self._count_bump()

    @property
    def motion(self) -> Motion:
        """The robot's motion now."""
        return self._at._replace(
            forward_mps=self._forward_mps,
            left_mps=self._left_mps,
            yaw_rate_radps=self._yaw_rate_radps,
        )

    @property
    def T_odom_base(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the base frame in odom."""
        return self._T_odom_base

    def touches(self, body: int) -> bool:
        """Return whether another body touches the outline."""
        return self._warehouse.nearest(self.body, body, 0.0) is not None

    def _depth_m(self, body: int) -> float:
        """Return how deep another body and the outline overlap, 0 when apart."""
        nearest = self._warehouse.nearest(self.body, body, 0.0)
        return 0.0 if nearest is None else -nearest.distance_m

    def _hits_a_box(self) -> bool:
        """Return whether the outline overlaps a rack, a wall or a prop."""
        corners = [self._at.point(*corner) for corner in self._outline_m.tolist()]
        return bool(len(self._boxes.query(shapely.polygons(corners), predicate="intersects")))

    def _make_body(self) -> int:
        low, high = (
            np.column_stack([self._outline_m, np.full(len(self._outline_m), z)])
            for z in (_FLOOR_GAP_M, self.model.height_m)
        )
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH,
            vertices=np.vstack([low, high]).tolist(),
            physicsClientId=self._client,
        )
        # A body without mass stays where it is put, and nothing pushes it.
        body: int = pybullet.createMultiBody(
            baseMass=0.0, baseCollisionShapeIndex=shape, physicsClientId=self._client
        )
        pybullet.setCollisionFilterGroupMask(
            body, -1, ROBOT_GROUP, -1, physicsClientId=self._client
        )
        return body

    def _place(self) -> None:
        x, y, heading = self._at[:3]
        half = 0.5 * heading
        pybullet.resetBasePositionAndOrientation(
            self.body,
            [x, y, 0.0],
            [0.0, 0.0, math.sin(half), math.cos(half)],
            physicsClientId=self._client,
        )
        cos, sin = math.cos(heading), math.sin(heading)
        T = np.eye(4)
        T[:2, :2] = [[cos, -sin], [sin, cos]]
        T[:2, 3] = x, y
        T.setflags(write=False)
        self._T_odom_base: FloatArray = T


def robot_of(
    warehouse: Warehouse,
    model: RobotModel | None,
    position_odom_m: Any = (0.0, 0.0),
    heading_odom_rad: float = 0.0,
    *,
    camera_mount: Literal["front", "top"] = "front",
) -> Amr | KinematicRobot:
    """Place the robot of a model; None is the Nova Carter, whose camera alone can be mounted."""
    if model is None or model.body == "nova_carter":
        return Amr(warehouse, position_odom_m, heading_odom_rad, camera_mount)
    return KinematicRobot(warehouse, model, position_odom_m, heading_odom_rad)


def _touch(point: Sequence[Any]) -> bool:
    """Return whether two bodies overlap at a contact point of PyBullet, or press on each other.

    A collision may stop a body a hair's breadth before it overlaps the other.
    """
    return bool(point[8] <= 0.0 or point[9] > 0.0)


def _ramped(now: float, target: float, rise: float, fall: float) -> float:
    """Return a step from ``now`` to ``target``: by ``rise`` away from zero, by ``fall`` towards it.

    A change of sign stops at zero first.
    """
    if now * target < 0.0 or abs(target) < abs(now):
        end = target if now * target >= 0.0 else 0.0
        return max(now - fall, end) if now > 0.0 else min(now + fall, end)
    return min(now + rise, target) if target > now else max(now - rise, target)
