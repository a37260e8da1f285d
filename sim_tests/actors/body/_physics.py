"""The collision bodies of a worker: capsules on spherical joints, the carried box, the seat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Final

from perception.arrays import FloatArray

from ...world import PERSON_GROUP, RAY_GROUP, ROBOT_GROUP, Warehouse
from ...world.bullet import pybullet
from ._asset import JOINTS, PARENTS, Capsule
from ._postures import BOX_SIZE_M, arm_postures
from ._quaternions import IDENTITY, Quaternion, Vector, rotation_z, subtract
from ._skeleton import Skeleton
from ._skin import Seat

_SPINE: Final = JOINTS.index("spine")
# Row of the box. A prismatic joint on the thorax takes it away while the hands are empty.
_BOX: Final = len(JOINTS)
# Rows of JOINTS and of the box in PyBullet's order of links, depth first. Eyes do not collide.
_LINKS: Final = (
    *(row for row in range(JOINTS.index("left_hip")) if not JOINTS[row].endswith("_eye")),
    _BOX,
    *range(JOINTS.index("left_hip"), len(JOINTS)),
)
_LINK_PARENTS: Final = (*PARENTS, _SPINE)
# Spherical joints need masses and motors. With these, a robot that pushes for seconds moves a limb
# by less than a millimetre.
_LINK_MASS_KG: Final = 1000.0
_HOLDING_NM: Final = 1e5
# Place of a box that is not carried: far below the floor.
_PARKED_M: Final = -100.0


class WorkerBody:
    """A kinematic multibody that stays where it is placed, even if a robot pushes it.

    Its base is the pelvis with the hips' midpoint as origin (x forward, y left, z up at rest).
    """

    def __init__(self, warehouse: Warehouse, skeleton: Skeleton, seat: Seat) -> None:
        self._client = warehouse.client
        self._hips_m = skeleton.hips_m
        # Made when it is first sat on.
        self._seat: SeatBody | None = None
        self._make_seat = partial(SeatBody, warehouse, seat.size_m)
        rows = (-1, *_LINKS)
        centres = {row: skeleton.joint_m(name) for row, name in enumerate(JOINTS)}
        centres |= {-1: skeleton.hips_m, _BOX: arm_postures(skeleton).box_m}
        shapes = [
            self._box()
            if row == _BOX
            else self._capsules(
                [c for c in skeleton.asset.capsules if c.joint == row], skeleton.scale, centres[row]
            )
            for row in rows
        ]
        count = len(_LINKS)
        self.body = int(
            pybullet.createMultiBody(
                baseMass=0.0,
                baseCollisionShapeIndex=shapes[0],
                baseVisualShapeIndex=-1,
                basePosition=skeleton.hips_m,
                linkMasses=[_LINK_MASS_KG] * count,
                linkCollisionShapeIndices=shapes[1:],
                linkVisualShapeIndices=[-1] * count,
                linkPositions=[
                    subtract(centres[row], centres[_LINK_PARENTS[row]]) for row in _LINKS
                ],
                linkOrientations=[IDENTITY] * count,
                linkInertialFramePositions=[(0.0, 0.0, 0.0)] * count,
                linkInertialFrameOrientations=[IDENTITY] * count,
                linkParentIndices=[rows.index(_LINK_PARENTS[row]) for row in _LINKS],
                linkJointTypes=[
                    pybullet.JOINT_PRISMATIC if row == _BOX else pybullet.JOINT_SPHERICAL
                    for row in _LINKS
                ],
                linkJointAxis=[(0.0, 0.0, 1.0)] * count,
                flags=pybullet.URDF_ENABLE_SLEEPING,
                physicsClientId=self._client,
            )
        )
        self._joints = list(range(count))
        for joint, row in enumerate(_LINKS):
            if row == _BOX:
                pybullet.setJointMotorControl2(
                    self.body,
                    joint,
                    pybullet.VELOCITY_CONTROL,
                    targetVelocity=0.0,
                    force=_HOLDING_NM,
                    physicsClientId=self._client,
                )
            else:
                pybullet.setJointMotorControlMultiDof(
                    self.body,
                    joint,
                    pybullet.POSITION_CONTROL,
                    targetPosition=IDENTITY,
                    targetVelocity=(0.0, 0.0, 0.0),
                    positionGain=0.0,
                    velocityGain=1.0,
                    force=(_HOLDING_NM,) * 3,
                    physicsClientId=self._client,
                )
        for link in range(-1, count):
            pybullet.setCollisionFilterGroupMask(
                self.body, link, PERSON_GROUP, ROBOT_GROUP | RAY_GROUP, physicsClientId=self._client
            )

    def place(
        self,
        hips_odom_m: Vector,
        pelvis_odom: Quaternion,
        joints: Sequence[Quaternion],
        with_box: bool,
        T_odom_seat: FloatArray | None = None,
    ) -> None:
        """Set the pose.

        Args:
            hips_odom_m: midpoint of the hips.
            pelvis_odom: rotation of the pelvis.
            joints: rotation of every joint in :data:`JOINTS`, in axes parallel to the body's at
                rest.
            with_box: whether the box is in the hands.
            T_odom_seat: (4, 4) pose of the seat's middle; None stands.
        """
        slide = (0.0 if with_box else _PARKED_M,)
        if self._seat is None and T_odom_seat is not None:
            self._seat = self._make_seat()
        if self._seat is not None:
            self._seat.place(T_odom_seat)
        pybullet.resetBasePositionAndOrientation(
            self.body, hips_odom_m, pelvis_odom, physicsClientId=self._client
        )
        pybullet.resetJointStatesMultiDof(
            self.body,
            self._joints,
            [slide if row == _BOX else joints[row] for row in _LINKS],
            physicsClientId=self._client,
        )
        # A sleeping body costs no time in a physics step. A robot that touches it wakes it.
        pybullet.changeDynamics(
            self.body,
            -1,
            activationState=pybullet.ACTIVATION_STATE_SLEEP,
            physicsClientId=self._client,
        )

    def _capsules(self, capsules: list[Capsule], scale: float, centre_m: Vector) -> int:
        """Make one collision shape of a link's capsules; return −1 without any."""
        if not capsules:
            return -1
        ends = [
            [_relative(end, scale, centre_m) for end in (capsule.start_m, capsule.end_m)]
            for capsule in capsules
        ]
        return int(
            pybullet.createCollisionShapeArray(
                shapeTypes=[pybullet.GEOM_CAPSULE] * len(capsules),
                radii=[capsule.radius_m * scale for capsule in capsules],
                lengths=[max(math.dist(start, end), 1e-4) for start, end in ends],
                collisionFramePositions=[
                    [0.5 * (a + b) for a, b in zip(start, end, strict=True)] for start, end in ends
                ],
                collisionFrameOrientations=[
                    _rotation_from_z(subtract(end, start)) for start, end in ends
                ],
                physicsClientId=self._client,
            )
        )

    def _box(self) -> int:
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=[0.5 * side for side in BOX_SIZE_M],
                physicsClientId=self._client,
            )
        )


