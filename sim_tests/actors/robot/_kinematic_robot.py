"""A robot whose body is moved within its limits: any outline, any kinematic model."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from nav_adapter import RobotState
from perception.arrays import FloatArray, finite_array, finite_number

from ...world import ROBOT_GROUP, Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError
from ._amr import camera_pose, ramped
from ._model import RobotModel

# The body ends this far above the floor.
_FLOOR_GAP_M: Final = 0.02
# A robot that is stopped again within this distance has not gone away meanwhile.
_SAME_PLACE_M: Final = 0.05


class KinematicRobot:
    """A robot in a warehouse that drives as its profile says, without wheels and motors.

    The speed (of a holonomic robot the velocity) ramps within the accelerations, the yaw rate
    within the yaw acceleration, and the curve of a robot that steers is never tighter than its
    turning radius. The outline, extruded up to the height of the body, is what people touch. Racks
    and walls stop it.

    Args:
        warehouse: the world to drive in.
        model: the robot.
        position_odom_m: (2,) start of the base origin.
        heading_odom_rad: heading at the start, counter-clockwise from odom x.

    Attributes:
        body: PyBullet's id of the robot.
        profile: footprint and limits.
        T_base_camera: (4, 4) pose of the optical frame in the base frame.
        bumps: number of times that a rack or a wall stopped it.

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
        self._x_m, self._y_m = x, y
        self._heading_rad = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        self.model = model
        self.profile = model.profile
        self.T_base_camera = camera_pose(model.camera_m)
        self.bumps = 0
        self._outline_m = model.outline_m
        self._client = warehouse.client
        self._boxes_odom_m = warehouse.obstacle_boxes_odom
        self._targets = (0.0, 0.0, 0.0)
        self._forward_mps, self._left_mps, self._yaw_rate_radps = 0.0, 0.0, 0.0
        self._bumped_at_m: tuple[float, float] | None = None
        self.body = self._make_body()
        self._place()

    def command(self, speed_mps: float, yaw_rate_radps: float, lateral_mps: float = 0.0) -> None:
        """Set the target speed forward, yaw rate, and speed to the left of a holonomic robot.

        A command beyond the robot's limits is clipped, as by its motor controller.
        """
        forward = finite_number("speed_mps", speed_mps, SimError)
        yaw_rate = finite_number("yaw_rate_radps", yaw_rate_radps, SimError)
        left = finite_number("lateral_mps", lateral_mps, SimError)
        if self.profile.drive != "holonomic":
            left = 0.0
        over = max(math.hypot(forward, left) / self.profile.max_speed_mps, 1.0)
        most = self.model.max_yaw_rate_radps
        self._targets = forward / over, left / over, min(max(yaw_rate, -most), most)

    def advance(self, dt_s: float) -> None:
        """Move the body for ``dt_s`` > 0; call it before a physics step."""
        dt = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        self._ramp(dt)
        if self._forward_mps == self._left_mps == self._yaw_rate_radps == 0.0:
            return
        before = self._x_m, self._y_m, self._heading_rad
        middle = self._heading_rad + 0.5 * self._yaw_rate_radps * dt
        cos, sin = math.cos(middle), math.sin(middle)
        self._x_m += (self._forward_mps * cos - self._left_mps * sin) * dt
        self._y_m += (self._forward_mps * sin + self._left_mps * cos) * dt
        self._heading_rad += self._yaw_rate_radps * dt
        if self._hits_a_box():
            self._x_m, self._y_m, self._heading_rad = before
            self._forward_mps = self._left_mps = self._yaw_rate_radps = 0.0
            self._count_bump()
            return
        self._place()

    @property
    def driven_speed_mps(self) -> float:
        """Present speed along the direction of travel; negative backward."""
        if self._left_mps == 0.0:
            return self._forward_mps
        return math.hypot(self._forward_mps, self._left_mps)

    def state(self, stamp_s: float) -> RobotState:
        """Return the robot's state."""
        holonomic = self.profile.drive == "holonomic"
        return RobotState(
            stamp_s=stamp_s,
            position_odom_m=np.array([self._x_m, self._y_m]),
            heading_odom_rad=math.remainder(self._heading_rad, math.tau),
            speed_mps=self._forward_mps,
            yaw_rate_radps=self._yaw_rate_radps,
            velocity_base_mps=(
                np.array([self._forward_mps, self._left_mps]) if holonomic else None
            ),
        )

    @property
    def velocity_odom_mps(self) -> FloatArray:
        """(2,) velocity of the base origin."""
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        return np.array(
            [
                self._forward_mps * cos - self._left_mps * sin,
                self._forward_mps * sin + self._left_mps * cos,
            ]
        )

    @property
    def T_odom_base(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the base frame in odom."""
        return self._T_odom_base

    @property
    def T_odom_camera(self) -> FloatArray:  # noqa: N802
        """(4, 4) pose of the camera's optical frame in odom."""
        return self._T_odom_camera

    def touches(self, body: int) -> bool:
        """Return whether another body touches the outline."""
        return bool(pybullet.getClosestPoints(self.body, body, 0.0, physicsClientId=self._client))

    def _ramp(self, dt_s: float) -> None:
        """Bring speeds and yaw rate nearer to the command."""
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
            self._forward_mps = ramped(self._forward_mps, forward, rise, fall)
        step = self.model.max_yaw_acceleration_radps2 * dt_s
        self._yaw_rate_radps = ramped(self._yaw_rate_radps, yaw_rate, step, step)
        if profile.min_turning_radius_m is not None:  # the yaw rate falls with the speed
            most = abs(self._forward_mps) / profile.min_turning_radius_m
            self._yaw_rate_radps = min(max(self._yaw_rate_radps, -most), most)

    def _count_bump(self) -> None:
        """Count a stop at a rack or wall, once for as long as the robot pushes on."""
        here = self._x_m, self._y_m
        last = self._bumped_at_m
        self.bumps += last is None or math.dist(here, last) > _SAME_PLACE_M
        self._bumped_at_m = here

    def _hits_a_box(self) -> bool:
        """Return whether the outline overlaps a rack, a wall or a prop."""
        boxes, reach = self._boxes_odom_m, self.profile.circumscribed_radius_m
        position = np.array([self._x_m, self._y_m])
        apart = np.maximum(boxes[:, :2] - position, position - boxes[:, 2:]).max(axis=1)
        near = boxes[apart < reach]
        if not len(near):
            return False
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        corners = self._outline_m @ np.array([[cos, sin], [-sin, cos]]) + position
        return any(_overlap(corners, box) for box in near)

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
        """Put the body where the robot is."""
        half = 0.5 * self._heading_rad
        pybullet.resetBasePositionAndOrientation(
            self.body,
            [self._x_m, self._y_m, 0.0],
            [0.0, 0.0, math.sin(half), math.cos(half)],
            physicsClientId=self._client,
        )
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        T = np.eye(4)
        T[:2, :2] = [[cos, -sin], [sin, cos]]
        T[:2, 3] = self._x_m, self._y_m
        T.setflags(write=False)
        self._T_odom_base: FloatArray = T
        self._T_odom_camera: FloatArray = np.asarray(T @ self.T_base_camera)
        self._T_odom_camera.setflags(write=False)


def _overlap(corners_m: FloatArray, box_m: FloatArray) -> bool:
    """Return whether a convex outline (M, 2) overlaps an axis-aligned box, by separating axes."""
    edges = np.roll(corners_m, -1, axis=0) - corners_m
    normals = np.vstack([np.column_stack([edges[:, 1], -edges[:, 0]]), np.eye(2)])
    x0, y0, x1, y1 = box_m.tolist()
    ours = corners_m @ normals.T
    theirs = np.array([[x0, y0], [x0, y1], [x1, y0], [x1, y1]]) @ normals.T
    apart = (ours.max(axis=0) <= theirs.min(axis=0)) | (theirs.max(axis=0) <= ours.min(axis=0))
    return not bool(apart.any())