class SeatBody:
    """The collision shape of a seat, a box without legs; a robot cannot move it."""

    def __init__(self, warehouse: Warehouse, size_m: Vector) -> None:
        self._client = warehouse.client
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[0.5 * side for side in size_m],
            physicsClientId=self._client,
        )
        self.body = int(
            pybullet.createMultiBody(
                baseMass=0.0,
                baseCollisionShapeIndex=shape,
                baseVisualShapeIndex=-1,
                basePosition=(0.0, 0.0, _PARKED_M),
                physicsClientId=self._client,
            )
        )
        pybullet.setCollisionFilterGroupMask(
            self.body, -1, PERSON_GROUP, ROBOT_GROUP | RAY_GROUP, physicsClientId=self._client
        )

    def place(self, T_odom_seat: FloatArray | None) -> None:
        """Put the seat's middle and axes at a pose (4, 4); None takes it away."""
        position, turn = [0.0, 0.0, _PARKED_M], list(IDENTITY)
        if T_odom_seat is not None:
            position = T_odom_seat[:3, 3].tolist()
            yaw = math.atan2(T_odom_seat[1, 0], T_odom_seat[0, 0])
            turn = list(rotation_z(yaw))
        pybullet.resetBasePositionAndOrientation(
            self.body, position, turn, physicsClientId=self._client
        )


def _relative(point_m: Vector, scale: float, centre_m: Vector) -> Vector:
    """Return a scaled point relative to a centre."""
    scaled = (point_m[0] * scale, point_m[1] * scale, point_m[2] * scale)
    return subtract(scaled, centre_m)


def _rotation_from_z(direction: Vector) -> Quaternion:
    """Return the shortest rotation from z, the axis of PyBullet's capsules, to a direction."""
    x, y, z = direction
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9 or z < -length * (1.0 - 1e-9):
        return IDENTITY  # a capsule upside down is the same
    w = 1.0 + z / length
    norm = math.sqrt((x * x + y * y) / (length * length) + w * w)
    return (-y / length / norm, x / length / norm, 0.0, w / norm)
